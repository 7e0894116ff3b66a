// SPDX-License-Identifier: MIT
#include "bridge/scheme.hpp"

#include <cmath>
#include <limits>

namespace sluice::bridge {

namespace {

constexpr double relative_floor = 1e-12;

double ratio(double part, double whole) {
  if (part == 0)
    return 0;
  return whole > 0 ? part / whole : std::numeric_limits<double>::infinity();
}

} // namespace

Scheme::Scheme(const BridgeSettings &settings, InterfaceState initial, double extent,
               std::size_t n_nodes, Eigen::VectorXd initial_force)
    : settings_(settings), acceleration_(make_acceleration(settings)),
      displacement_floor_((settings.displacement_floor + relative_floor * extent) *
                          std::sqrt(static_cast<double>(n_nodes))),
      accepted_(std::move(initial)), iterate_(accepted_), force_(std::move(initial_force)),
      accepted_force_(force_) {}

IterationRecord Scheme::advance(const InterfaceView &solved, const Force &force, double dt,
                                double dt_next) {
  IterationRecord record = judge(solved, force);
  if (record.verdict == Verdict::converged && settings_.is_implicit())
    finish_window(acceleration_, stacked(iterate_, force_, dt), stacked(solved, force, dt),
                  resolution(solved, force, dt));
  if (record.verdict == Verdict::converged)
    accept(solved, force, dt, dt_next);
  if (record.verdict == Verdict::iterate)
    iterate_again(solved, force, dt, record);
  return record;
}

IterationRecord Scheme::judge(const InterfaceView &solved, const Force &force) {
  if (!settings_.is_implicit())
    return {Verdict::converged};
  const double gap = (solved.displacement - iterate_.displacement).norm();
  const double increment = (solved.displacement - accepted_.displacement).norm();
  const Eigen::VectorXd &before = settings_.is_parallel() ? force_ : last_force_;
  const double change =
      before.size() > 0 ? (force - before).norm() : std::numeric_limits<double>::quiet_NaN();
  IterationRecord record{Verdict::iterate, ratio(gap, increment), ratio(change, force.norm())};
  if (has_converged(solved, force, gap, change))
    record.verdict = Verdict::converged;
  else if (iteration_ >= settings_.max_iterations)
    record.verdict = Verdict::failed;
  last_force_ = force;
  return record;
}

bool Scheme::has_converged(const InterfaceView &solved, const Force &force, double gap,
                           double change) {
  if (iteration_ == 1)
    first_gap_ = gap;
  if (!(first_change_ > 0))
    first_change_ = std::isnan(change) ? 0 : change;
  largest_force_ = std::max(largest_force_, force.norm());
  const double displacement_measure =
      settings_.displacement_measure == "increment"
          ? (solved.displacement - accepted_.displacement).norm()
          : (settings_.displacement_measure == "value" ? solved.displacement.norm() : first_gap_);
  const double force_measure = settings_.force_measure == "value" ? force.norm() : first_change_;
  const bool is_near =
      std::isfinite(gap) &&
      gap <= settings_.displacement_tolerance * displacement_measure + displacement_floor_;
  if (settings_.force_measure == "none")
    return is_near;
  return is_near && change <= settings_.force_tolerance * force_measure + settings_.force_floor +
                                  relative_floor * largest_force_;
}

void Scheme::accept(const InterfaceView &solved, const Force &force, double dt, double dt_next) {
  velocity_before_ = accepted_.velocity;
  dt_before_ = dt;
  accepted_.displacement = solved.displacement;
  accepted_.velocity = solved.velocity;
  if (settings_.is_parallel())
    accepted_force_ = force_ = force;
  if (settings_.is_implicit())
    iterate_ = prediction(dt_next);
  last_force_.resize(0);
  first_change_ = 0;
  iteration_ = 1;
}

void Scheme::restart_window(double dt) {
  forget_window(acceleration_);
  if (settings_.is_implicit())
    iterate_ = prediction(dt);
  force_ = accepted_force_;
  last_force_.resize(0);
  first_change_ = 0;
  iteration_ = 1;
}

InterfaceState Scheme::prediction(double dt_next) const {
  if (settings_.predictor == "none" || accepted_.velocity.size() == 0)
    return accepted_;
  Eigen::VectorXd velocity = accepted_.velocity;
  if (dt_before_ > 0)
    velocity += (accepted_.velocity - velocity_before_) * (dt_next / dt_before_);
  return {accepted_.displacement + 0.5 * dt_next * (accepted_.velocity + velocity), velocity};
}

// In metres throughout, so that no field drowns another.
Eigen::VectorXd Scheme::stacked(const InterfaceView &state, const Force &force, double dt) const {
  const Eigen::Index n_force = settings_.is_parallel() ? force.size() : 0;
  Eigen::VectorXd x(state.displacement.size() + state.velocity.size() + n_force);
  x << state.displacement, dt * state.velocity, force_scale_ * force.head(n_force);
  return x;
}

// Once for the run: the history of the accelerator is in these units.
void Scheme::find_force_scale(const InterfaceView &solved, const Force &force, double dt) {
  if (!settings_.is_parallel() || force_scale_ > 0)
    return;
  const double motion = (solved.displacement - accepted_.displacement).norm() +
                        dt * (solved.velocity - accepted_.velocity).norm();
  const double change = (force - accepted_force_).norm();
  if (!(motion > 0 && change > 0))
    return;
  force_scale_ = motion / change;
  forget_window(acceleration_);
}

// Differences ten times below what counts as converged are taken for noise of the solvers.
double Scheme::resolution(const InterfaceView &solved, const Force &force, double dt) const {
  return 0.1 * settings_.displacement_tolerance *
         (stacked(solved, force, dt) - stacked(accepted_, accepted_force_, dt)).norm();
}

void Scheme::iterate_again(const InterfaceView &solved, const Force &force, double dt,
                           IterationRecord &record) {
  find_force_scale(solved, force, dt);
  const AcceleratedIterate result =
      accelerate(acceleration_, stacked(iterate_, force_, dt), stacked(solved, force, dt),
                 resolution(solved, force, dt));
  record.relaxation = result.relaxation;
  record.columns = result.columns;
  if (!result.next.allFinite()) {
    record.verdict = Verdict::failed;
    return;
  }
  const Eigen::Index n = solved.displacement.size(), m = solved.velocity.size();
  iterate_ = {result.next.head(n), result.next.segment(n, m) / dt};
  if (settings_.is_parallel() && force_scale_ > 0)
    force_ = result.next.tail(force.size()) / force_scale_;
  else if (settings_.is_parallel())
    force_ = force;
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
