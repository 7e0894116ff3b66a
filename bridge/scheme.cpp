// SPDX-License-Identifier: MIT
#include "bridge/scheme.hpp"

#include <cmath>
#include <limits>

namespace sluice::bridge {

namespace {

constexpr double relative_floor = 1e-12;

// The vector that is accelerated: both parts in metres.
Eigen::VectorXd stacked(const InterfaceState &state, double dt) {
  Eigen::VectorXd x(state.displacement.size() + state.velocity.size());
  x << state.displacement, dt * state.velocity;
  return x;
}

InterfaceState unstacked(const Eigen::VectorXd &x, double dt) {
  const Eigen::Index n = x.size() / 2;
  return {x.head(n), x.tail(n) / dt};
}

double ratio(double part, double whole) {
  if (part == 0)
    return 0;
  return whole > 0 ? part / whole : std::numeric_limits<double>::infinity();
}

} // namespace

Scheme::Scheme(const BridgeSettings &settings, InterfaceState initial, double extent,
               std::size_t n_nodes)
    : settings_(settings), acceleration_(make_acceleration(settings)),
      displacement_floor_(relative_floor * extent * std::sqrt(static_cast<double>(n_nodes))),
      accepted_(std::move(initial)), iterate_(accepted_) {}

IterationRecord Scheme::advance(const InterfaceState &solved, const Eigen::VectorXd &force,
                                double dt, double dt_next) {
  IterationRecord record = judge(solved, force);
  if (record.verdict == Verdict::converged && settings_.is_implicit())
    finish_window(acceleration_, stacked(iterate_, dt), stacked(solved, dt),
                  resolution(solved, dt));
  if (record.verdict == Verdict::converged)
    accept(solved, dt, dt_next);
  if (record.verdict == Verdict::iterate)
    iterate_again(solved, dt, record);
  return record;
}

IterationRecord Scheme::judge(const InterfaceState &solved, const Eigen::VectorXd &force) {
  const double gap = (solved.displacement - iterate_.displacement).norm();
  const double increment = (solved.displacement - accepted_.displacement).norm();
  const double size = force.norm();
  const double change = last_force_.size() > 0 ? (force - last_force_).norm()
                                               : std::numeric_limits<double>::quiet_NaN();
  largest_force_ = std::max(largest_force_, size);
  last_force_ = force;
  IterationRecord record{Verdict::iterate, ratio(gap, increment), ratio(change, size)};
  const bool has_converged =
      gap <= settings_.displacement_tolerance * increment + displacement_floor_ &&
      change <= settings_.force_tolerance * size + relative_floor * largest_force_;
  if (has_converged || !settings_.is_implicit())
    record.verdict = Verdict::converged;
  else if (iteration_ >= settings_.max_iterations)
    record.verdict = Verdict::failed;
  return record;
}

void Scheme::accept(const InterfaceState &solved, double dt, double dt_next) {
  velocity_before_ = accepted_.velocity;
  accepted_ = solved;
  iterate_ = settings_.is_implicit() ? prediction(dt, dt_next) : solved;
  last_force_.resize(0);
  iteration_ = 1;
}

// Differences ten times below what counts as converged are taken for noise of the solvers.
double Scheme::resolution(const InterfaceState &solved, double dt) const {
  return 0.1 * settings_.displacement_tolerance *
         (stacked(solved, dt) - stacked(accepted_, dt)).norm();
}

InterfaceState Scheme::prediction(double dt, double dt_next) const {
  const Eigen::VectorXd velocity =
      accepted_.velocity + (accepted_.velocity - velocity_before_) * (dt_next / dt);
  return {accepted_.displacement + 0.5 * dt_next * (accepted_.velocity + velocity), velocity};
}

void Scheme::iterate_again(const InterfaceState &solved, double dt, IterationRecord &record) {
  const AcceleratedIterate result =
      accelerate(acceleration_, stacked(iterate_, dt), stacked(solved, dt), resolution(solved, dt));
  record.relaxation = result.relaxation;
  record.columns = result.columns;
  if (!result.next.allFinite()) {
    record.verdict = Verdict::failed;
    return;
  }
  iterate_ = unstacked(result.next, dt);
  ++iteration_;
}

std::string Scheme::explanation(const IterationRecord &record) const {
  if (iteration_ < settings_.max_iterations) // the only other way to fail
    return fmt::format(
        "has no finite iterate to follow iteration {}: the values grew beyond what a "
        "double holds (force change {:.3g}); a smaller case.time_step_s or a "
        "bridge.initial_relaxation below {} may help",
        iteration_, record.force_residual, settings_.initial_relaxation);
  return fmt::format(
      "did not converge in {} iterations (bridge.max_iterations = {}): displacement residual "
      "{:.3g} "
      "of the increment (tolerance {:.3g}), force change {:.3g} (tolerance {:.3g}); a smaller "
      "case.time_step_s or another bridge.acceleration than {} may help",
      iteration_, settings_.max_iterations, record.displacement_residual,
      settings_.displacement_tolerance, record.force_residual, settings_.force_tolerance,
      settings_.acceleration);
}

} // namespace sluice::bridge
