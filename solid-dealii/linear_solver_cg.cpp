// SPDX-License-Identifier: MIT
#include "solid-dealii/linear_solver_method.hpp"

#include <Epetra_CrsMatrix.h>
#include <Epetra_Map.h>
#include <Epetra_MpiComm.h>
#include <Epetra_Vector.h>
#include <Teuchos_ParameterList.hpp>
#include <ml_MultiLevelPreconditioner.h>

#include <cmath>
#include <cstdlib>
#include <vector>

namespace sluice::solid {
namespace {

// Debian's ML wants MPI even for one process; nothing else here does. Open MPI would start a daemon
// for a process on its own unless told that it stays alone.
MPI_Comm own_process() {
  int is_initialised = 0;
  MPI_Initialized(&is_initialised);
  if (is_initialised == 0) {
    setenv("OMPI_MCA_ess_singleton_isolated", "1", 0);
    MPI_Init(nullptr, nullptr);
    std::atexit([] { MPI_Finalize(); });
  }
  return MPI_COMM_SELF;
}

class ConjugateGradients : public LinearSolver::Method {
public:
  explicit ConjugateGradients(RigidMotions motions)
      : motions_(std::move(motions)), communicator_(own_process()),
        map_(static_cast<int>(motions_.vectors.rows()), 0, communicator_),
        from_(Eigen::VectorXd::Zero(motions_.vectors.rows())), to_(from_) {}

  bool factorise(const Eigen::SparseMatrix<double> &matrix) override {
    matrix_ = &matrix;
    if (!multigrid_ || needs_set_up_)
      set_up(matrix);
    return true;
  }

  // With a set-up of an earlier matrix first; where that fails, with one of its own.
  Eigen::VectorXd solve(const Eigen::VectorXd &right) override {
    Eigen::VectorXd x = iterate(right);
    if (!x.allFinite() && !is_fresh_) {
      set_up(*matrix_);
      x = iterate(right);
    }
    if (x.allFinite())
      judge_set_up();
    else
      needs_set_up_ = true;
    return x;
  }

private:
  // Hestenes and Stiefel's method; a right side of zero has the solution zero. Not a number where
  // the matrix turns out not to be positive definite, or after too many iterations.
  Eigen::VectorXd iterate(const Eigen::VectorXd &right) {
    constexpr int most = 500;
    const auto failed = Eigen::VectorXd::Constant(right.size(), std::nan(""));
    Eigen::VectorXd x = Eigen::VectorXd::Zero(right.size()), r = right, z(right.size()), p, q;
    const double wanted = LinearSolver::cg_tolerance * right.norm();
    double rho = 0;
    for (last_iterations = 0; r.norm() > wanted; ++last_iterations) {
      precondition(r, z);
      const double rho_before = rho;
      rho = r.dot(z);
      if (last_iterations == most || !(rho > 0))
        return failed;
      p = last_iterations == 0 ? z : Eigen::VectorXd(z + rho / rho_before * p);
      q.noalias() = matrix_->transpose() * p;
      const double curvature = p.dot(q);
      if (!(curvature > 0))
        return failed;
      x += rho / curvature * p;
      r -= rho / curvature * q;
    }
    return x;
  }

  // A symmetric matrix by columns is one by rows. Places of fixed components get a diagonal alone.
  void set_up(const Eigen::SparseMatrix<double> &matrix) {
    const double diagonal = matrix.diagonal().mean();
    std::vector<int> lengths(static_cast<std::size_t>(map_.NumMyElements()), 1);
    for (int i = 0; i < matrix.cols(); ++i)
      lengths[static_cast<std::size_t>(place(i))] =
          matrix.outerIndexPtr()[i + 1] - matrix.outerIndexPtr()[i];
    multigrid_.reset(); // it refers to the copy
    copy_ = std::make_unique<Epetra_CrsMatrix>(Copy, map_, lengths.data(), true);
    std::vector<bool> is_filled(lengths.size(), false);
    std::vector<int> columns;
    for (int i = 0; i < matrix.cols(); ++i) {
      const int start = matrix.outerIndexPtr()[i], end = matrix.outerIndexPtr()[i + 1];
      columns.clear();
      for (int k = start; k < end; ++k)
        columns.push_back(place(matrix.innerIndexPtr()[k]));
      copy_->InsertGlobalValues(place(i), end - start, matrix.valuePtr() + start, columns.data());
      is_filled[static_cast<std::size_t>(place(i))] = true;
    }
    for (int i = 0; i < static_cast<int>(is_filled.size()); ++i)
      if (!is_filled[static_cast<std::size_t>(i)])
        copy_->InsertGlobalValues(i, 1, &diagonal, &i);
    copy_->FillComplete();
    multigrid_ = std::make_unique<ML_Epetra::MultiLevelPreconditioner>(*copy_, settings(), true);
    ++set_ups;
    is_fresh_ = true;
    needs_set_up_ = false;
  }

  int place(int unknown) const { return motions_.place[static_cast<std::size_t>(unknown)]; }

  Teuchos::ParameterList settings() {
    Teuchos::ParameterList list;
    ML_Epetra::SetDefaults("SA", list);
    list.set("ML output", 0);
    list.set("PDE equations", motions_.block);
    list.set("null space: type", "pre-computed");
    list.set("null space: dimension", static_cast<int>(motions_.vectors.cols()));
    list.set("null space: vectors", motions_.vectors.data());
    list.set("aggregation: type", "Uncoupled");
    list.set("aggregation: threshold", 0.0);
    list.set("smoother: type", "symmetric Gauss-Seidel");
    list.set("smoother: sweeps", 1);
    list.set("coarse: type", "Amesos-KLU");
    list.set("coarse: max size", 500);
    return list;
  }

  void precondition(const Eigen::VectorXd &r, Eigen::VectorXd &z) {
    for (int i = 0; i < r.size(); ++i)
      from_[place(i)] = r[i];
    const Epetra_Vector from(View, map_, from_.data());
    Epetra_Vector to(View, map_, to_.data());
    multigrid_->ApplyInverse(from, to);
    for (int i = 0; i < z.size(); ++i)
      z[i] = to_[place(i)];
  }

  void judge_set_up() {
    if (is_fresh_)
      fresh_iterations_ = last_iterations;
    is_fresh_ = false;
    needs_set_up_ = last_iterations > fresh_iterations_ + fresh_iterations_ / 2 + 1;
  }

  RigidMotions motions_;
  Epetra_MpiComm communicator_;
  Epetra_Map map_;
  Eigen::VectorXd from_, to_; // with a place for every fixed component
  const Eigen::SparseMatrix<double> *matrix_ = nullptr;
  std::unique_ptr<Epetra_CrsMatrix> copy_; // what the set-up was made for
  std::unique_ptr<ML_Epetra::MultiLevelPreconditioner> multigrid_;
  bool is_fresh_ = false, needs_set_up_ = false;
  int fresh_iterations_ = 0; // of the first solution after a set-up
};

} // namespace

std::unique_ptr<LinearSolver::Method> conjugate_gradients(RigidMotions motions) {
  return std::make_unique<ConjugateGradients>(std::move(motions));
}

} // namespace sluice::solid
