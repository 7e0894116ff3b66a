// SPDX-License-Identifier: MIT
// min |V alpha + r| for columns that come one by one, by a QR decomposition that leaves out columns
// which only repeat the earlier ones (QR2 filter of Haelterman et al., Comput. Struct. 171 (2016)
// 9-17). With each column of V goes one of W; the answer is W alpha.
#pragma once

#include <Eigen/Core>

#include <vector>

namespace sluice::bridge {

class LeastSquares {
public:
  /// Adds a pair of columns unless the part of `v` outside the span of the others is below `filter`
  /// of its length; true when it was added.
  bool add(const Eigen::VectorXd &v, const Eigen::VectorXd &w, double filter);
  /// W alpha with alpha = argmin |V alpha + r|.
  Eigen::VectorXd correction(const Eigen::VectorXd &r) const;
  Eigen::Index columns() const { return static_cast<Eigen::Index>(q_.size()); }
  template <class Archive> void archive(Archive &a) { a(q_, r_, w_); }

private:
  std::vector<Eigen::VectorXd> q_; // orthonormal
  std::vector<Eigen::VectorXd> r_; // column k of R has k + 1 entries
  std::vector<Eigen::VectorXd> w_;
};

} // namespace sluice::bridge
