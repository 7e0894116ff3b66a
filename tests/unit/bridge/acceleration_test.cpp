// SPDX-License-Identifier: MIT
// The schemes on linear added-mass problems: a structure Ms, K in a fluid that answers with the
// force -Ma a. Largest eigenvalue of Ms^-1 Ma up to 100: a plain fixed point diverges above 1.
#include "bridge/scheme.hpp"

#include "support.hpp"

#include <Eigen/Dense>

#include <algorithm>
#include <cmath>

namespace sluice::bridge {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

BridgeSettings settings_for(const std::string &acceleration) {
  BridgeSettings settings;
  settings.acceleration = acceleration;
  settings.max_iterations = 200;
  return settings;
}

struct Problem {
  MatrixXd structure_mass, added_mass, stiffness; // [kg], [kg], [N/m]
  VectorXd load;                                  // [N]
  double dt = 1e-3;                               // [s]
  double noise = 0;                               // of the force, relative
};

// Trapezoidal rule for structure and fluid; the load of a window is constant over it.
VectorXd fluid_force(const Problem &p, const InterfaceState &start, const InterfaceState &end) {
  return p.load - p.added_mass * (end.velocity - start.velocity) / p.dt;
}
InterfaceState solid_answer(const Problem &p, const InterfaceState &start, const VectorXd &force) {
  const MatrixXd left = p.structure_mass + 0.25 * p.dt * p.dt * p.stiffness;
  const VectorXd right = p.structure_mass * start.velocity + p.dt * force -
                         p.dt * p.stiffness * (start.displacement + 0.25 * p.dt * start.velocity);
  const VectorXd velocity = left.llt().solve(right);
  return {start.displacement + 0.5 * p.dt * (start.velocity + velocity), velocity};
}

struct Counts {
  int first = 0, most = 0;
  double mean = 0;
  bool has_failed = false;
  InterfaceState end;
};

// The force as an iterative solver leaves it.
VectorXd with_noise(VectorXd force, double noise, std::mt19937 &engine) {
  std::normal_distribution<double> normal;
  const double size = noise * force.norm() / std::sqrt(static_cast<double>(force.size()));
  for (double &f : force)
    f += size * normal(engine);
  return force;
}

Counts run(const Problem &problem, const BridgeSettings &settings, int windows) {
  std::mt19937 engine(5);
  const Eigen::Index n = problem.load.size();
  Scheme scheme(settings, {VectorXd::Zero(n), VectorXd::Zero(n)}, 1.0, static_cast<std::size_t>(n));
  Counts counts;
  for (int window = 0; window < windows; ++window) {
    IterationRecord record;
    int iterations = 0;
    do {
      const VectorXd force = with_noise(fluid_force(problem, scheme.accepted(), scheme.iterate()),
                                        problem.noise, engine);
      record = scheme.advance(solid_answer(problem, scheme.accepted(), force), force, problem.dt,
                              problem.dt);
      ++iterations;
    } while (record.verdict == Verdict::iterate);
    counts.has_failed = counts.has_failed || record.verdict == Verdict::failed;
    if (counts.has_failed)
      break;
    counts.first = window == 0 ? iterations : counts.first;
    counts.most = std::max(counts.most, iterations);
    counts.mean += static_cast<double>(iterations) / windows;
  }
  counts.end = scheme.accepted();
  return counts;
}

// The same windows without iteration: masses added before the solve.
InterfaceState monolithic(Problem problem, int windows) {
  problem.structure_mass += problem.added_mass;
  const Eigen::Index n = problem.load.size();
  InterfaceState state{VectorXd::Zero(n), VectorXd::Zero(n)};
  for (int window = 0; window < windows; ++window)
    state = solid_answer(problem, state, problem.load);
  return state;
}

double relative_error(const InterfaceState &state, const InterfaceState &exact) {
  return (state.displacement - exact.displacement).norm() / exact.displacement.norm();
}

// One mass on a spring; `ratio` is the added mass over the structure's.
Problem spring_mass(double ratio) {
  return {MatrixXd::Constant(1, 1, 1.0), MatrixXd::Constant(1, 1, ratio),
          MatrixXd::Constant(1, 1, 400.0 * (1 + ratio)), VectorXd::Constant(1, 3.0 * (1 + ratio)),
          1e-3};
}

// n masses in a chain, with a random symmetric added mass whose eigenvalues against the structure
// decay from `largest` as those of a fluid do (long waves carry the most water).
Problem chain(int n, double largest) {
  const auto noise = random_values(static_cast<std::size_t>(n * n), 21);
  const MatrixXd random = Eigen::Map<const MatrixXd>(noise.data(), n, n);
  const MatrixXd q = random.householderQr().householderQ();
  VectorXd eigenvalues(n);
  for (int k = 0; k < n; ++k)
    eigenvalues[k] = largest / (1 + 1.5 * k);
  MatrixXd stiffness = MatrixXd::Zero(n, n);
  for (int k = 0; k < n; ++k) {
    stiffness(k, k) = 2;
    if (k > 0)
      stiffness(k, k - 1) = stiffness(k - 1, k) = -1;
  }
  return {MatrixXd::Identity(n, n), q * eigenvalues.asDiagonal() * q.transpose(), 5e4 * stiffness,
          VectorXd::LinSpaced(n, 0.5, 2.0), 1e-3};
}

void report(const std::string &name, const Counts &counts) {
  fmt::print("  {:<34} first {:3d}  mean {:6.2f}  max {:3d}{}\n", name, counts.first, counts.mean,
             counts.most, counts.has_failed ? "  FAILED" : "");
}

class SpringMass : public testing::TestWithParam<double> {};

TEST_P(SpringMass, quasi_newton_needs_two_or_three_iterations_and_ends_where_the_whole_does) {
  const Problem problem = spring_mass(GetParam());
  const Counts counts = run(problem, settings_for("iqn-ils"), 200);
  report(fmt::format("iqn-ils, added mass {:g}", GetParam()), counts);
  ASSERT_FALSE(counts.has_failed);
  EXPECT_LE(counts.first, 4);
  EXPECT_LE(counts.most, 4);
  EXPECT_LE(counts.mean, 3); // the force criterion alone asks for three where the force changes
  EXPECT_LE(relative_error(counts.end, monolithic(problem, 200)), 1e-5);
}

TEST_P(SpringMass, aitken_converges) {
  const Problem problem = spring_mass(GetParam());
  const Counts counts = run(problem, settings_for("aitken"), 200);
  report(fmt::format("aitken, added mass {:g}", GetParam()), counts);
  ASSERT_FALSE(counts.has_failed);
  EXPECT_LE(counts.mean, 4);
  EXPECT_LE(relative_error(counts.end, monolithic(problem, 200)), 1e-4);
}

INSTANTIATE_TEST_SUITE_P(AddedMass, SpringMass, testing::Values(0.1, 1.0, 3.0, 10.0, 80.0, 100.0));

TEST(Chain, quasi_newton_with_windows_reused_beats_everything_else) {
  const Problem problem = chain(40, 80);
  BridgeSettings without = settings_for("iqn-ils");
  without.windows_reused = 0;
  const Counts reused = run(problem, settings_for("iqn-ils"), 100);
  const Counts fresh = run(problem, without, 100);
  const Counts aitken = run(problem, settings_for("aitken"), 100);
  report("chain 40, iqn-ils, 8 windows", reused);
  report("chain 40, iqn-ils, no reuse", fresh);
  report("chain 40, aitken", aitken);
  ASSERT_FALSE(reused.has_failed || fresh.has_failed || aitken.has_failed);
  EXPECT_LE(relative_error(reused.end, monolithic(problem, 100)), 1e-3);
  EXPECT_LE(relative_error(fresh.end, monolithic(problem, 100)), 1e-3);
  EXPECT_LT(reused.mean, fresh.mean);
  EXPECT_LT(fresh.mean, aitken.mean);
}

TEST(Chain, the_first_relaxation_does_not_matter_to_quasi_newton) {
  const Problem problem = chain(40, 80);
  for (const double relaxation : {1.0, 0.1, 0.01}) {
    BridgeSettings settings = settings_for("iqn-ils");
    settings.initial_relaxation = relaxation;
    const Counts counts = run(problem, settings, 50);
    report(fmt::format("chain 40, first relaxation {}", relaxation), counts);
    ASSERT_FALSE(counts.has_failed);
  }
}

TEST(Chain, noise_in_the_force_does_not_poison_the_history) {
  Problem problem = chain(40, 80);
  problem.noise = 1e-4;
  for (const int reused : {4, 8, 15}) {
    BridgeSettings settings = settings_for("iqn-ils");
    settings.windows_reused = reused;
    const Counts counts = run(problem, settings, 200);
    report(fmt::format("chain 40, noise 1e-4, {} windows", reused), counts);
    ASSERT_FALSE(counts.has_failed);
    EXPECT_LE(counts.mean, 8);
  }
}

TEST(Chain, more_history_than_unknowns_does_no_harm) {
  BridgeSettings settings = settings_for("iqn-ils");
  settings.windows_reused = 60;
  const Problem problem = chain(3, 80);
  const Counts counts = run(problem, settings, 100);
  ASSERT_FALSE(counts.has_failed);
  EXPECT_LE(counts.mean, 4);
}

TEST(ConstantRelaxation, diverges_above_its_limit_and_the_window_fails) {
  BridgeSettings settings = settings_for("constant");
  settings.initial_relaxation = 0.5;
  settings.max_iterations = 30;
  EXPECT_FALSE(run(spring_mass(1), settings, 10).has_failed);
  EXPECT_TRUE(run(spring_mass(10), settings, 10).has_failed);
}

TEST(QuasiNewton, without_columns_takes_the_relaxed_step) {
  QuasiNewton accelerator(0.25, 3);
  const auto step = accelerator.next(VectorXd::Zero(2), VectorXd::Constant(2, 4.0));
  EXPECT_EQ(step.columns, 0);
  EXPECT_EQ(step.relaxation, 0.25);
  EXPECT_EQ(step.next, VectorXd::Constant(2, 1.0));
}

TEST(QuasiNewton, a_repeated_column_is_filtered_and_a_zero_change_is_no_column) {
  QuasiNewton accelerator(0.25, 3);
  VectorXd x(2), s(2);
  x << 0, 0;
  s << 1, 2;
  accelerator.next(x, s);
  EXPECT_EQ(accelerator.next(x, s).columns, 0) << "nothing changed";
  s << 2, 4;
  EXPECT_EQ(accelerator.next(x, s).columns, 1);
  s << 3, 6;
  EXPECT_EQ(accelerator.next(x, s).columns, 1) << "the same direction once more";
}

TEST(QuasiNewton, a_change_below_the_resolution_is_no_column) {
  QuasiNewton accelerator(0.25, 3);
  const VectorXd x = VectorXd::Zero(2);
  accelerator.next(x, VectorXd::Constant(2, 1.0), 0.1);
  EXPECT_EQ(accelerator.next(x, VectorXd::Constant(2, 1.05), 0.1).columns, 0);
  EXPECT_EQ(accelerator.next(x, VectorXd::Constant(2, 1.25), 0.1).columns, 1);
}

TEST(QuasiNewton, forgets_older_windows_when_they_mislead) {
  QuasiNewton accelerator(0.25, 3);
  VectorXd x = VectorXd::Zero(1);
  accelerator.next(x, VectorXd::Constant(1, 1.0));
  accelerator.finish_window(VectorXd::Constant(1, 0.5), VectorXd::Constant(1, 0.6));
  EXPECT_EQ(accelerator.next(x, VectorXd::Constant(1, 0.3)).columns, 1) << "from the window before";
  const auto worse = accelerator.next(x, VectorXd::Constant(1, 0.4));
  EXPECT_EQ(worse.columns, 1) << "this window's own";
  EXPECT_NEAR(worse.next[0], 0.4 - 0.4, 1e-15) << "x~ did not move with x: r answers with x~";
  accelerator.finish_window(x, VectorXd::Constant(1, 0.4));
  EXPECT_EQ(accelerator.next(x, VectorXd::Constant(1, 0.3)).columns, 1) << "one is left";
}

TEST(QuasiNewton, solves_a_linear_problem_of_n_unknowns_in_n_plus_two_iterations) {
  const int n = 6;
  const auto noise = random_values(n * n, 3, 3.0);
  const MatrixXd a = Eigen::Map<const MatrixXd>(noise.data(), n, n);
  const VectorXd b = VectorXd::LinSpaced(n, 1, 2);
  const VectorXd exact = (MatrixXd::Identity(n, n) - a).partialPivLu().solve(b);
  QuasiNewton accelerator(0.1, 0, 1e-12);
  VectorXd x = VectorXd::Zero(n);
  for (int k = 0; k < n + 1; ++k)
    x = accelerator.next(x, a * x + b).next;
  EXPECT_LE((x - exact).norm(), 1e-8 * exact.norm());
}

TEST(Aitken, finds_the_root_of_one_unknown_in_two_steps) {
  Aitken accelerator(0.1);
  VectorXd x = VectorXd::Zero(1);
  for (int k = 0; k < 2; ++k)
    x = accelerator.next(x, VectorXd::Constant(1, 2 - 80 * x[0])).next;
  EXPECT_NEAR(x[0], 2.0 / 81, 1e-15);
}

// ---- the scheme's own rules ---------------------------------------------------------------------

InterfaceState state_of(double displacement, double velocity) {
  return {VectorXd::Constant(1, displacement), VectorXd::Constant(1, velocity)};
}

TEST(Scheme, the_force_must_settle_too) {
  Scheme scheme(settings_for("iqn-ils"), state_of(0, 0), 1, 1);
  const InterfaceState at_rest = state_of(0, 0);
  EXPECT_EQ(scheme.advance(at_rest, VectorXd::Constant(1, 1.0), 0.1, 0.1).verdict, Verdict::iterate)
      << "a first iteration has no force to compare with";
  EXPECT_EQ(scheme.advance(at_rest, VectorXd::Constant(1, 1.1), 0.1, 0.1).verdict, Verdict::iterate)
      << "the displacement has converged, the force changes by a tenth";
  EXPECT_EQ(scheme.advance(at_rest, VectorXd::Constant(1, 1.1), 0.1, 0.1).verdict,
            Verdict::converged);
}

TEST(Scheme, the_displacement_is_judged_by_the_windows_increment_not_by_its_size) {
  BridgeSettings settings = settings_for("constant");
  Scheme scheme(settings, state_of(40, 0), 1, 1);
  const VectorXd force = VectorXd::Constant(1, 1.0);
  scheme.advance(state_of(40.001, 0), force, 0.1, 0.1); // increment 1e-3, residual as large
  const auto record = scheme.advance(state_of(40.001, 0), force, 0.1, 0.1);
  EXPECT_EQ(record.verdict, Verdict::iterate);
  EXPECT_NEAR(record.displacement_residual, 0.95, 1e-9);
}

TEST(Scheme, the_prediction_is_exact_for_constant_acceleration) {
  Scheme scheme(settings_for("iqn-ils"), state_of(0, 1), 1, 1);
  const double dt = 0.1, dt_next = 0.05, a = 3;
  const InterfaceState end = state_of(dt + 0.5 * a * dt * dt, 1 + a * dt);
  const VectorXd force = VectorXd::Constant(1, 1.0);
  while (scheme.advance(end, force, dt, dt_next).verdict != Verdict::converged) {
  }
  const double t = dt + dt_next;
  EXPECT_NEAR(scheme.iterate().velocity[0], 1 + a * t, 1e-14);
  EXPECT_NEAR(scheme.iterate().displacement[0], t + 0.5 * a * t * t, 1e-14);
  EXPECT_EQ(scheme.accepted().displacement[0], end.displacement[0])
      << "accepted is what was solved";
}

TEST(Scheme, the_explicit_scheme_accepts_each_pass_and_hands_it_on) {
  BridgeSettings settings;
  settings.scheme = "serial-explicit";
  Scheme scheme(settings, state_of(0, 0), 1, 1);
  EXPECT_EQ(scheme.advance(state_of(5, 6), VectorXd::Constant(1, 1.0), 0.1, 0.1).verdict,
            Verdict::converged);
  EXPECT_EQ(scheme.iterate().displacement[0], 5);
  EXPECT_EQ(scheme.iterate().velocity[0], 6);
}

TEST(Scheme, an_iterate_that_is_not_finite_has_a_message_of_its_own) {
  Scheme scheme(settings_for("constant"), state_of(-1.7e308, 0), 1, 1);
  const IterationRecord record =
      scheme.advance(state_of(1.7e308, 0), VectorXd::Ones(1), 1e-3, 1e-3);
  EXPECT_EQ(record.verdict, Verdict::failed);
  const std::string text = scheme.explanation(record);
  EXPECT_NE(text.find("has no finite iterate to follow iteration 1"), std::string::npos) << text;
  EXPECT_EQ(text.find("did not converge"), std::string::npos) << text;
}

TEST(Scheme, a_copy_continues_like_the_original) {
  const Problem problem = chain(5, 30);
  const auto n = problem.load.size();
  Scheme scheme(settings_for("iqn-ils"), {VectorXd::Zero(n), VectorXd::Zero(n)}, 1, 5);
  const auto iterate = [&](Scheme &s) {
    const VectorXd force = fluid_force(problem, s.accepted(), s.iterate());
    s.advance(solid_answer(problem, s.accepted(), force), force, problem.dt, problem.dt);
  };
  for (int k = 0; k < 30; ++k)
    iterate(scheme);
  Scheme copy = scheme;
  for (int k = 0; k < 20; ++k) {
    iterate(scheme);
    iterate(copy);
  }
  EXPECT_EQ(scheme.iterate().displacement, copy.iterate().displacement);
}

} // namespace
} // namespace sluice::bridge
