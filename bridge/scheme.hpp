// SPDX-License-Identifier: MIT
// The serial schemes, as the solid's side runs them: convergence, next iterate, predictor.
//
// Implicit: the fluid computes forces F^k for the iterate (d^k, v^k), the solid answers (d~, v~).
// The stacked vector [d ; dt v] is what the accelerator sees. A window is accepted when both hold:
//   |d~ - d^k|      <= displacement_tolerance |d~ - d_n| + 1e-12 extent sqrt(nodes)
//   |F^k - F^{k-1}| <= force_tolerance |F^k| + 1e-12 max |F| of the run   (from iteration 2 on)
// The floors let a structure at rest, or one without load, converge. Accepted are d~ and v~.
// The next window starts from v_p = v_n + (v_n - v_{n-1}) dt/dt_old (v_0 in the first window) and
// d_p = d_n + dt (v_n + v_p)/2, which is consistent with v_p and exact for constant acceleration.
//
// Explicit: one pass; the fluid sees the structure one window late, as it was solved.
#pragma once

#include "bridge/acceleration.hpp"

namespace sluice::bridge {

/// Motion of the solid's interface nodes, dim components per node.
struct InterfaceState {
  Eigen::VectorXd displacement; ///< [m]
  Eigen::VectorXd velocity;     ///< [m/s]
};

enum class Verdict { iterate = 0, converged = 1, failed = 2 };

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
  /// `extent` [m] and `n_nodes` scale the floor of the displacement criterion.
  Scheme(const BridgeSettings &settings, InterfaceState initial, double extent,
         std::size_t n_nodes);

  /// Judges what the solid made of `force` in a window of length `dt` [s] and moves on: to the
  /// window's next iterate, or to the first of the next window, of length `dt_next` [s].
  IterationRecord advance(const InterfaceState &solved, const Eigen::VectorXd &force, double dt,
                          double dt_next);

  int iteration() const { return iteration_; }                  ///< of this window, from 1
  const InterfaceState &accepted() const { return accepted_; }  ///< at the start of the window
  const InterfaceState &iterate() const { return iterate_; }    ///< what the fluid computes with
  std::string explanation(const IterationRecord &record) const; ///< of a failure, with numbers

private:
  IterationRecord judge(const InterfaceState &solved, const Eigen::VectorXd &force);
  void accept(const InterfaceState &solved, double dt, double dt_next);
  void iterate_again(const InterfaceState &solved, double dt, IterationRecord &record);
  double resolution(const InterfaceState &solved, double dt) const;
  InterfaceState prediction(double dt, double dt_next) const;

  BridgeSettings settings_;
  Acceleration acceleration_;
  double displacement_floor_; // [m], in the norm over all nodes
  double largest_force_ = 0;  // [N], norm over all nodes, of the run
  int iteration_ = 1;
  InterfaceState accepted_, iterate_;
  Eigen::VectorXd velocity_before_; // of the window before; empty in the first
  Eigen::VectorXd last_force_;      // of the last iteration; empty in a window's first
};

} // namespace sluice::bridge
