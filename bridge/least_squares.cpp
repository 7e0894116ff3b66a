// SPDX-License-Identifier: MIT
#include "bridge/least_squares.hpp"

namespace sluice::bridge {

bool LeastSquares::add(const Eigen::VectorXd &v, const Eigen::VectorXd &w, double filter) {
  Eigen::VectorXd rest = v;
  Eigen::VectorXd entries = Eigen::VectorXd::Zero(columns() + 1);
  for (int pass = 0; pass < 2; ++pass) // the second removes what rounding left of the first
    for (std::size_t k = 0; k < q_.size(); ++k) {
      const double part = q_[k].dot(rest);
      entries[static_cast<Eigen::Index>(k)] += part;
      rest -= part * q_[k];
    }
  const double length = rest.norm();
  if (length <= filter * v.norm())
    return false;
  entries[entries.size() - 1] = length;
  q_.push_back(rest / length);
  r_.push_back(std::move(entries));
  w_.push_back(w);
  return true;
}

// R alpha = -Q^T r, by back substitution.
Eigen::VectorXd LeastSquares::correction(const Eigen::VectorXd &r) const {
  Eigen::VectorXd sum = Eigen::VectorXd::Zero(r.size());
  std::vector<double> alpha(q_.size());
  for (std::size_t k = q_.size(); k-- > 0;) {
    alpha[k] = -q_[k].dot(r);
    for (std::size_t j = k + 1; j < q_.size(); ++j)
      alpha[k] -= r_[j][static_cast<Eigen::Index>(k)] * alpha[j];
    alpha[k] /= r_[k][static_cast<Eigen::Index>(k)];
    sum += alpha[k] * w_[k];
  }
  return sum;
}

} // namespace sluice::bridge
