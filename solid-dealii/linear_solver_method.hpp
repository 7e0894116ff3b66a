// SPDX-License-Identifier: MIT
// What stands behind LinearSolver: one class per method, so that Trilinos is seen by one file.
#pragma once

#include "solid-dealii/linear_solver.hpp"

namespace sluice::solid {

class LinearSolver::Method {
public:
  virtual ~Method() = default;
  virtual bool factorise(const Eigen::SparseMatrix<double> &matrix) = 0;
  virtual Eigen::VectorXd solve(const Eigen::VectorXd &right) = 0;
  virtual void forget() = 0;

  int last_iterations = 0;
  int set_ups = 0;
};

/// Conjugate gradients preconditioned by Trilinos ML.
std::unique_ptr<LinearSolver::Method> conjugate_gradients(RigidMotions motions);

} // namespace sluice::solid
