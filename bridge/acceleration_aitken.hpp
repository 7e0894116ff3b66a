// SPDX-License-Identifier: MIT
// Aitken's dynamic relaxation: x + omega_k r_k with
//   omega_k = -omega_{k-1} r_{k-1} . (r_k - r_{k-1}) / |r_k - r_{k-1}|^2.
// The first iteration of a window takes the last factor of the window before.
// Source: Kuettler and Wall, Comput. Mech. 43 (2008) 61-72, equations 44 and 45.
#pragma once

#include <Eigen/Core>

namespace sluice::bridge {

/// What an accelerator answers, and what the log says about it.
struct AcceleratedIterate {
  Eigen::VectorXd next;
  double relaxation = 1; ///< factor of the residual; 1 where a quasi-Newton step was taken
  int columns = 0;       ///< of the quasi-Newton approximation
};

class Aitken {
public:
  explicit Aitken(double initial_relaxation)
      : initial_relaxation_(initial_relaxation), relaxation_(initial_relaxation) {}
  AcceleratedIterate next(const Eigen::VectorXd &iterate, const Eigen::VectorXd &solved,
                          double = 0);
  void finish_window(const Eigen::VectorXd &, const Eigen::VectorXd &, double = 0);
  /// The window starts anew, with the first factor of all.
  void forget_window();
  template <class Archive> void archive(Archive &a) { a(relaxation_, last_residual_); }

private:
  double initial_relaxation_, relaxation_;
  Eigen::VectorXd last_residual_; // empty at the start of a window
};

} // namespace sluice::bridge
