// SPDX-License-Identifier: MIT
#include "fluid/diagnostics.hpp"
#include "fluid/parallel.hpp"
#include "tests/support/fluid_cases.hpp"

#include <gtest/gtest.h>

namespace sluice::fluid {
namespace {

void advance(FluidSolver &solver, double dt, int steps) {
  for (int n = 0; n < steps; ++n) {
    solver.begin_step(dt);
    solver.iterate();
    solver.end_step();
  }
}

void expect_same_bits(const Points &a, const Points &b) {
  ASSERT_EQ(a.id, b.id);
  ASSERT_EQ(a.pressure, b.pressure);
  ASSERT_EQ(a.position, b.position);
  ASSERT_EQ(a.velocity, b.velocity);
  ASSERT_EQ(a.shift, b.shift);
}

void expect_rest(const Scene &scene, double speed, double energy) {
  FluidSolver solver(scene);
  advance(solver, 5e-4, 1);
  const Integrals start = integrate(solver);
  double largest = start.max_speed;
  for (int n = 1; n < 100; ++n) {
    advance(solver, 5e-4, 1);
    largest = std::max(largest, integrate(solver).max_speed);
  }
  const Integrals end = integrate(solver);
  const double scale = std::sqrt(9.81 * 0.14);
  std::printf("rest: largest speed %.2e sqrt(gH), energy change %.2e\n", largest / scale,
              (end.potential + end.kinetic) / (start.potential + start.kinetic) - 1);
  EXPECT_LT(largest, speed * scale);
  EXPECT_NEAR((end.potential + end.kinetic) / (start.potential + start.kinetic), 1, energy);
  EXPECT_NEAR(end.volume, 0.014, 0.014 * energy);
  EXPECT_EQ(solver.state.wall_returns + solver.state.lost_points + solver.state.outflow_points, 0);
}

// At the case's own tolerance of the pressure solve.
TEST(Step, WaterAtRestBehindARigidGateStaysAtRest) {
  expect_rest(testing::scene_of(testing::gate_tank()), 1e-6, 1e-10);
}

// A plate thinner than the kernel radius (2.6 spacings): its far face must not be seen.
TEST(Step, WaterAtRestBehindAThinRigidGateStaysAtRest) {
  expect_rest(testing::scene_of(testing::gate_tank(0.005)), 1e-6, 1e-10);
}

TEST(Step, OneThreadAndTwoGiveTheSameBits) {
  const Scene scene = testing::scene_of(testing::dam_break, {"fluid.spacing_m=0.001"});
  const int threads = number_of_threads();
  FluidSolver one(scene), two(scene);
  set_number_of_threads(1);
  advance(one, 2e-4, 4);
  set_number_of_threads(2);
  advance(two, 2e-4, 4);
  set_number_of_threads(threads);
  // Or loops with little to do per point would run on one thread alone.
  EXPECT_TRUE(is_worth_threads(one.state.points.size(), Work::light));
  expect_same_bits(one.state.points, two.state.points);
}

// A tank full to its lid has no surface: the pressure is known up to a constant.
TEST(Step, AClosedFullTankStaysAtRestUnderItsWeight) {
  const double h = 0.05;
  Scene scene;
  scene.params.spacing = h;
  scene.walls = testing::closed_box(1, 0.8);
  scene.initial.points = testing::points_at(testing::lattice(20, 16, h));
  FluidSolver solver(scene);
  advance(solver, 1e-3, 20);
  EXPECT_LT(integrate(solver).max_speed, 1e-6 * std::sqrt(9.81 * 0.8));
  const auto &points = solver.state.points;
  for (int i = 1; i < points.size(); ++i)
    EXPECT_NEAR(points.pressure[i] - points.pressure[0],
                -9810 * (points.position[i].y() - points.position[0].y()), 1e-4 * 7848);
}

TEST(Step, WaterThatHasAllLeftIsSaidSo) {
  Scene scene = testing::scene_of(testing::dam_break);
  scene.params.outlet_x = -1;
  FluidSolver solver(scene);
  const std::string message = testing::message_of([&] { solver.begin_step(1e-3); });
  EXPECT_TRUE(testing::contains(message, "no water is left")) << message;
}

TEST(Step, ARestoredStateRepeatsItsStepsToTheBit) {
  FluidSolver solver(testing::scene_of(testing::dam_break, {"fluid.spacing_m=0.004"}));
  advance(solver, 5e-4, 10);
  const FluidState checkpoint = solver.state;
  advance(solver, 5e-4, 5);
  const FluidState first = solver.state;
  solver.state = checkpoint;
  advance(solver, 5e-4, 5);
  expect_same_bits(solver.state.points, first.points);
  EXPECT_EQ(solver.state.step, first.step);
  EXPECT_EQ(solver.state.wall_returns, first.wall_returns);
}

TEST(Step, ChangeOfMomentumIsWeightPlusWallImpulses) {
  FluidSolver solver(testing::scene_of(testing::dam_break, {"fluid.spacing_m=0.004"}));
  const FluidParams &params = solver.params();
  constexpr double dt = 5e-4;
  constexpr int steps = 120;
  const double weight = params.density * 9.81 * 0.1 * 0.12;
  const double scale = params.density * 9.81 * 0.12 * 0.12 / 2; // rho g H^2 / 2
  WallQuadrature walls;
  std::vector<Vec<2>> traction;
  Vec<2> impulse(0, 0);
  double worst = 0;
  for (int n = 0; n < steps; ++n) {
    solver.begin_step(dt);
    solver.iterate();
    const Points &points = solver.state.points;
    build_wall_quadrature(points, solver.walls, solver.cloud(), WallPart::all, walls);
    evaluate_tractions(points, solver.walls, solver.cloud(), solver.problem(), points.pressure,
                       solver.viscosity(), walls, traction);
    const Vec<2> on_walls = integrate_resultant(walls, traction).force;
    impulse += dt * (Vec<2>(0, -weight) - on_walls);
    solver.end_step();
    worst = std::max(worst, (integrate(solver).momentum - impulse).norm());
  }
  const Vec<2> momentum = integrate(solver).momentum;
  std::printf("momentum (%.4f, %.4f) N s/m, impulse (%.4f, %.4f); mean force missing: %.2f %% of "
              "rho g H^2 / 2\n",
              momentum.x(), momentum.y(), impulse.x(), impulse.y(),
              100 * (momentum - impulse).norm() / (steps * dt * scale));
  EXPECT_GT(momentum.x(), 1); // it has set off
  // The scheme does not conserve momentum exactly: wanted is 1 % of rho g H^2 / 2 on fine clouds;
  // here, at 25 points across, three times that.
  EXPECT_LT(worst / (steps * dt), 0.03 * scale);
}

} // namespace
} // namespace sluice::fluid
