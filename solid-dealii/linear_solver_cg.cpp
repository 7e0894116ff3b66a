// SPDX-License-Identifier: MIT
// Krylov methods with Trilinos' smoothed aggregation. On several ranks every one has the matrix of
// its own cells: a product is that of the parts, added up, and only the multigrid assembles rows.
#include "solid-dealii/linear_solver_method.hpp"
#include "solid-dealii/ranks_mpi.hpp"

#include <Epetra_FECrsMatrix.h>
#include <Epetra_Map.h>
#include <Epetra_MpiComm.h>
#include <Epetra_Vector.h>
#include <Teuchos_ParameterList.hpp>
#include <ml_MultiLevelPreconditioner.h>
#include <ml_utils.h>

#include <cmath>
#include <vector>

namespace sluice::solid {
namespace {

class ConjugateGradients : public LinearSolver::Method {
public:
  explicit ConjugateGradients(RigidMotions motions)
      : motions_(std::move(motions)), communicator_(mpi_communicator(motions_.ranks)),
        map_(-1, static_cast<int>(motions_.vectors.rows()), 0, communicator_),
        from_(Eigen::VectorXd::Zero(motions_.vectors.rows())), to_(from_) {}

  bool factorise(const Eigen::SparseMatrix<double> &matrix) override {
    matrix_ = &matrix;
    if (!multigrid_ || needs_set_up_)
      set_up(matrix);
    return true;
  }

  // With a set-up of an earlier matrix first; where that fails, with one of its own.
  Eigen::VectorXd solve(const Eigen::VectorXd &right) override {
    last_iterations = 0;
    Eigen::VectorXd x = iterate(right);
    if (!x.allFinite() && !is_indefinite_ && !is_fresh_) {
      set_up(*matrix_);
      last_iterations = 0;
      x = iterate(right);
    }
    if (is_indefinite_)
      return least_residual(right);
    if (x.allFinite())
      judge_set_up();
    else
      needs_set_up_ = true;
    return x;
  }

  void forget() override {
    multigrid_.reset();
    needs_set_up_ = true;
  }

private:
  using Vector = Eigen::VectorXd;

  double dot(const Vector &a, const Vector &b) const { return motions_.unknowns.dot(a, b); }

  void multiply(const Vector &p, Vector &q) const {
    q.noalias() = matrix_->transpose() * p; // symmetric; by rows in memory
    motions_.unknowns.add_up(q);
  }

  static Vector failed(const Vector &right) { return Vector::Constant(right.size(), std::nan("")); }

  // Hestenes and Stiefel's method; a right side of zero has the solution zero. Not a number where
  // the matrix turns out not to be positive definite, or after too many iterations.
  Vector iterate(const Vector &right) {
    constexpr int most = 500;
    Vector x = Vector::Zero(right.size()), r = right, z(right.size()), p, q(right.size());
    const double wanted = LinearSolver::cg_tolerance * motions_.unknowns.norm(right);
    double rho = 0;
    is_indefinite_ = false;
    for (int k = 0; motions_.unknowns.norm(r) > wanted; ++k, ++last_iterations) {
      precondition(r, z);
      const double rho_before = rho;
      rho = dot(r, z);
      is_indefinite_ = is_fresh_ && rho <= 0; // an old multigrid may be of an indefinite matrix
      if (k == most || !(rho > 0))
        return failed(right);
      p = k == 0 ? z : Vector(z + rho / rho_before * p);
      multiply(p, q);
      const double curvature = dot(p, q);
      is_indefinite_ = curvature <= 0;
      if (!(curvature > 0))
        return failed(right);
      x += rho / curvature * p;
      r -= rho / curvature * q;
    }
    return x;
  }

  // For a tangent beyond a limit point. The preconditioner has to be positive definite: the
  // multigrid of an earlier matrix that conjugate gradients have solved, else the size of the
  // diagonal.
  Vector least_residual(const Vector &right) {
    if (!is_fresh_) {
      const Vector x = minres(right, [&](const Vector &v, Vector &z) { precondition(v, z); });
      if (x.allFinite())
        return x;
    }
    needs_set_up_ = true; // a multigrid of an indefinite matrix serves nobody
    const Vector scale = positive_diagonal();
    return minres(right, [&](const Vector &v, Vector &z) { z = v.cwiseQuotient(scale); });
  }

  // C. C. Paige, M. A. Saunders, SIAM J. Numer. Anal. 12 (1975) 617, as written by H. Elman, D.
  // Silvester, A. Wathen, Finite Elements and Fast Iterative Solvers (2014), algorithm 4.1. Not a
  // number where the preconditioner is not positive definite, or after too many iterations.
  template <class Preconditioner>
  Vector minres(const Vector &right, const Preconditioner &prepare) {
    constexpr int most = 5000;
    const Eigen::Index n = right.size();
    Vector x = Vector::Zero(n), v_before = x, v = right, v_next(n), z(n), z_next(n), w_before = x,
           w = x, w_next(n);
    prepare(v, z);
    double gamma_before = 1, gamma = std::sqrt(dot(z, v)), eta = gamma;
    double s_before = 0, s = 0, c_before = 1, c = 1;
    const double wanted = LinearSolver::cg_tolerance * gamma;
    for (int k = 0; !(std::abs(eta) <= wanted); ++k, ++last_iterations) {
      if (k == most || !(gamma > 0))
        return failed(right);
      z /= gamma;
      multiply(z, v_next);
      const double delta = dot(v_next, z);
      v_next -= delta / gamma * v + gamma / gamma_before * v_before;
      prepare(v_next, z_next);
      const double gamma_next = std::sqrt(dot(z_next, v_next));
      const double a0 = c * delta - c_before * s * gamma, a1 = std::hypot(a0, gamma_next);
      const double a2 = s * delta + c_before * c * gamma, a3 = s_before * gamma;
      w_next = (z - a3 * w_before - a2 * w) / a1;
      c_before = std::exchange(c, a0 / a1);
      s_before = std::exchange(s, gamma_next / a1);
      x += c * eta * w_next;
      eta *= -s;
      v_before.swap(v);
      v.swap(v_next);
      z.swap(z_next);
      w_before.swap(w);
      w.swap(w_next);
      gamma_before = std::exchange(gamma, gamma_next);
    }
    return x;
  }

  Vector positive_diagonal() const {
    Vector diagonal = matrix_->diagonal();
    motions_.unknowns.add_up(diagonal);
    return diagonal.cwiseAbs();
  }

  // A symmetric matrix by columns is one by rows. Places of fixed components get a diagonal alone.
  void set_up(const Eigen::SparseMatrix<double> &matrix) {
    const double diagonal = matrix.diagonal().mean();
    const int own = map_.NumMyElements();
    std::vector<int> lengths(static_cast<std::size_t>(own), 1);
    for (int i = 0; i < matrix.cols(); ++i)
      if (is_own(place(i)))
        lengths[static_cast<std::size_t>(place(i) - motions_.first)] =
            matrix.outerIndexPtr()[i + 1] - matrix.outerIndexPtr()[i];
    multigrid_.reset(); // it refers to the copy
    copy_ = std::make_unique<Epetra_FECrsMatrix>(Copy, map_, lengths.data());
    std::vector<bool> is_filled(lengths.size(), false);
    std::vector<int> columns;
    for (int i = 0; i < matrix.cols(); ++i) {
      const int start = matrix.outerIndexPtr()[i], end = matrix.outerIndexPtr()[i + 1];
      columns.clear();
      for (int k = start; k < end; ++k)
        columns.push_back(place(matrix.innerIndexPtr()[k]));
      copy_->InsertGlobalValues(place(i), end - start, matrix.valuePtr() + start, columns.data());
      if (is_own(place(i)))
        is_filled[static_cast<std::size_t>(place(i) - motions_.first)] = true;
    }
    for (int i = 0; i < own; ++i)
      if (const int row = motions_.first + i; !is_filled[static_cast<std::size_t>(i)])
        copy_->InsertGlobalValues(row, 1, &diagonal, &row);
    copy_->GlobalAssemble();
    ML_set_random_seed(1 + motions_.ranks.rank()); // every set-up guesses eigenvalues from the same
    multigrid_ = std::make_unique<ML_Epetra::MultiLevelPreconditioner>(*copy_, settings(), true);
    ++set_ups;
    is_fresh_ = true;
    needs_set_up_ = false;
  }

  int place(int unknown) const { return motions_.place[static_cast<std::size_t>(unknown)]; }
  bool is_own(int place) const {
    return place >= motions_.first && place < motions_.first + map_.NumMyElements();
  }

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

  void precondition(const Vector &r, Vector &z) {
    for (int i = 0; i < r.size(); ++i)
      if (is_own(place(i)))
        from_[place(i) - motions_.first] = r[i];
    const Epetra_Vector from(View, map_, from_.data());
    Epetra_Vector to(View, map_, to_.data());
    multigrid_->ApplyInverse(from, to);
    for (int i = 0; i < z.size(); ++i)
      z[i] = is_own(place(i)) ? to_[place(i) - motions_.first] : 0;
    motions_.unknowns.copy_from_owners(z);
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
  Vector from_, to_; // of the places here, with one for every fixed component
  const Eigen::SparseMatrix<double> *matrix_ = nullptr;
  std::unique_ptr<Epetra_FECrsMatrix> copy_; // what the set-up was made for
  std::unique_ptr<ML_Epetra::MultiLevelPreconditioner> multigrid_;
  bool is_fresh_ = false, needs_set_up_ = false;
  bool is_indefinite_ = false; // as the last conjugate gradients have found
  int fresh_iterations_ = 0;   // of the first solution after a set-up
};

} // namespace

std::unique_ptr<LinearSolver::Method> conjugate_gradients(RigidMotions motions) {
  return std::make_unique<ConjugateGradients>(std::move(motions));
}

} // namespace sluice::solid
