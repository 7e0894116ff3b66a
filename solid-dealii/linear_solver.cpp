// SPDX-License-Identifier: MIT
#include "solid-dealii/linear_solver.hpp"

#include "bridge/base/check.hpp"

#include <Eigen/UmfPackSupport>

namespace sluice::solid {

struct LinearSolver::Impl {
  Eigen::UmfPackLU<Eigen::SparseMatrix<double>> umfpack;
};

LinearSolver::LinearSolver(const Eigen::SparseMatrix<double> &pattern)
    : impl_(std::make_unique<Impl>()) {
  // The pattern is structurally symmetric with a full diagonal, pivots are taken from there.
  impl_->umfpack.umfpackControl()(UMFPACK_STRATEGY) = UMFPACK_STRATEGY_SYMMETRIC;
  impl_->umfpack.analyzePattern(pattern);
  check(impl_->umfpack.info() == Eigen::Success,
        "solid: UMFPACK could not analyse the sparsity of {} unknowns", pattern.rows());
}

LinearSolver::~LinearSolver() = default;
LinearSolver::LinearSolver(LinearSolver &&) noexcept = default;

bool LinearSolver::factorise(const Eigen::SparseMatrix<double> &matrix) {
  impl_->umfpack.factorize(matrix);
  return impl_->umfpack.info() == Eigen::Success;
}

Eigen::VectorXd LinearSolver::solve(const Eigen::VectorXd &right) const {
  return impl_->umfpack.solve(right);
}

} // namespace sluice::solid
