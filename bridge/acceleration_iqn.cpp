// SPDX-License-Identifier: MIT
#include "bridge/acceleration_iqn.hpp"

#include <algorithm>

namespace sluice::bridge {

// V = Q R column by column, with the W that belongs to it. Q's columns are kept apart.
struct QuasiNewton::LeastSquares {
  std::vector<Eigen::VectorXd> q;
  std::vector<Eigen::VectorXd> r; // r[k] has k + 1 entries: column k of R
  std::vector<const Eigen::VectorXd *> w;

  // Adds the column unless its part outside the span of the others is below `filter` of it.
  void add(const Column &column, double filter) {
    Eigen::VectorXd rest = column.residual_change;
    Eigen::VectorXd entries = Eigen::VectorXd::Zero(static_cast<Eigen::Index>(q.size()) + 1);
    for (int pass = 0; pass < 2; ++pass) // the second removes what rounding left of the first
      for (std::size_t k = 0; k < q.size(); ++k) {
        const double part = q[k].dot(rest);
        entries[static_cast<Eigen::Index>(k)] += part;
        rest -= part * q[k];
      }
    const double length = rest.norm();
    if (length <= filter * column.residual_change.norm())
      return;
    entries[entries.size() - 1] = length;
    q.push_back(rest / length);
    r.push_back(std::move(entries));
    w.push_back(&column.solution_change);
  }

  // W alpha with R alpha = -Q^T residual, by back substitution.
  Eigen::VectorXd correction(const Eigen::VectorXd &residual) const {
    Eigen::VectorXd sum = Eigen::VectorXd::Zero(residual.size());
    std::vector<double> alpha(q.size());
    for (std::size_t k = q.size(); k-- > 0;) {
      alpha[k] = -q[k].dot(residual);
      for (std::size_t j = k + 1; j < q.size(); ++j)
        alpha[k] -= r[j][static_cast<Eigen::Index>(k)] * alpha[j];
      alpha[k] /= r[k][static_cast<Eigen::Index>(k)];
      sum += alpha[k] * *w[k];
    }
    return sum;
  }
};

QuasiNewton::LeastSquares QuasiNewton::orthogonalised(Eigen::Index most) const {
  LeastSquares system;
  for (const auto &window : history_)
    for (auto column = window.rbegin(); column != window.rend(); ++column)
      if (static_cast<Eigen::Index>(system.q.size()) < most)
        system.add(*column, filter_);
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
  if (system.q.empty())
    return {iterate + initial_relaxation_ * residual, initial_relaxation_, 0};
  return {solved + system.correction(residual), 1, static_cast<int>(system.q.size())};
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

} // namespace sluice::bridge
