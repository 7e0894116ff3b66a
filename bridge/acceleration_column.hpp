// SPDX-License-Identifier: MIT
// What the quasi-Newton methods learn from two iterations that follow each other.
#pragma once

#include <Eigen/Core>

#include <algorithm>
#include <optional>
#include <utility>

namespace sluice::bridge {

/// A column of V and one of W.
struct Column {
  Eigen::VectorXd residual_change, solution_change;
  template <class Archive> void archive(Archive &a) { a(residual_change, solution_change); }
};

/// The last iteration of a window.
class LastIteration {
public:
  /// The column that the step from it to this one makes. None in a window's first iteration, and
  /// none from a change of the residual below `resolution`, which is the size of rounding or noise:
  /// it has no direction, and as the newest column it would come first and bend all others.
  std::optional<Column> column_to(const Eigen::VectorXd &iterate, const Eigen::VectorXd &solved,
                                  double resolution) {
    Eigen::VectorXd residual = solved - iterate;
    Column column;
    if (!is_none()) {
      column.residual_change = residual - residual_;
      column.solution_change = solved - solved_;
    }
    residual_ = std::move(residual);
    solved_ = solved;
    if (column.residual_change.norm() <= std::max(resolution, 1e-14 * solved.norm()))
      return std::nullopt;
    return column;
  }
  bool is_none() const { return residual_.size() == 0; }
  void forget() {
    residual_.resize(0);
    solved_.resize(0);
  }
  template <class Archive> void archive(Archive &a) { a(residual_, solved_); }

private:
  Eigen::VectorXd residual_, solved_; // empty before a window's first iteration
};

} // namespace sluice::bridge
