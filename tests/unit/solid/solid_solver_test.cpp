// SPDX-License-Identifier: MIT
// The dry gate against independent numbers. References: a third-order element on 8 x 128 cells,
// 35.91 mm and 14.739 Hz (neo-Hooke); Euler-Bernoulli in plane strain 14.749 Hz; the bands
// are 0.5 % of 35.9 mm and of 14.74 Hz.
#include "gate.hpp"

#include <gtest/gtest.h>

namespace sluice::solid {
namespace {

TEST(Gate, static_tip_under_still_water_is_within_half_a_percent_of_the_reference) {
  SolidSolver<2> solver(gate_params());
  const auto state = solver.solve_static_follower(Side::left, gate_water);
  const double ux = tip(solver, state, 0), uy = tip(solver, state, 1);
  std::printf("follower pressure, 28 elements: ux %.4f mm, uy %.4f mm\n", 1e3 * ux, 1e3 * uy);
  EXPECT_NEAR(ux, 0.0359, 0.005 * 0.0359);
  EXPECT_NEAR(uy, 0.0102, 0.02 * 0.0102);
}

TEST(Gate, first_frequency_is_within_half_a_percent_of_the_reference) {
  SolidSolver<2> solver(gate_params());
  const auto f = solver.frequencies(solver.initial_state(), 3);
  std::printf("frequencies, 28 elements: %.3f %.3f %.3f Hz\n", f[0], f[1], f[2]);
  EXPECT_NEAR(f[0], 14.74, 0.005 * 14.74);
  EXPECT_NEAR(f[1], 90.39, 0.01 * 90.39);
}

} // namespace
} // namespace sluice::solid
