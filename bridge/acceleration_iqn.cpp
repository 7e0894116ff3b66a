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
  if (last_.is_none())
    first_residual_ = size;
  else if (size > first_residual_)
    history_.resize(1);
}

void QuasiNewton::remember(const Eigen::VectorXd &iterate, const Eigen::VectorXd &solved,
                           double resolution) {
  distrust(solved - iterate);
  if (auto column = last_.column_to(iterate, solved, resolution)) {
    history_.front().push_back(*std::move(column));
    if (windows_reused_ == 0)
      history_.resize(1);
  }
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
  last_.forget();
  if (!history_.front().empty())
    history_.emplace_front();
  while (history_.size() > std::max<std::size_t>(windows_reused_, 1) + 1)
    history_.pop_back();
}

void QuasiNewton::forget_window() {
  history_.front().clear();
  last_.forget();
}

} // namespace sluice::bridge
