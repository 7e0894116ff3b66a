// SPDX-License-Identifier: MIT
#include "solid-dealii/newton.hpp"

#include <gtest/gtest.h>

namespace sluice::solid {
namespace {

// A unit block on a floor that lets it slide: pressed from above, its height is a scalar equation.
struct PressedBlock {
  Discretisation<2> mesh = discretise(Box<2>{{0, 0}, {1, 1}, {1, 1}, {}}, ElementKind::q1);
  std::vector<bool> fixed = std::vector<bool>(8, true);
  Eigen::VectorXd load = Eigen::VectorXd::Zero(8);

  explicit PressedBlock(double pressure) { // sideways held, so that the strain is uniaxial
    for (const int node : mesh.side_nodes(Side::upper)) {
      fixed[static_cast<std::size_t>(2 * node + 1)] = false;
      load[2 * node + 1] = -0.5 * pressure;
    }
  }
  NewtonReport solve(Iterate &iterate, int max_iterations) {
    Assembly<2> assembly(mesh, {NeoHookean{{1, 1}}}, 1, fixed);
    return Newton<2>(assembly, {1e-12, max_iterations}).solve({1, 0, {}, load}, iterate);
  }
  static Iterate at_rest() { return {Eigen::VectorXd::Zero(8), {}}; }
};

// The full first step is -pressure/3 and would turn the block inside out.
TEST(Newton, a_step_that_would_invert_the_block_is_cut_back) {
  const double pressure = 6;
  PressedBlock block(pressure);
  auto iterate = PressedBlock::at_rest();
  const auto report = block.solve(iterate, 25);
  ASSERT_TRUE(report.has_converged) << report.failure;
  const double J = 1 + iterate.displacement.minCoeff();
  EXPECT_NEAR(report.min_det, J, 1e-12);
  // First Piola stress of uniaxial strain: mu (J - 1/J) + lambda ln J / J = -pressure.
  EXPECT_NEAR(J - 1 / J + std::log(J) / J, -pressure, 1e-9);
}

TEST(Newton, converges_with_second_order) {
  PressedBlock block(0.3);
  std::vector<double> residuals;
  for (int n = 1; n <= 4; ++n) {
    auto iterate = PressedBlock::at_rest();
    residuals.push_back(block.solve(iterate, n).residual);
  }
  // e_{n+1} = C e_n^2 with C of order 1; the last one is round-off.
  EXPECT_LT(residuals[1], 2 * residuals[0] * residuals[0]);
  EXPECT_LT(residuals[2], 2 * residuals[1] * residuals[1] + 1e-13);
}

TEST(Newton, too_few_iterations_are_reported_with_residual_and_reference) {
  PressedBlock block(6);
  auto iterate = PressedBlock::at_rest();
  const auto report = block.solve(iterate, 2);
  EXPECT_FALSE(report.has_converged);
  EXPECT_NE(report.failure.find("after 2 iterations"), std::string::npos) << report.failure;
}

TEST(Newton, an_inverted_start_is_reported_not_solved) {
  PressedBlock block(0.1);
  auto iterate = PressedBlock::at_rest();
  iterate.displacement.setConstant(0);
  for (const int node : block.mesh.side_nodes(Side::upper))
    iterate.displacement[2 * node + 1] = -1.5;
  const auto report = block.solve(iterate, 25);
  EXPECT_FALSE(report.has_converged);
  EXPECT_NE(report.failure.find("inverted"), std::string::npos) << report.failure;
  EXPECT_NEAR(report.min_det, 0, 0.51);
}

// A body without any support has a singular static tangent.
TEST(Newton, a_singular_tangent_is_reported) {
  PressedBlock block(0.1);
  block.fixed.assign(8, false);
  auto iterate = PressedBlock::at_rest();
  const auto report = block.solve(iterate, 25);
  EXPECT_FALSE(report.has_converged);
  EXPECT_FALSE(report.failure.empty());
}

} // namespace
} // namespace sluice::solid
