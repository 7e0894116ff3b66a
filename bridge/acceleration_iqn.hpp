// SPDX-License-Identifier: MIT
// Interface quasi-Newton with the inverse Jacobian from a least-squares model (IQN-ILS).
//
// From the iterations of this window and the last `windows_reused` ones: columns V = [delta r],
// W = [delta x~], differences of successive iterations. With alpha = argmin |V alpha + r|,
//   x_next = x~ + W alpha    ( = x + r + W alpha ),
// the fixed-point step, corrected where the columns know how the residual answers.
// Source: Degroote, Bathe and Vierendeels, Comput. Struct. 87 (2009) 793-801.
// The columns are orthogonalised from the newest to the oldest; one whose new part is below
// `filter` of its length only repeats what newer ones say and is left out of this step
// (least_squares.hpp). Without a column: the relaxed step. With windows_reused = 0 the columns of
// the last window serve until this one has its first.
//
// Ours: a residual larger than the window's first one says that the columns of earlier windows
// mislead (they are old, or full of the solvers' noise); they are forgotten at once. On a chain of
// 40 masses with added mass up to 80 and noise of 1e-4 in the force, windows that reused history
// without this rule did not converge in 200 iterations; with it they take 4.5 on average.
#pragma once

#include "bridge/acceleration_aitken.hpp"
#include "bridge/acceleration_column.hpp"
#include "bridge/least_squares.hpp"

#include <deque>
#include <vector>

namespace sluice::bridge {

class QuasiNewton {
public:
  QuasiNewton(double initial_relaxation, int windows_reused, double filter = 1e-4)
      : initial_relaxation_(initial_relaxation),
        windows_reused_(static_cast<std::size_t>(windows_reused)), filter_(filter) {}
  /// `resolution` [m]: a smaller change of the residual makes no column.
  AcceleratedIterate next(const Eigen::VectorXd &iterate, const Eigen::VectorXd &solved,
                          double resolution = 0);
  void finish_window(const Eigen::VectorXd &iterate, const Eigen::VectorXd &solved,
                     double resolution = 0);
  /// The window starts anew: what it taught so far is dropped.
  void forget_window();
  template <class Archive> void archive(Archive &a) { a(history_, first_residual_, last_); }

private:
  void distrust(const Eigen::VectorXd &residual);
  void remember(const Eigen::VectorXd &iterate, const Eigen::VectorXd &solved, double resolution);
  LeastSquares orthogonalised(Eigen::Index most) const;

  double initial_relaxation_;
  std::size_t windows_reused_;
  double filter_;
  std::deque<std::vector<Column>> history_{1}; // front: this window; in a window the newest is last
  double first_residual_ = 0;                  // norm, of this window [m]
  LastIteration last_;
};

} // namespace sluice::bridge
