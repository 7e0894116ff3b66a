// SPDX-License-Identifier: MIT
#include "solid-dealii/linear_solver_method.hpp"

#include "bridge/base/check.hpp"

#include <Eigen/UmfPackSupport>

namespace sluice::solid {
namespace {

class Direct : public LinearSolver::Method {
public:
  explicit Direct(const Eigen::SparseMatrix<double> &pattern) {
    // The pattern is structurally symmetric with a full diagonal, pivots are taken from there.
    umfpack_.umfpackControl()(UMFPACK_STRATEGY) = UMFPACK_STRATEGY_SYMMETRIC;
    umfpack_.analyzePattern(pattern);
    check(umfpack_.info() == Eigen::Success,
          "solid: UMFPACK could not analyse the sparsity of {} unknowns", pattern.rows());
  }
  bool factorise(const Eigen::SparseMatrix<double> &matrix) override {
    umfpack_.factorize(matrix);
    return umfpack_.info() == Eigen::Success;
  }
  Eigen::VectorXd solve(const Eigen::VectorXd &right) override { return umfpack_.solve(right); }
  void forget() override {} // factors are of the last matrix alone

private:
  Eigen::UmfPackLU<Eigen::SparseMatrix<double>> umfpack_;
};

} // namespace

LinearSolverKind linear_solver_kind(std::string_view name) {
  if (name == "automatic")
    return LinearSolverKind::automatic;
  check(name == "direct" || name == "cg",
        "solid: unknown linear solver '{}'; give automatic, direct or cg", name);
  return name == "cg" ? LinearSolverKind::cg : LinearSolverKind::direct;
}

LinearSolver::LinearSolver(const Eigen::SparseMatrix<double> &pattern, LinearSolverKind kind,
                           const std::function<RigidMotions()> &motions) {
  const bool is_direct = kind == LinearSolverKind::direct ||
                         (kind == LinearSolverKind::automatic && pattern.rows() <= most_for_direct);
  if (is_direct)
    method_ = std::make_unique<Direct>(pattern);
  else
    method_ = conjugate_gradients(motions());
}

LinearSolver::~LinearSolver() = default;
LinearSolver::LinearSolver(LinearSolver &&) noexcept = default;

bool LinearSolver::factorise(const Eigen::SparseMatrix<double> &matrix) {
  return method_->factorise(matrix);
}
Eigen::VectorXd LinearSolver::solve(const Eigen::VectorXd &right) { return method_->solve(right); }
void LinearSolver::forget() { method_->forget(); }
int LinearSolver::last_iterations() const { return method_->last_iterations; }
int LinearSolver::set_ups() const { return method_->set_ups; }

} // namespace sluice::solid
