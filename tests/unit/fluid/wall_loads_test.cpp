// SPDX-License-Identifier: MIT
#include "fluid/wall_loads.hpp"
#include "tests/support/fluid_cases.hpp"

#include <gtest/gtest.h>

namespace sluice::fluid {
namespace {

constexpr double weight_density = 9810, depth = 0.14, gate = 0.079;

struct StillWater : FluidSolver<2> {
  explicit StillWater(const std::string &spacing)
      : FluidSolver<2>(
            testing::scene_of(testing::gate_tank(),
                              {"fluid.spacing_m=" + spacing, "fluid.pressure_tolerance=1e-12"})) {
    begin_step(1e-3);
    iterate();
  }
};

class HydrostaticLoad : public ::testing::TestWithParam<std::string> {};

TEST_P(HydrostaticLoad, OnTheGateHasTheExactResultantAndMomentAboutTheClamp) {
  const StillWater solver(GetParam());
  const Resultant<2> load = integrate_resultant(solver.quadrature(), solver.tractions());
  // pressure rho g (H - y) over 0 < y < L; moment about (0.1, L): integral of p (L - y)
  const double force = weight_density * (depth * gate - 0.5 * gate * gate);
  const double moment = weight_density * (0.5 * depth * gate * gate - gate * gate * gate / 6);
  const double at_clamp = load.moment - cross(Vec<2>(0.1, gate), load.force);
  std::printf("%s m: force %.3e, moment %.3e relative error\n", GetParam().c_str(),
              load.force.x() / force - 1, at_clamp / moment - 1);
  EXPECT_NEAR(load.force.x(), force, 1e-6 * force);
  EXPECT_NEAR(load.force.y(), 0, 1e-6 * force);
  EXPECT_NEAR(at_clamp, moment, 1e-6 * moment);
}

TEST_P(HydrostaticLoad, LeavesTheLowerEdgeAndTheDryFaceOfASealedGateDry) {
  const StillWater solver(GetParam());
  EXPECT_GT(solver.quadrature().samples.size(), 30u);
  for (const auto &sample : solver.quadrature().samples)
    EXPECT_NEAR(sample.position.x(), 0.1, 1e-12) << "wet at y = " << sample.position.y();
  for (std::size_t v = 0; v < solver.walls.position.size(); ++v)
    if (solver.walls.position[v].x() > 0.1 + 1e-9) {
      EXPECT_EQ(solver.nodal_forces()[v].norm(), 0);
    }
}

INSTANTIATE_TEST_SUITE_P(Spacings, HydrostaticLoad, ::testing::Values("0.004", "0.002"));

TEST(WallLoads, NodalForcesHaveTheSumAndTheMomentOfTheTractions) {
  StillWater solver("0.004");
  for (const int v : solver.walls.coupled_vertices)
    solver.walls.velocity[v] = {0.1 * solver.walls.position[v].y(), -0.02};
  solver.iterate();
  const Resultant<2> load = integrate_resultant(solver.quadrature(), solver.tractions());
  Vec<2> force(0, 0);
  double moment = 0, size = 0;
  for (std::size_t v = 0; v < solver.walls.position.size(); ++v) {
    const Vec<2> &f = solver.nodal_forces()[v];
    force += f;
    moment += cross(solver.walls.position[v], f);
    size += f.norm();
  }
  EXPECT_GT(std::abs(load.force.y()), 0); // shear acts
  EXPECT_NEAR((force - load.force).norm(), 0, 1e-13 * size);
  EXPECT_NEAR(moment, load.moment, 1e-13 * size);
}

TEST(WallLoads, WeightsOfASampleArePositiveAndSumToOne) {
  const StillWater solver("0.004");
  const WallQuadrature<2> &quadrature = solver.quadrature();
  for (const auto &sample : quadrature.samples) {
    double total = 0;
    for (int c = sample.first; c < sample.first + sample.count; ++c) {
      EXPECT_GE(quadrature.contributions[c].weight, 0);
      total += quadrature.contributions[c].weight;
    }
    EXPECT_NEAR(total, 1, 1e-14);
  }
}

TEST(WallLoads, ASegmentAboveTheWaterCarriesNothing) {
  const StillWater solver("0.004");
  WallQuadrature<2> all;
  build_wall_quadrature(solver.state.points, solver.walls, solver.cloud(), WallPart::all, all);
  double wet_tank = 0;
  for (const auto &sample : all.samples) {
    EXPECT_LT(sample.position.y(), depth + 0.004);
    EXPECT_LT(sample.position.x(), 0.1 + 1e-9);
    wet_tank += sample.position.x() < 1e-12 ? sample.measure : 0.0;
  }
  EXPECT_NEAR(wet_tank, depth, 0.004); // its water line is smeared over a spacing
}

} // namespace
} // namespace sluice::fluid
