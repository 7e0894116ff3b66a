// SPDX-License-Identifier: MIT
#include "fluid/surface_stress.hpp"
#include "tests/support/fluid_cases.hpp"

#include <gtest/gtest.h>

#include <fmt/format.h>
#include <numbers>

namespace sluice::fluid {
namespace {

using testing::FrozenCloud;

constexpr double h = 0.05;

FrozenCloud basin() {
  return FrozenCloud(testing::lattice(20, 10, h),
                     testing::polyline({{0, 1}, {0, 0}, {1, 0}, {1, 1}}), h);
}

TEST(SurfaceStress, AStretchedSurfaceIsUnderTheTensionOfItsFluid) {
  FrozenCloud frozen = basin();
  SurfacePoints surface;
  constexpr double rate = 3, mu = 2;
  const auto velocity =
      frozen.values([](const Vec<2> &x) { return Vec<2>(rate * x.x(), -rate * x.y()); });
  const std::vector<double> viscosity(frozen.size(), mu);
  for (const double factor : {1e-9, 1e-3, 1e3}) { // uniform along the surface: any step
    frozen.points.surface_pressure.assign(frozen.size(), 0);
    update_surface_pressure<2>(frozen.cloud, viscosity, velocity, factor, frozen.points, surface);
    int n_surface = 0;
    for (int i = 0; i < frozen.size(); ++i) {
      const bool is_open = frozen.cloud.kind[i] == PointKind::surface;
      n_surface += is_open;
      // p = 2 mu n . E n, and the flow is linear; normals of the lattice are vertical to 1e-6
      EXPECT_NEAR(frozen.points.surface_pressure[i], is_open ? -2 * mu * rate : 0, 1e-5);
    }
    EXPECT_EQ(n_surface, 20);
  }
}

TEST(SurfaceStress, APressureOutsideRaisesThatInsideAndPushesNothing) {
  FrozenCloud frozen = basin();
  const PressureParams params;
  PressureProblem<2> problem;
  const std::vector<Vec<2>> velocity(frozen.size(), Vec<2>::Zero());
  const std::vector<double> target(frozen.size(), 0);
  assemble_pressure_operators(frozen.points, frozen.cloud, params, problem);
  constexpr double outside = 7;
  for (int i = 0; i < frozen.size(); ++i)
    frozen.points.surface_pressure[i] = frozen.cloud.kind[i] == PointKind::surface ? outside : 0;
  assemble_pressure_source<2>(frozen.points, frozen.cloud, params, velocity, target, 1e-3, problem);
  const std::vector<double> pressure(frozen.size(), outside);
  for (int i = 0; i < frozen.size(); ++i) {
    double row = problem.matrix.diagonal[i] * outside;
    problem.matrix.for_each_entry(i, [&](int, double value) { row += value * outside; });
    EXPECT_NEAR(row, problem.fluid_source[i], 1e-12);
    EXPECT_NEAR(pressure_gradient(i, frozen.points, frozen.cloud, problem, pressure).norm(), 0,
                1e-12);
  }
}

// Potential energy is back where it was once per half a period; what kinetic energy has gone then
// is the work of viscosity.
double lost_in_half_a_period(double viscosity) {
  const double k = std::numbers::pi, omega = std::sqrt(9.81 * k * std::tanh(k));
  const Scene<2> scene = testing::scene_of(fmt::format(R"~(
[fluid]
spacing_m = 0.05
dynamic_viscosity_pa_s = {}
water_m = [[0, 0], [1, 0], [1, 1], [0, 1]]
time_order = 2
start_velocity_m_s = ["-0.1*sin(_pi*x)*cosh(_pi*y)", "0.1*cos(_pi*x)*sinh(_pi*y)"]
[[fluid.wall]]
name = "tank"
condition = "free-slip"
points_m = [[0, 1.5], [0, 0], [1, 0], [1, 1.5]]
)~",
                                                       viscosity));
  FluidSolver<2> solver(scene);
  const auto energy = [&] {
    double sum = 0;
    for (const Vec<2> &u : solver.state.points.velocity)
      sum += u.squaredNorm();
    return sum;
  };
  const double start = energy();
  double most = 0;
  constexpr double dt = 0.01;
  for (int step = 1; step * dt < 1.2 * k / omega; ++step) {
    solver.begin_step(dt);
    solver.iterate();
    solver.end_step();
    if (step * dt > 0.8 * k / omega)
      most = std::max(most, energy());
  }
  return std::log(start / most);
}

// Amplitudes decay as exp(-2 nu k^2 t) (Lamb, Hydrodynamics, art. 348): without the normal stress
// by half of that. Twenty points to half a wave give four fifths, and the rest at first order.
TEST(SurfaceStress, AStandingWaveIsDampedByBothPartsOfTheTraction) {
  const double k = std::numbers::pi, omega = std::sqrt(9.81 * k * std::tanh(k));
  const double viscosity = 14, exact = 2 * 2 * viscosity / 1000 * k * k * k / omega;
  const double lost = lost_in_half_a_period(viscosity) - lost_in_half_a_period(0);
  std::printf("lost: %.3f of %.3f\n", lost, exact);
  EXPECT_GT(lost, 0.7 * exact);
  EXPECT_LT(lost, exact);
}

} // namespace
} // namespace sluice::fluid
