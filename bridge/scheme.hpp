// SPDX-License-Identifier: MIT
// The schemes, as the solid's side runs them: convergence, next iterate, predictor.
//
// Serial, implicit: the fluid computes forces F^k for the iterate (d^k, v^k), the solid answers to
// them (d~, v~). What is accelerated is x = [d ; dt v].
// Parallel, implicit: both compute at the same time, the fluid F~ from (d^k, v^k), the solid (d~,
// v~) from F^k. Accelerated is x = [d ; dt v ; c F], with c [m/N] the run's first ratio of
// increments. A window is accepted when both hold (serial: F~ = F^k, F^k = F^{k-1}, from iteration
// 2 on):
//   |d~ - d^k| <= displacement_tolerance D + displacement_floor sqrt(nodes) + 1e-12 extent
//   sqrt(nodes) |F~ - F^k| <= force_tolerance B + force_floor + 1e-12 max |F| of the run
// with D = |d~ - d_n| (increment), |d~| (value) or the first |d~ - d^1| (residual), B = |F~|
// (value) or the window's first |F~ - F^k| (residual; none: not asked). The last terms let a
// structure at rest, or one without load, converge. Accepted are d~, v~ and F~. The next window
// starts from v_p = v_n + (v_n - v_{n-1}) dt/dt_old (v_0 in the first window) and d_p = d_n + dt
// (v_n + v_p)/2, which is consistent with v_p and exact for constant acceleration; or, with
// predictor "none", from d_n and v_n. Forces start as they were.
//
// Explicit: one pass; the fluid sees the structure one window late, as it was solved, and in the
// parallel scheme the structure sees the forces one window late.
#pragma once

#include "bridge/acceleration.hpp"

namespace sluice::bridge {

/// Motion of the solid's interface nodes, dim components per node.
struct InterfaceState {
  Eigen::VectorXd displacement; ///< [m]
  Eigen::VectorXd velocity;     ///< [m/s]; may be empty
  template <class Archive> void archive(Archive &a) { a(displacement, velocity); }
};

/// The same where it lies.
struct InterfaceView {
  InterfaceView(const InterfaceState &state)
      : displacement(state.displacement), velocity(state.velocity) {}
  InterfaceView(Eigen::Ref<const Eigen::VectorXd> d, Eigen::Ref<const Eigen::VectorXd> v)
      : displacement(d), velocity(v) {}
  Eigen::Ref<const Eigen::VectorXd> displacement, velocity;
};

/// `retry`: the window is given up and starts anew at half its length.
enum class Verdict { iterate = 0, converged = 1, failed = 2, retry = 3 };

/// One row of coupling.csv.
struct IterationRecord {
  Verdict verdict = Verdict::iterate;
  double displacement_residual = 0; ///< relative to the window's increment
  double force_residual = 0;        ///< relative to the force; nan in a window's first iteration
  double relaxation = 1;
  int columns = 0;
};

class Scheme {
public:
  using Force = Eigen::Ref<const Eigen::VectorXd>; ///< [N], dim components per node

  /// `extent` [m] and `n_nodes` scale the floor of the displacement criterion.
  Scheme(const BridgeSettings &settings, InterfaceState initial, double extent, std::size_t n_nodes,
         Eigen::VectorXd initial_force = {});

  /// Judges what the solid answered (serial: to `force`, parallel: while the fluid computed
  /// `force`) in a window of length `dt` [s] and moves on: to the window's next iterate, or to the
  /// first of the next window, of length `dt_next` [s].
  IterationRecord advance(const InterfaceView &solved, const Force &force, double dt,
                          double dt_next);

  /// The window starts anew with the length `dt` [s].
  void restart_window(double dt);

  int iteration() const { return iteration_; }                 ///< of this window, from 1
  const InterfaceState &accepted() const { return accepted_; } ///< at the start of the window
  /// What the fluid computes with.
  const InterfaceState &iterate() const { return settings_.is_implicit() ? iterate_ : accepted_; }
  const Eigen::VectorXd &force() const {
    return force_;
  } ///< parallel: what the solid computes with
  std::string explanation(const IterationRecord &record) const; ///< of a failure, with numbers

  /// Between two windows: all that the next ones depend on.
  template <class Archive> void archive(Archive &a) {
    a(acceleration_, force_scale_, largest_force_, accepted_, iterate_, force_, accepted_force_,
      velocity_before_, dt_before_);
  }

private:
  IterationRecord judge(const InterfaceView &solved, const Force &force);
  bool has_converged(const InterfaceView &solved, const Force &force, double gap, double change);
  void accept(const InterfaceView &solved, const Force &force, double dt, double dt_next);
  void iterate_again(const InterfaceView &solved, const Force &force, double dt,
                     IterationRecord &record);
  void find_force_scale(const InterfaceView &solved, const Force &force, double dt);
  Eigen::VectorXd stacked(const InterfaceView &state, const Force &force, double dt) const;
  double resolution(const InterfaceView &solved, const Force &force, double dt) const;
  InterfaceState prediction(double dt_next) const;

  BridgeSettings settings_;
  Acceleration acceleration_;
  double displacement_floor_; // [m], in the norm over all nodes
  double force_scale_ = 0;    // c [m/N] of the parallel scheme; 0: not known yet
  double largest_force_ = 0;  // [N], norm over all nodes, of the run
  double first_gap_ = 0;      // [m] of this window
  double first_change_ = 0;   // [N] of this window
  int iteration_ = 1;
  InterfaceState accepted_, iterate_;
  Eigen::VectorXd force_, accepted_force_; // iterate and last accepted one; parallel only
  Eigen::VectorXd velocity_before_;        // of the window before; empty in the first
  double dt_before_ = 0;                   // [s] length of the window before
  Eigen::VectorXd last_force_;             // of the last iteration; empty in a window's first
};

} // namespace sluice::bridge
