// SPDX-License-Identifier: MIT
// Weighted least squares around one point: the fit behind every operator.
//
//   minimise  sum_j W_ij (P_ij . c - (f_j - f_i))^2 + sum_b w_b (e_b . c - h g_b)^2
//
// with P = (q_a, q_a q_b for a <= b), in the plane (qx, qy, qx^2, qx qy, qy^2), q = r / h, h the
// kernel radius: the value at the point is met exactly; a wall adds a row for the normal derivative
// g at its projection. Any derivative is linear in the data: with A = sum W P P^T + sum w e e^T and
// a functional d (for the Laplacian 2 / h^2 at the squares) the coefficients are W_ij P_ij . s and
// w_b h e_b . s, A s = d. Exact for quadratic fields on any cloud with a regular A. Source: Liszka
// and Orkisz, Comput. Struct. 11 (1980) 83, generalised finite differences; Neumann rows derived
// here.
#pragma once

#include "fluid/packs.hpp"

#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <type_traits>
#include <utility>

namespace sluice::fluid {

/// Products of two coordinates, and all terms of the quadratic: 3 of 5 in the plane, 6 of 9 in
/// space.
template <int dim> inline constexpr int n_products = dim *(dim + 1) / 2;
template <int dim> inline constexpr int n_terms = dim + n_products<dim>;

template <int dim> using Products = Eigen::Matrix<double, n_products<dim>, 1>;
/// Coefficients of the quadratic, or a functional of them.
template <int dim> using Basis = Eigen::Matrix<double, n_terms<dim>, 1>;
/// One functional per direction.
template <int dim> using Functionals = Eigen::Matrix<double, n_terms<dim>, dim>;

/// q_a q_b, a <= b, the second index running fastest.
inline Products<2> products(const Vec<2> &q) {
  return {q.x() * q.x(), q.x() * q.y(), q.y() * q.y()};
}
inline Products<3> products(const Vec<3> &q) {
  Products<3> p;
  p << q.x() * q.x(), q.x() * q.y(), q.x() * q.z(), q.y() * q.y(), q.y() * q.z(), q.z() * q.z();
  return p;
}

inline std::array<Pack, 3> products(const PackVec<2> &q) {
  return {q[0] * q[0], q[0] * q[1], q[1] * q[1]};
}
inline std::array<Pack, 6> products(const PackVec<3> &q) {
  return {q[0] * q[0], q[0] * q[1], q[0] * q[2], q[1] * q[1], q[1] * q[2], q[2] * q[2]};
}

/// Quadratic basis at q = r / h.
template <int dim> Basis<dim> quadratic_basis(const Vec<dim> &q) {
  Basis<dim> basis;
  basis << q, products(q);
  return basis;
}

template <std::size_t dim>
std::array<Pack, n_terms<static_cast<int>(dim)>> quadratic_basis(const std::array<Pack, dim> &q) {
  std::array<Pack, n_terms<static_cast<int>(dim)>> basis;
  const auto of_degree_two = products(q);
  std::copy(q.begin(), q.end(), basis.begin());
  std::copy(of_degree_two.begin(), of_degree_two.end(), basis.begin() + dim);
  return basis;
}

/// Coefficients of h n . grad(f) at q in the basis.
template <int dim> Basis<dim> normal_derivative(const Vec<dim> &q, const Vec<dim> &n) {
  Basis<dim> basis;
  for (int a = 0, t = dim; a < dim; ++a) {
    basis[a] = n[a];
    basis[t++] = 2 * q[a] * n[a];
    for (int b = a + 1; b < dim; ++b)
      basis[t++] = q[a] * n[b] + q[b] * n[a];
  }
  return basis;
}

/// Functional of the derivative along direction a, and of the Laplacian.
template <int dim> Basis<dim> derivative_functional(int a, double h) {
  return 1 / h * Basis<dim>::Unit(a);
}
template <int dim> Basis<dim> laplacian_functional(double h) {
  Basis<dim> functional = Basis<dim>::Zero();
  for (int a = 0, t = dim; a < dim; t += dim - a++)
    functional[t] = 2 / (h * h);
  return functional;
}

/// The distinct entries of P P^T: monomials of degree two to four, 12 in the plane and 31 in space,
/// each written as one product of two coordinates times another, or times one coordinate.
/// `Number` is a double, or a Pack for the monomials of eight points.
template <int dim, class Number = double> class Monomials {
public:
  using Place = std::conditional_t<std::is_same_v<Number, double>, Vec<dim>, PackVec<dim>>;
  static constexpr int cubics = dim == 2 ? 4 : 10, quartics = dim == 2 ? 5 : 15;
  static constexpr int count = n_products<dim> + cubics + quartics;

  /// Adds w times every monomial at q to `sum`.
  static void add(const Place &q, const Number &w, std::array<Number, count> &sum) {
    const auto at_q = products(q);
    std::array<Number, n_products<dim>> p, weighted; // numbers of their own: registers, no memory
    for (int k = 0; k < n_products<dim>; ++k) {
      p[k] = at_q[k];
      weighted[k] = w * p[k];
    }
    add_products(weighted, sum, std::make_index_sequence<n_products<dim>>());
    add_cubics(q, weighted, sum, std::make_index_sequence<cubics>());
    add_quartics(p, weighted, sum, std::make_index_sequence<quartics>());
  }
  /// Number of the monomial in row r and column c of P P^T.
  static constexpr int of(int r, int c) {
    Exponents sum = exponents_of_term(r);
    const Exponents other = exponents_of_term(c);
    for (int d = 0; d < dim; ++d)
      sum[d] += other[d];
    return number_of(sum);
  }

private:
  using Exponents = std::array<int, dim>;
  struct Factors {
    int weighted = 0; // number of a product
    int other = 0;    // of a coordinate (cubics) or of another product (quartics)
  };

  static constexpr int product_of(int a, int b) {
    return a * dim - a * (a - 1) / 2 + b - a; // a <= b
  }
  static constexpr Exponents exponents_of_term(int term) {
    Exponents e{};
    if (term < dim)
      ++e[term];
    for (int a = 0; a < dim; ++a)
      for (int b = a; b < dim; ++b)
        if (term == dim + product_of(a, b)) {
          ++e[a];
          ++e[b];
        }
    return e;
  }
  // Monomials of one degree in the order of their sorted coordinates: xxx, xxy, xyy, yyy.
  static constexpr int number_of(const Exponents &wanted) {
    int degree = 0;
    for (const int e : wanted)
      degree += e;
    if (degree == 2) {
      int a = 0;
      while (wanted[a] == 0)
        ++a;
      int b = dim - 1;
      while (wanted[b] == 0)
        --b;
      return product_of(a, b);
    }
    const int total = degree == 3 ? cubics : quartics;
    for (int k = 0; k < total; ++k)
      if (exponents(degree, k) == wanted)
        return n_products<dim> + (degree == 3 ? 0 : cubics) + k;
    return -1;
  }
  static constexpr Exponents exponents(int degree, int k) {
    Exponents e{};
    for (e[0] = degree; e[0] >= 0; --e[0]) {
      if constexpr (dim == 2) {
        e[1] = degree - e[0];
        if (k-- == 0)
          return e;
      } else {
        for (e[1] = degree - e[0]; e[1] >= 0; --e[1]) {
          e[2] = degree - e[0] - e[1];
          if (k-- == 0)
            return e;
        }
      }
    }
    return e;
  }
  // The first coordinate that occurs twice gives the weighted product; x y z has none.
  static constexpr Factors factors(int degree, int k) {
    Exponents e = exponents(degree, k);
    int a = 0;
    while (a < dim && e[a] < 2)
      ++a;
    Factors f;
    if (a < dim) {
      e[a] -= 2;
      f.weighted = product_of(a, a);
    } else {
      --e[0];
      --e[1];
      f.weighted = product_of(0, 1);
    }
    if (degree == 4)
      f.other = number_of(e);
    else
      while (e[f.other] == 0)
        ++f.other;
    return f;
  }

  template <std::size_t... k>
  static void add_products(const std::array<Number, n_products<dim>> &weighted,
                           std::array<Number, count> &sum, std::index_sequence<k...>) {
    ((sum[k] += weighted[k]), ...);
  }
  template <std::size_t... k>
  static void add_cubics(const Place &q, const std::array<Number, n_products<dim>> &weighted,
                         std::array<Number, count> &sum, std::index_sequence<k...>) {
    ((sum[n_products<dim> + k] +=
      weighted[constant<factors(3, k).weighted>] * q[constant<factors(3, k).other>]),
     ...);
  }
  template <std::size_t... k>
  static void add_quartics(const std::array<Number, n_products<dim>> &p,
                           const std::array<Number, n_products<dim>> &weighted,
                           std::array<Number, count> &sum, std::index_sequence<k...>) {
    ((sum[n_products<dim> + cubics + k] +=
      weighted[constant<factors(4, k).weighted>] * p[constant<factors(4, k).other>]),
     ...);
  }
  template <int value> static constexpr int constant = value;
};

/// Cholesky factors of a small matrix, or of those of eight points. The diagonal is kept inverted.
template <int n, class Number> class Cholesky {
public:
  using Vector = std::array<Number, n>;

  /// By row and column, the lower triangle alone.
  std::array<Vector, n> lower{};

  /// Factorises in place; false, per point, when the matrix is not positive definite.
  auto factorise() {
    auto is_definite = Number{} == Number{};
    for (int k = 0; k < n; ++k) {
      for (int m = 0; m < k; ++m)
        lower[k][k] -= lower[k][m] * lower[k][m];
      is_definite = is_definite & (lower[k][k] > 0);
      lower[k][k] = 1.0 / square_root(lower[k][k]);
      for (int r = k + 1; r < n; ++r) {
        for (int m = 0; m < k; ++m)
          lower[r][k] -= lower[r][m] * lower[k][m];
        lower[r][k] *= lower[k][k];
      }
    }
    return is_definite;
  }
  template <class V> void solve(V &x) const {
    for (int k = 0; k < n; ++k) {
      for (int m = 0; m < k; ++m)
        x[k] -= lower[k][m] * x[m];
      x[k] *= lower[k][k];
    }
    for (int k = n - 1; k >= 0; --k) {
      for (int m = k + 1; m < n; ++m)
        x[k] -= lower[m][k] * x[m];
      x[k] *= lower[k][k];
    }
  }
};

/// Moment matrix of the quadratic fit. Neighbours enter through the sums of monomials alone, since
/// P P^T holds no others.
template <int dim, class Number = double> class MomentFit {
public:
  /// Value row of a neighbour at q.
  void add_neighbour(const typename Monomials<dim, Number>::Place &q, const Number &w) {
    Monomials<dim, Number>::add(q, w, sum_);
  }

protected:
  static constexpr int n = n_terms<dim>;

  void fill_lower() { fill_lower(std::make_index_sequence<n * n>()); }

  Cholesky<n, Number> cholesky_;

private:
  template <std::size_t... k> void fill_lower(std::index_sequence<k...>) {
    ((cholesky_.lower[k % n][k / n] =
          k % n < k / n ? Number{} : sum_[number<Monomials<dim>::of(k % n, k / n)>]),
     ...);
  }
  template <int value> static constexpr int number = value;

  std::array<Number, Monomials<dim>::count> sum_{};
};

/// The fit of one point, whose rows may be other than values too.
template <int dim> class QuadraticFit : public MomentFit<dim> {
public:
  void add_row(const Basis<dim> &row, double w) { rows_.noalias() += (w * row) * row.transpose(); }
  /// Cholesky factorisation; false when the moment matrix is not positive definite.
  bool factorise() {
    this->fill_lower();
    for (int c = 0; c < this->n; ++c)
      for (int r = c; r < this->n; ++r)
        this->cholesky_.lower[r][c] += rows_(r, c);
    return this->cholesky_.factorise();
  }
  /// A^-1 functional.
  Basis<dim> solve(Basis<dim> x) const {
    this->cholesky_.solve(x);
    return x;
  }

private:
  Eigen::Matrix<double, n_terms<dim>, n_terms<dim>> rows_ =
      Eigen::Matrix<double, n_terms<dim>, n_terms<dim>>::Zero();
};

/// The fits of eight points that no wall adds to.
template <int dim> class PackedFit : public MomentFit<dim, Pack> {
public:
  using Functional = std::array<Pack, n_terms<dim>>;

  PackMask factorise() {
    this->fill_lower();
    return this->cholesky_.factorise();
  }
  /// A^-1 functional, the same for all points.
  Functional solve(const Basis<dim> &functional) const {
    Functional x;
    for (int k = 0; k < this->n; ++k)
      x[k] = Pack{} + functional[k];
    this->cholesky_.solve(x);
    return x;
  }
};

/// Second moment of the linear fit, in scaled coordinates q.
template <int dim> class LinearFit {
public:
  void add(const Vec<dim> &q, double w) { moment_.noalias() += (w * q) * q.transpose(); }
  /// Inverse moment, or zero when the cloud does not determine a gradient.
  Mat<dim> inverse() const {
    const double det = moment_.determinant(), trace = moment_.trace();
    const double limit = 1e-4 * trace * trace * (dim == 2 ? 1 : 0.1 * trace);
    if (!(det > limit))
      return Mat<dim>::Zero();
    return moment_.inverse();
  }

  /// Inverse moment that never amplifies more than ten times beyond the best determined direction:
  /// linear fields are exact where the neighbours spread in all directions, and the gradient
  /// across a filament or a sheet fades instead of growing.
  Mat<dim> limited_inverse() const {
    const double trace = moment_.trace();
    if (!(trace > 0))
      return Mat<dim>::Zero();
    Eigen::SelfAdjointEigenSolver<Mat<dim>> eigen;
    if constexpr (dim == 2)
      eigen.compute(moment_);
    else
      eigen.computeDirect(moment_); // closed form; good to 1e-8, enough where something is limited
    const double largest = eigen.eigenvalues()[dim - 1], floor = 0.1 * largest;
    if (dim == 3 && eigen.eigenvalues()[0] >= floor)
      return moment_.inverse();
    Vec<dim> inverse;
    for (int k = 0; k < dim; ++k) {
      const double lambda = std::max(eigen.eigenvalues()[k], 0.0);
      inverse[k] = lambda >= floor ? 1 / lambda : lambda / (floor * floor);
    }
    return eigen.eigenvectors() * inverse.asDiagonal() * eigen.eigenvectors().transpose();
  }

private:
  Mat<dim> moment_ = Mat<dim>::Zero();
};

} // namespace sluice::fluid
