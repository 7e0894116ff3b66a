// SPDX-License-Identifier: MIT
#include "bridge/acceleration_imvj.hpp"

namespace sluice::bridge {

Eigen::VectorXd MultiVector::before(const Eigen::VectorXd &residual) const {
  Eigen::VectorXd sum = Eigen::VectorXd::Zero(residual.size());
  for (const LeastSquares &window : windows_)
    sum += window.correction(residual);
  return sum;
}

// before() is -J_before, so that W - J_before V = W + before(V).
LeastSquares MultiVector::of_this_window(Eigen::Index most) const {
  LeastSquares system;
  for (auto column = columns_.rbegin(); column != columns_.rend(); ++column)
    if (system.columns() < most)
      system.add(column->residual_change, column->solution_change + before(column->residual_change),
                 filter_);
  return system;
}

void MultiVector::remember(const Eigen::VectorXd &iterate, const Eigen::VectorXd &solved,
                           double resolution) {
  if (auto column = last_.column_to(iterate, solved, resolution))
    columns_.push_back(*std::move(column));
}

AcceleratedIterate MultiVector::next(const Eigen::VectorXd &iterate, const Eigen::VectorXd &solved,
                                     double resolution) {
  remember(iterate, solved, resolution);
  const Eigen::VectorXd residual = solved - iterate;
  const LeastSquares system = of_this_window(residual.size());
  if (system.columns() == 0 && windows_.empty())
    return {iterate + initial_relaxation_ * residual, initial_relaxation_, 0};
  return {solved + before(residual) + system.correction(residual), 1,
          static_cast<int>(system.columns())};
}

void MultiVector::finish_window(const Eigen::VectorXd &iterate, const Eigen::VectorXd &solved,
                                double resolution) {
  remember(iterate, solved, resolution);
  if (LeastSquares system = of_this_window(solved.size());
      system.columns() > 0 && windows_reused_ > 0)
    windows_.push_front(std::move(system));
  while (windows_.size() > windows_reused_)
    windows_.pop_back();
  forget_window();
}

void MultiVector::forget_window() {
  columns_.clear();
  last_.forget();
}

} // namespace sluice::bridge
