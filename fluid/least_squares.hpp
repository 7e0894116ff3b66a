// SPDX-License-Identifier: MIT
// Weighted least squares around one point: the fit behind every operator.
//
//   minimise  sum_j W_ij (P_ij . c - (f_j - f_i))^2 + sum_b w_b (e_b . c - h g_b)^2
//
// with P = (qx, qy, qx^2, qx qy, qy^2), q = r / h, h the kernel radius: the value at the point is
// met exactly; a wall adds a row for the normal derivative g at its projection. Any derivative is
// linear in the data: with A = sum W P P^T + sum w e e^T and a functional d (for the Laplacian
// d = (0, 0, 2, 0, 2) / h^2) the coefficients are W_ij P_ij . s and w_b h e_b . s, A s = d.
// Exact for quadratic fields on any cloud with a regular A. Source: Liszka and Orkisz, Comput.
// Struct. 11 (1980) 83, generalised finite differences; Neumann rows derived here.
#pragma once

#include "bridge/base/vec.hpp"

#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>

namespace sluice::fluid {

using Basis = Eigen::Matrix<double, 5, 1>;

/// Quadratic basis at q = r / h.
inline Basis quadratic_basis(const Vec<2> &q) {
  return {q.x(), q.y(), q.x() * q.x(), q.x() * q.y(), q.y() * q.y()};
}

/// Coefficients of h n . grad(f) at q in the basis.
inline Basis normal_derivative(const Vec<2> &q, const Vec<2> &n) {
  return {n.x(), n.y(), 2 * q.x() * n.x(), q.x() * n.y() + q.y() * n.x(), 2 * q.y() * n.y()};
}

/// Moment matrix of the quadratic fit. Neighbours enter through twelve sums of monomials, since
/// P P^T holds no others.
class QuadraticFit {
public:
  /// Value row of a neighbour at q.
  void add_neighbour(const Vec<2> &q, double w) {
    const double x = q.x(), y = q.y(), xx = x * x, xy = x * y, yy = y * y;
    const double wxx = w * xx, wxy = w * xy, wyy = w * yy;
    sum_[0] += wxx;
    sum_[1] += wxy;
    sum_[2] += wyy;
    sum_[3] += wxx * x;
    sum_[4] += wxx * y;
    sum_[5] += wyy * x;
    sum_[6] += wyy * y;
    sum_[7] += wxx * xx;
    sum_[8] += wxx * xy;
    sum_[9] += wxx * yy;
    sum_[10] += wyy * xy;
    sum_[11] += wyy * yy;
  }
  /// Any other row.
  void add_row(const Basis &row, double w) { rows_.noalias() += (w * row) * row.transpose(); }
  /// Cholesky factorisation; false when the moment matrix is not positive definite.
  bool factorise() {
    const auto &s = sum_;
    lower_ << s[0], 0, 0, 0, 0,        //
        s[1], s[2], 0, 0, 0,           //
        s[3], s[4], s[7], 0, 0,        //
        s[4], s[5], s[8], s[9], 0,     //
        s[5], s[6], s[9], s[10], s[11];
    lower_ += rows_;
    for (int k = 0; k < 5; ++k) {
      for (int m = 0; m < k; ++m)
        lower_(k, k) -= lower_(k, m) * lower_(k, m);
      if (!(lower_(k, k) > 0))
        return false;
      lower_(k, k) = 1 / std::sqrt(lower_(k, k)); // the diagonal is kept inverted
      for (int r = k + 1; r < 5; ++r) {
        for (int m = 0; m < k; ++m)
          lower_(r, k) -= lower_(r, m) * lower_(k, m);
        lower_(r, k) *= lower_(k, k);
      }
    }
    return true;
  }
  /// A^-1 functional.
  Basis solve(Basis x) const {
    for (int k = 0; k < 5; ++k) {
      for (int m = 0; m < k; ++m)
        x[k] -= lower_(k, m) * x[m];
      x[k] *= lower_(k, k);
    }
    for (int k = 4; k >= 0; --k) {
      for (int m = k + 1; m < 5; ++m)
        x[k] -= lower_(m, k) * x[m];
      x[k] *= lower_(k, k);
    }
    return x;
  }

private:
  std::array<double, 12> sum_{};
  Eigen::Matrix<double, 5, 5> rows_ = Eigen::Matrix<double, 5, 5>::Zero();
  Eigen::Matrix<double, 5, 5> lower_;
};

/// Second moment of the linear fit, in scaled coordinates q.
class LinearFit {
public:
  void add(const Vec<2> &q, double w) { moment_.noalias() += (w * q) * q.transpose(); }
  /// Inverse moment, or zero when the cloud does not determine a gradient.
  Mat<2> inverse() const {
    const double det = moment_.determinant(), trace = moment_.trace();
    if (!(det > 1e-4 * trace * trace))
      return Mat<2>::Zero();
    return moment_.inverse();
  }

  /// Inverse moment that never amplifies more than ten times beyond the best determined direction:
  /// linear fields are exact where the neighbours spread in both directions, and the gradient
  /// across a filament fades instead of growing.
  Mat<2> limited_inverse() const {
    const double trace = moment_.trace();
    if (!(trace > 0))
      return Mat<2>::Zero();
    const Eigen::SelfAdjointEigenSolver<Mat<2>> eigen(moment_);
    const double largest = eigen.eigenvalues()[1], floor = 0.1 * largest;
    Vec<2> inverse;
    for (int k = 0; k < 2; ++k) {
      const double lambda = std::max(eigen.eigenvalues()[k], 0.0);
      inverse[k] = lambda >= floor ? 1 / lambda : lambda / (floor * floor);
    }
    return eigen.eigenvectors() * inverse.asDiagonal() * eigen.eigenvectors().transpose();
  }

private:
  Mat<2> moment_ = Mat<2>::Zero();
};

} // namespace sluice::fluid
