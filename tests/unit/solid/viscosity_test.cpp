// SPDX-License-Identifier: MIT
#include "gate.hpp"

#include <gtest/gtest.h>

#include <numbers>

namespace sluice::solid {
namespace {

// A branch under a stress that rises linearly to S over `ramp` and stays: the closed solution of
// dQ/dt + Q/tau = r dS/dt.
TEST(Viscosity, branch_stress_is_exact_for_a_ramp_that_is_held) {
  const Viscosity v{0, 0, 0.7, 2.5};
  const double ramp = 1.5, stress = 4;
  Eigen::VectorXd branch = Eigen::VectorXd::Zero(3);
  double time = 0;
  const auto law_at = [&](double t) {
    return Eigen::VectorXd::Constant(3, stress * std::min(1.0, t / ramp));
  };
  for (const double dt : {0.5, 1.0, 0.25, 3.0}) { // a step's end at the corner of the ramp
    const StepOverstress step(v, law_at(time), branch, dt, 0.6);
    branch = step.branch_at_end(law_at(time + dt));
    time += dt;
  }
  const double at_ramp =
      v.branch_ratio * stress * v.branch_time / ramp * (1 - std::exp(-ramp / v.branch_time));
  EXPECT_NEAR(branch[0], at_ramp * std::exp(-(time - ramp) / v.branch_time), 1e-14);
}

TEST(Viscosity, overstress_of_the_end_is_the_branch_and_the_rate) {
  const Viscosity v{0, 0.3, 0.7, 2.5};
  const double dt = 0.2, weight = 0.6;
  const Eigen::VectorXd start = Eigen::VectorXd::Constant(3, 2.0),
                        end = Eigen::VectorXd::Constant(3, 5.0),
                        branch = Eigen::VectorXd::Constant(3, 0.4);
  const StepOverstress step(v, start, branch, dt, weight);
  const auto at_end = step.at_end<2>();
  const double expected = step.branch_at_end(end)[0] + v.stiffness_time * 3.0 / (dt * weight);
  EXPECT_NEAR(at_end.factor * end[0] + at_end.stress[0], expected, 1e-14);
}

SolidParams small_gate() {
  auto params = gate_params();
  params.elements_along = 14;
  return params;
}

// Peaks of the tip in a small free swing from the static shape.
std::vector<double> peaks_of_a_swing(const SolidParams &params, int periods, double &frequency) {
  SolidSolver<2> solver(params);
  frequency = solver.frequencies(solver.initial_state(), 1)[0];
  SolidState state = solver.solve_static(1e-4 * dead_load(solver));
  const Eigen::VectorXd none = Eigen::VectorXd::Zero(solver.discretisation().n_dofs());
  std::vector<double> peaks;
  double x[3] = {0, 0, tip(solver, state, 0)};
  for (int k = 0; k < 200 * periods; ++k) {
    state = solver.step(state, none, 1 / (200 * frequency));
    x[0] = x[1], x[1] = x[2], x[2] = tip(solver, state, 0);
    if (k > 1 && x[1] > 0 && x[1] >= x[0] && x[1] > x[2]) // vertex of the parabola through three
      peaks.push_back(x[1] - std::pow(x[2] - x[0], 2) / (8 * (x[0] - 2 * x[1] + x[2])));
  }
  return peaks;
}

// Kelvin-Voigt: the ratio of critical damping is stiffness_time omega / 2, so the second mode, at
// six times the frequency, is gone after one period.
TEST(Viscosity, kelvin_voigt_damps_a_swing_by_half_its_time_times_the_frequency) {
  auto params = small_gate();
  double f = 14.7;
  const double zeta = 0.03;
  params.viscosity.stiffness_time = 2 * zeta / (2 * std::numbers::pi * f);
  const auto peaks = peaks_of_a_swing(params, 4, f);
  const double exact_zeta = params.viscosity.stiffness_time * std::numbers::pi * f;
  ASSERT_GE(peaks.size(), 3u);
  const double decrement = std::log(peaks[1] / peaks[2]);
  const double expected =
      2 * std::numbers::pi * exact_zeta / std::sqrt(1 - exact_zeta * exact_zeta);
  std::printf("decrement %.5f, expected %.5f\n", decrement, expected);
  // Generalised-alpha at 0.8 and 200 steps a period damps by itself below 1e-4 of this.
  EXPECT_NEAR(decrement / expected, 1, 5e-3);
}

// Damping by mass takes the same part of every mode's energy: exp(-rate t) over whole periods.
TEST(Viscosity, damping_by_mass_takes_energy_at_its_rate) {
  auto params = small_gate();
  params.spectral_radius = 1;
  params.viscosity.mass_rate = 9;
  SolidSolver<2> solver(params);
  const double f = solver.frequencies(solver.initial_state(), 1)[0];
  SolidState state = solver.solve_static(1e-4 * dead_load(solver));
  const double before = solver.strain_energy(state);
  const Eigen::VectorXd none = Eigen::VectorXd::Zero(solver.discretisation().n_dofs());
  for (int k = 0; k < 400; ++k)
    state = solver.step(state, none, 1 / (200 * f));
  const double after = solver.strain_energy(state) + solver.kinetic_energy(state);
  const double expected = std::exp(-params.viscosity.mass_rate * 2 / f);
  std::printf("energy left %.5f, expected %.5f\n", after / before, expected);
  // The rate is twice the damping ratio, 0.05, off within a period; whole periods leave its square,
  // and the second mode, with 1e-3 of the energy, is not at a whole period.
  EXPECT_NEAR(after / before / expected, 1, 5e-3);
}

// Creep of a standard solid: u(t)/u(infinity) = 1 - r/(1 + r) exp(-t / (tau (1 + r))). Steps far
// longer than any period, annihilated at once (spectral radius 0): quasi-static.
TEST(Viscosity, a_branch_lets_the_gate_creep_to_its_elastic_deflection) {
  auto params = small_gate();
  params.spectral_radius = 0;
  params.viscosity.branch_ratio = 0.5;
  params.viscosity.branch_time = 20;
  SolidSolver<2> solver(params);
  const Eigen::VectorXd load = 1e-4 * dead_load(solver);
  const double elastic = tip(solver, solver.solve_static(load), 0);
  SolidState state = solver.initial_state();
  const double dt = 0.2;
  for (int k = 1; k <= 100; ++k) {
    state = solver.step(state, load, dt);
    const double t = k * dt, expected = 1 - 0.5 / 1.5 * std::exp(-t / 30);
    if (k > 10) {
      EXPECT_NEAR(tip(solver, state, 0) / elastic, expected, 3e-3) << "t = " << t;
    }
  }
}

TEST(Viscosity, the_state_carries_the_branch_and_a_copy_of_it_gives_the_same_bits) {
  auto params = small_gate();
  params.viscosity.branch_ratio = 0.5;
  params.viscosity.branch_time = 1e-3;
  SolidSolver<2> solver(params);
  const Eigen::VectorXd load = dead_load(solver);
  SolidState state = solver.initial_state();
  for (int k = 0; k < 5; ++k)
    state = solver.step(state, load, 2e-4);
  EXPECT_GT(state.branch.norm(), 0);
  const SolidState saved = state;
  const SolidState once = solver.step(saved, load, 2e-4);
  solver.step(saved, -2 * load, 2e-4);
  EXPECT_EQ((solver.step(saved, load, 2e-4).branch - once.branch).norm(), 0);
}

} // namespace
} // namespace sluice::solid
