// SPDX-License-Identifier: MIT
// Sparse direct solution with UMFPACK; the symbolic analysis is made once per sparsity pattern.
// Meant for up to some 5,000 unknowns: beyond that the fill of a direct solver takes over.
#pragma once

#include <Eigen/Sparse>

#include <memory>

namespace sluice::solid {

class LinearSolver {
public:
  /// `pattern` gives the sparsity of every matrix to come.
  explicit LinearSolver(const Eigen::SparseMatrix<double> &pattern);
  ~LinearSolver();
  LinearSolver(LinearSolver &&) noexcept;

  /// False when the matrix is singular to working precision.
  bool factorise(const Eigen::SparseMatrix<double> &matrix);
  /// Solves with the last matrix factorised, which must still exist.
  Eigen::VectorXd solve(const Eigen::VectorXd &right) const;

private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

} // namespace sluice::solid
