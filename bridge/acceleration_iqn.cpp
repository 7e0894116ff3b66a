// SPDX-License-Identifier: MIT
#include "bridge/acceleration_iqn.hpp"

#include <algorithm>

namespace sluice::bridge {

LeastSquares QuasiNewton::orthogonalised(Eigen::Index most) const {
  LeastSquares system;
  for (const auto &window : history_)
    for (auto column = window.rbegin(); column != window.rend(); ++column)
      if (system.columns() < most)
        system.add(column->residual_change, column->solution_change, filter_);
  return system;
}

void QuasiNewton::distrust(const Eigen::VectorXd &residual) {
  const double size = residual.norm();
  if (last_residual_.size() == 0)
    first_residual_ = size;
  else if (size > first_residual_)
    history_.resize(1);
}

// A change of the size of rounding or noise has no direction; as the newest column it would come
// first and bend all others.
void QuasiNewton::remember(const Eigen::VectorXd &iterate, const Eigen::VectorXd &solved,
                           double resolution) {
  const Eigen::VectorXd residual = solved - iterate;
  distrust(residual);
  if (last_residual_.size() > 0) {
    const Eigen::VectorXd change = residual - last_residual_;
    if (change.norm() > std::max(resolution, 1e-14 * solved.norm()))
      history_.front().push_back({change, solved - last_solved_});
  }
  last_residual_ = residual;
  last_solved_ = solved;
}

AcceleratedIterate QuasiNewton::next(const Eigen::VectorXd &iterate, const Eigen::VectorXd &solved,
                                     double resolution) {
  remember(iterate, solved, resolution);
  const Eigen::VectorXd residual = solved - iterate;
  const LeastSquares system = orthogonalised(residual.size());
  if (system.columns() == 0)
    return {iterate + initial_relaxation_ * residual, initial_relaxation_, 0};
  return {solved + system.correction(residual), 1, static_cast<int>(system.columns())};
}

void QuasiNewton::finish_window(const Eigen::VectorXd &iterate, const Eigen::VectorXd &solved,
                                double resolution) {
  remember(iterate, solved, resolution);
  last_residual_.resize(0);
  last_solved_.resize(0);
  history_.emplace_front();
  while (history_.size() > windows_reused_ + 1)
    history_.pop_back();
}

void QuasiNewton::forget_window() {
  history_.front().clear();
  last_residual_.resize(0);
  last_solved_.resize(0);
}

} // namespace sluice::bridge
