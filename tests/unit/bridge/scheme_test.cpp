// SPDX-License-Identifier: MIT
// Schemes and accelerators on the added-mass tube, with all participants in one loop.
#include "tests/support/tube_run.hpp"

#include "support.hpp"

#include <cmath>

namespace sluice::bridge {
namespace {

// Mean iterations per window of preCICE 3.4.1 with its defaults on the same problem.
const std::vector<double> peer_counts{2.15, 2.275, 2.325, 2.3, 2.4, 2.7};

// Filter for solvers without noise: only columns that repeat others to rounding are left out.
constexpr double exact = 1e-6;

void expect_reference(const TubeResult &result, double reference) {
  ASSERT_EQ(result.error, "");
  // The tolerance of a window, 1e-6, adds up over 40 of them.
  EXPECT_NEAR(result.sum_y, reference, 40e-6 * std::abs(reference));
}

TEST(Tube, quasi_newton_that_reuses_windows_needs_no_more_iterations_than_the_peer) {
  for (std::size_t k = 0; k < peer_counts.size(); ++k) {
    const auto [ratio, reference] = Tube::references()[k];
    const TubeResult result = run_tube(ratio, tube_settings("iqn-ils", 0.1, 8));
    fmt::print("  R = {:4}: {:.2f} iterations per window (peer {:.2f})\n", ratio, result.mean,
               peer_counts[k]);
    expect_reference(result, reference);
    EXPECT_LE(result.mean, peer_counts[k]);
  }
}

// Without reuse a window starts from what the last one has learnt, and not from a relaxed step.
TEST(Tube, quasi_newton_without_reuse_starts_from_the_last_window) {
  const std::vector<double> peer_without_reuse{3.5, 4.05, 4.25, 4.7, 5.375, 6.125};
  for (std::size_t k = 0; k < peer_without_reuse.size(); ++k) {
    const auto [ratio, reference] = Tube::references()[k];
    const TubeResult result = run_tube(ratio, tube_settings("iqn-ils", 0.1, 0));
    fmt::print("  R = {:4}: {:.2f} iterations per window (peer {:.2f})\n", ratio, result.mean,
               peer_without_reuse[k]);
    expect_reference(result, reference);
    EXPECT_LE(result.mean, peer_without_reuse[k] + 1e-9); // a sum of 40 numbers, divided
  }
}

TEST(Tube, every_accelerator_ends_where_the_monolithic_solution_does) {
  for (const auto &[ratio, reference] : Tube::references()) {
    expect_reference(run_tube(ratio, tube_settings("aitken", 0.5, 0)), reference);
    expect_reference(run_tube(ratio, tube_settings("iqn-ils", 0.1, 0)), reference);
    const TubeResult multi_vector = run_tube(ratio, tube_settings("iqn-imvj", 0.1, 40, exact));
    expect_reference(multi_vector, reference);
    EXPECT_LE(multi_vector.mean, 3.2) << "two thirds of what no reuse takes, at any ratio";
  }
}

TEST(Tube, both_fields_accelerated_together_end_there_too) {
  for (const auto &[ratio, reference] : Tube::references())
    for (const char *acceleration : {"iqn-ils", "iqn-imvj"}) {
      BridgeSettings settings = tube_settings(acceleration, 0.1, 8, exact);
      settings.scheme = "parallel-implicit";
      settings.force_measure = "value";
      settings.force_tolerance = 1e-6;
      const TubeResult result = run_tube(ratio, settings);
      fmt::print("  R = {:4}, {}: {:.2f}\n", ratio, acceleration, result.mean);
      expect_reference(result, reference);
      EXPECT_LE(result.mean, 8);
    }
}

TEST(Tube, without_acceleration_added_mass_above_one_is_an_error_and_no_result) {
  for (const double ratio : {1.0, 2.0, 5.0, 10.0}) {
    const TubeResult result = run_tube(ratio, tube_settings("constant", 1, 0));
    EXPECT_TRUE(contains(result.error, "did not converge in 100 iterations") ||
                contains(result.error, "no finite iterate"))
        << result.error;
  }
  expect_reference(run_tube(0.1, tube_settings("constant", 1, 0)), -1.62562405422);
}

// ---- measures -----------------------------------------------------------------------------------

InterfaceState at(double displacement) {
  return {Eigen::VectorXd::Constant(1, displacement), Eigen::VectorXd::Zero(1)};
}

// Residuals 1, 1/2, 1/4 ...: the iteration at which the window is accepted.
int iterations_until_accepted(const BridgeSettings &settings, double offset) {
  Scheme scheme(settings, at(offset), 1e-9, 1);
  double gap = 1;
  for (int k = 1; k < 60; ++k, gap /= 2) {
    const InterfaceState solved = at(scheme.iterate().displacement[0] + gap);
    if (scheme.advance(solved, Eigen::VectorXd::Ones(1), 1, 1).verdict == Verdict::converged)
      return k;
  }
  return 60;
}

TEST(Measure, increment_value_residual_and_floor_each_mean_what_they_say) {
  BridgeSettings settings;
  settings.acceleration = "constant";
  settings.initial_relaxation = 1e-6; // the iterate stays where it is, nearly
  settings.max_iterations = 100;
  settings.force_measure = "none";
  settings.displacement_tolerance = 0.1;
  settings.displacement_measure = "increment"; // the residual is all of the increment, always
  EXPECT_GT(iterations_until_accepted(settings, 4), 15);
  settings.displacement_measure = "value"; // gap < 0.1 (4 + gap): 1/4
  EXPECT_EQ(iterations_until_accepted(settings, 4), 3);
  settings.displacement_measure = "residual"; // gap < 0.1 of the first: 1/16
  EXPECT_EQ(iterations_until_accepted(settings, 4), 5);
  settings.displacement_floor = 0.6; // half is small enough in any case
  EXPECT_EQ(iterations_until_accepted(settings, 4), 2);
}

} // namespace
} // namespace sluice::bridge
