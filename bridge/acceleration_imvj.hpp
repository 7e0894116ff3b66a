// SPDX-License-Identifier: MIT
// Interface quasi-Newton with the inverse Jacobian from multiple vectors (IQN-IMVJ): earlier
// windows enter as an approximation of the Jacobian, not as columns of one least-squares problem.
//
//   x_next = x~ - J r,   J = J_before + (W - J_before V) V^+,
//
// V, W the columns of this window and J_before what the last one ended with. J is never a matrix:
// each window leaves its V^+ and W - J_before V, and J r is their sum. Only the last
// `windows_reused` ones are kept. Sources: Lindner et al., Coupled Problems (2015) 981-992; sliding
// restart: Spenke, Hosters and Behr, Comput. Methods Appl. Mech. Eng. 361 (2020) 112738.
#pragma once

#include "bridge/acceleration_aitken.hpp"
#include "bridge/acceleration_column.hpp"
#include "bridge/least_squares.hpp"

#include <deque>

namespace sluice::bridge {

class MultiVector {
public:
  MultiVector(double initial_relaxation, int windows_reused, double filter = 1e-4)
      : initial_relaxation_(initial_relaxation),
        windows_reused_(static_cast<std::size_t>(windows_reused)), filter_(filter) {}
  /// `resolution`: a smaller change of the residual makes no column.
  AcceleratedIterate next(const Eigen::VectorXd &iterate, const Eigen::VectorXd &solved,
                          double resolution = 0);
  void finish_window(const Eigen::VectorXd &iterate, const Eigen::VectorXd &solved,
                     double resolution = 0);
  /// The window starts anew: what it taught so far is dropped.
  void forget_window();
  template <class Archive> void archive(Archive &a) { a(windows_, columns_, last_); }

private:
  void remember(const Eigen::VectorXd &iterate, const Eigen::VectorXd &solved, double resolution);
  Eigen::VectorXd before(const Eigen::VectorXd &residual) const; // -J_before r
  LeastSquares of_this_window(Eigen::Index most) const;

  double initial_relaxation_;
  std::size_t windows_reused_;
  double filter_;
  std::deque<LeastSquares> windows_; // newest first
  std::vector<Column> columns_;      // of this window, newest last
  LastIteration last_;
};

} // namespace sluice::bridge
