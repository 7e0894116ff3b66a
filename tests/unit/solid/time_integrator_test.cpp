// SPDX-License-Identifier: MIT
#include "gate.hpp"

#include "bridge/base/timer.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

namespace sluice::solid {
namespace {

TEST(GeneralisedAlpha, coefficients_are_those_of_chung_and_hulbert) {
  for (const double radius : {0.0, 0.5, 0.8, 1.0}) {
    const GeneralisedAlpha a(radius);
    EXPECT_NEAR(a.gamma, 0.5 - a.alpha_m + a.alpha_f, 1e-15) << "second order";
    EXPECT_NEAR(a.beta, 0.25 * std::pow(1 - a.alpha_m + a.alpha_f, 2), 1e-15);
    EXPECT_NEAR(a.alpha_f - a.alpha_m, (1 - radius) / (1 + radius), 1e-15);
  }
  EXPECT_THROW(GeneralisedAlpha(1.1), UserError);
}

// A block of 4 cells, sheared by some 12 % and let go. Every one of its frequencies is resolved, or
// the order would be seen only in theory.
SolidState swing(double dt, double end, double radius) {
  auto params = gate_params();
  params.height = params.width;
  params.elements_along = params.elements_across = 2;
  params.spectral_radius = radius;
  params.newton_tolerance = 1e-12;
  SolidSolver<2> solver(params);
  SolidState state = solver.solve_static(400 * dead_load(solver));
  EXPECT_GT(tip(solver, state, 0), 0.1 * params.height);
  const Eigen::VectorXd none = Eigen::VectorXd::Zero(solver.discretisation().n_dofs());
  state.acceleration = solver.consistent_acceleration(state, none);
  for (long k = 0, n = std::lround(end / dt); k < n; ++k)
    state = solver.step(state, none, dt);
  return state;
}

TEST(GeneralisedAlpha, displacement_and_velocity_converge_with_second_order) {
  const double end = 2e-4;
  for (const double radius : {0.8, 0.5}) {
    const SolidState reference = swing(end / 8192, end, radius);
    std::vector<double> u, v;
    for (const int n : {256, 512, 1024}) {
      const SolidState state = swing(end / n, end, radius);
      u.push_back((state.displacement - reference.displacement).norm());
      v.push_back((state.velocity - reference.velocity).norm());
    }
    for (std::size_t k = 0; k + 1 < u.size(); ++k) {
      std::printf("radius %.1f: order %.2f (u), %.2f (v)\n", radius, std::log2(u[k] / u[k + 1]),
                  std::log2(v[k] / v[k + 1]));
      EXPECT_GT(std::log2(u[k] / u[k + 1]), 1.8);
      EXPECT_GT(std::log2(v[k] / v[k + 1]), 1.8);
    }
  }
}

// Small free vibration of the whole gate against its own eigenvalue problem: mass, tangent and time
// integration have to agree.
TEST(GeneralisedAlpha, a_small_swing_has_the_first_natural_frequency) {
  SolidSolver<2> solver(gate_params());
  const double f = solver.frequencies(solver.initial_state(), 1)[0];
  SolidState state = solver.solve_static(1e-4 * dead_load(solver));
  const Eigen::VectorXd none = Eigen::VectorXd::Zero(solver.discretisation().n_dofs());
  const double dt = 1 / (400 * f);
  std::vector<double> crossings;
  double before = tip(solver, state, 0);
  for (int k = 1; k <= 1000; ++k) {
    state = solver.step(state, none, dt);
    const double now = tip(solver, state, 0);
    if (before > 0 && now <= 0)
      crossings.push_back((k - 1 + before / (before - now)) * dt);
    before = now;
  }
  ASSERT_GE(crossings.size(), 2u);
  // The second mode, 3 % of the static shape at 6.2 f, moves single crossings by less than 0.5 %.
  EXPECT_NEAR(1 / (crossings[1] - crossings[0]) / f, 1, 5e-3);
}

// Undamped (radius 1), the work of a constant load is in the body: exact for linear elasticity, and
// here to the nonlinearity that one step sees.
TEST(GeneralisedAlpha, work_of_the_load_is_kinetic_plus_strain_energy) {
  auto params = gate_params();
  params.spectral_radius = 1;
  SolidSolver<2> solver(params);
  const Eigen::VectorXd load = dead_load(solver);
  SolidState state = solver.initial_state();
  state.acceleration = solver.consistent_acceleration(state, load);
  for (int k = 0; k < 150; ++k)
    state = solver.step(state, load, 2e-4);
  const double energy = solver.kinetic_energy(state) + solver.strain_energy(state);
  std::printf("work %.6f J/m, energy %.6f J/m\n", state.load_work, energy);
  EXPECT_GT(state.load_work, 1.0);
  EXPECT_NEAR(energy / state.load_work, 1, 2e-3);
}

TEST(Step, a_first_step_from_rest_starts_without_acceleration) {
  SolidSolver<2> solver(gate_params());
  EXPECT_EQ(solver.initial_state().acceleration.norm(), 0);
  const auto state = solver.initial_state();
  const Eigen::VectorXd none = Eigen::VectorXd::Zero(state.displacement.size());
  EXPECT_EQ(solver.step(state, none, 2e-4).displacement.norm(), 0) << "rest stays rest, exactly";
}

void expect_same(const SolidState &a, const SolidState &b) {
  EXPECT_EQ((a.displacement - b.displacement).cwiseAbs().maxCoeff(), 0);
  EXPECT_EQ((a.velocity - b.velocity).cwiseAbs().maxCoeff(), 0);
  EXPECT_EQ((a.acceleration - b.acceleration).cwiseAbs().maxCoeff(), 0);
  EXPECT_EQ((a.modes - b.modes).cwiseAbs().maxCoeff(), 0);
  EXPECT_EQ(a.load_work, b.load_work);
  EXPECT_EQ(a.step, b.step);
}

TEST(Step, a_restored_checkpoint_gives_the_same_bits) {
  SolidSolver<2> solver(gate_params());
  const Eigen::VectorXd load = dead_load(solver);
  SolidState state = solver.initial_state();
  for (int k = 0; k < 20; ++k)
    state = solver.step(state, load, 2e-4);
  const SolidState saved = state;
  const SolidState first = solver.step(saved, load, 2e-4);
  solver.step(saved, -3 * load, 2e-4); // a rejected iteration
  expect_same(first, solver.step(saved, load, 2e-4));
  SolidSolver<2> another(gate_params()); // a restarted program
  expect_same(first, another.step(saved, load, 2e-4));
}

TEST(Step, a_guess_saves_iterations_and_changes_nothing_else) {
  SolidSolver<2> solver(gate_params());
  const Eigen::VectorXd load = dead_load(solver);
  SolidState state = solver.initial_state();
  for (int k = 0; k < 50; ++k)
    state = solver.step(state, load, 2e-4);
  const SolidState plain = solver.step(state, load, 2e-4);
  const long before = solver.counts().iterations;
  const SolidState warm = solver.step(state, load, 2e-4, &plain);
  EXPECT_EQ(solver.counts().iterations, before) << "the answer itself needs no iteration";
  EXPECT_EQ((warm.displacement - plain.displacement).norm(), 0);
  SolidState wild = plain; // an inverted guess must not matter
  wild.displacement *= -100;
  const SolidState recovered = solver.step(state, load, 2e-4, &wild);
  EXPECT_EQ((recovered.displacement - plain.displacement).norm(), 0);
  EXPECT_EQ(solver.counts().rejected_starts, 1);
}

// The constant-acceleration predictor of this rough state inverts elements; u_n does not.
TEST(Step, an_inverting_predictor_falls_back_to_the_last_displacement) {
  SolidSolver<2> solver(gate_params());
  SolidState state = solver.initial_state();
  for (Eigen::Index k = 1; k < state.acceleration.size(); k += 2)
    state.acceleration[k] = (k / 4 % 2 == 0 ? 1 : -1) * 4e5;
  const Eigen::VectorXd none = Eigen::VectorXd::Zero(state.displacement.size());
  const auto end = solver.step(state, none, 2e-4);
  EXPECT_GE(solver.counts().rejected_starts, 1);
  EXPECT_GT(solver.assembly().smallest_det(end.displacement, end.modes), 0);
}

std::string error_of_step(SolidSolver<2> &solver, double factor) {
  try {
    solver.step(solver.initial_state(), factor * dead_load(solver), 2e-4);
  } catch (const UserError &error) {
    return error.what();
  }
  return "";
}

TEST(Step, a_step_without_a_solution_says_so_with_numbers) {
  auto params = gate_params();
  params.newton_max_iterations = 3;
  SolidSolver<2> solver(params);
  const std::string error = error_of_step(solver, 1e7);
  std::printf("%s\n", error.c_str());
  EXPECT_NE(error.find("step 1 of 0.0002 s"), std::string::npos);
  EXPECT_NE(error.find("largest nodal force"), std::string::npos);
  EXPECT_NE(error.find("time_step_s"), std::string::npos);
  EXPECT_EQ(error_of_step(solver, 1), "") << "the solver is usable afterwards";
}

TEST(Step, a_step_without_a_solution_can_be_told_from_other_failures) {
  auto params = gate_params();
  params.newton_max_iterations = 3;
  SolidSolver<2> solver(params);
  EXPECT_THROW(solver.step(solver.initial_state(), 1e7 * dead_load(solver), 2e-4), NoSolution);
}

TEST(Window, steps_in_a_window_are_the_steps_of_as_many_windows) {
  auto params = gate_params();
  params.steps_per_window = 4;
  SolidSolver<2> inside(params), outside(gate_params());
  const Eigen::VectorXd load = dead_load(inside);
  SolidState a = inside.initial_state(), b = a;
  a = inside.advance(a, load, 8e-4);
  for (int k = 0; k < 4; ++k)
    b = outside.advance(b, load, 2e-4);
  expect_same(a, b);
}

// Three iterations do not solve a step of 20 ms, but they solve shorter ones.
TEST(Window, a_step_without_a_solution_is_halved_and_counted) {
  auto params = gate_params();
  params.newton_max_iterations = 4;
  params.max_step_cuts = 8;
  SolidSolver<2> solver(params);
  const auto end = solver.advance(solver.initial_state(), 3 * dead_load(solver), 0.02);
  EXPECT_GT(solver.counts().cut_steps, 0);
  EXPECT_GT(solver.assembly().smallest_det(end.displacement, end.modes), 0);
  params.newton_max_iterations = 50;
  SolidSolver<2> patient(params);
  SolidState fine = patient.initial_state();
  for (int k = 0; k < 100; ++k)
    fine = patient.step(fine, 3 * dead_load(patient), 2e-4);
  // Other steps, other errors in time: steps down to 1.25 ms against 0.2 ms.
  EXPECT_NEAR(tip(solver, end, 0) / tip(patient, fine, 0), 1, 0.05);
  params.newton_max_iterations = 1;
  params.max_step_cuts = 1;
  SolidSolver<2> hopeless(params);
  EXPECT_THROW(hopeless.advance(hopeless.initial_state(), 3 * dead_load(hopeless), 0.02),
               NoSolution);
}

TEST(Step, a_force_that_is_not_finite_is_refused) {
  SolidSolver<2> solver(gate_params());
  EXPECT_NE(error_of_step(solver, std::nan("")).find("not finite"), std::string::npos);
}

TEST(Step, costs_at_most_a_few_newton_iterations) {
  SolidSolver<2> solver(gate_params());
  const Eigen::VectorXd load = dead_load(solver);
  SolidState state = solver.initial_state();
  const double start = process_cpu_time();
  for (int k = 0; k < 200; ++k)
    state = solver.step(state, load, 2e-4);
  const double mean = static_cast<double>(solver.counts().iterations) / 200;
  std::printf("%.2f Newton iterations, %.3f ms of CPU per step\n", mean,
              1e3 * (process_cpu_time() - start) / 200);
  EXPECT_LT(mean, 3);
}

} // namespace
} // namespace sluice::solid
