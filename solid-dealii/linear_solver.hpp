// SPDX-License-Identifier: MIT
// Linear systems with a symmetric sparse matrix of fixed sparsity: UMFPACK with one symbolic
// analysis for few unknowns, conjugate gradients with smoothed aggregation (Trilinos ML) for many.
//
// The multigrid keeps the rigid motions of the body, and its set-up is used again for later
// matrices until conjugate gradients need half as many iterations more than with a fresh one.
// Source: P. Vanek, J. Mandel, M. Brezina, Computing 56 (1996) 179. A matrix that conjugate
// gradients find not to be positive definite is solved by MINRES, as the direct solver would solve
// it.
#pragma once

#include "solid-dealii/shared_entries.hpp"

#include <Eigen/Sparse>

#include <functional>
#include <memory>
#include <string_view>
#include <vector>

namespace sluice::solid {

enum class LinearSolverKind { automatic, direct, cg };

/// `name` is "automatic", "direct" or "cg".
LinearSolverKind linear_solver_kind(std::string_view name);

/// What a multigrid has to know of a body: unknowns in blocks of one node each, with places left
/// for components that are fixed, and the motions that cost no energy, one a column, zero at such
/// places. On several ranks the places of each rank follow those of the ranks before.
struct RigidMotions {
  int block = 0;           ///< components per node
  std::vector<int> place;  ///< of every unknown held here among the blocks of the body
  int first = 0;           ///< place of the first block that this rank owns
  Eigen::MatrixXd vectors; ///< as many rows as this rank owns places
  Ranks ranks;
  SharedEntries unknowns;
};

class LinearSolver {
public:
  /// Unknowns up to which `automatic` means direct: beyond, the fill of the factors takes over.
  static constexpr int most_for_direct = 5000;
  /// Residual of conjugate gradients relative to the right side: far enough below what one Newton
  /// iteration gains.
  static constexpr double cg_tolerance = 1e-8;

  /// `pattern` gives the sparsity of every matrix to come. `motions` is asked once, and only by
  /// the multigrid; on several ranks matrices are those of the cells of each, and it is the only
  /// one.
  explicit LinearSolver(const Eigen::SparseMatrix<double> &pattern,
                        LinearSolverKind kind = LinearSolverKind::direct,
                        const std::function<RigidMotions()> &motions = {});
  ~LinearSolver();
  LinearSolver(LinearSolver &&) noexcept;

  /// False when the matrix is singular to working precision.
  bool factorise(const Eigen::SparseMatrix<double> &matrix);
  /// Solves with the last matrix factorised, which must still exist. Not finite where the iteration
  /// does not converge.
  Eigen::VectorXd solve(const Eigen::VectorXd &right);
  /// What it kept of earlier matrices: the next one is solved with the bits of a new solver.
  void forget();
  int last_iterations() const; ///< of conjugate gradients or MINRES; 0 for the direct solver
  int set_ups() const;         ///< of the multigrid since the start

  /// What one kind of solver does.
  class Method;

private:
  std::unique_ptr<Method> method_;
};

} // namespace sluice::solid
