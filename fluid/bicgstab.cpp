// SPDX-License-Identifier: MIT
#include "fluid/bicgstab.hpp"

#include <cmath>

namespace sluice::fluid {
namespace {

template <class Body> void for_each_row(int n, Body &&body) {
  for_each_index(n, body, Work::light);
}

// One solve. Residual vectors are kept divided by `unit_`, the first residual's norm, so that the
// preconditioner's floats stay far from their limits. With NullSpace::constants every residual is
// projected along g = D^-1 1, which is the multiplier's column: r - g (1.r) / (1.g); the equations
// then hold for some multiplier, and updates of zero mean keep the mean of x.
class Solve {
public:
  Solve(const ScaledMatrix &matrix, std::span<const double> b, std::span<double> x,
        Preconditioner &preconditioner, const SolveOptions &options, KrylovMemory &memory)
      : matrix_(matrix), b_(b), x_(x), preconditioner_(preconditioner), options_(options),
        m_(memory), n_(matrix.rows()) {
    m_.resize(n_);
  }

  SolveResult run() {
    target_ = std::max(options_.relative_tolerance * norm_of_rhs(), options_.absolute_tolerance);
    if (is_singular())
      column_sum_ = sum(n_, [&](int i) { return matrix_.inverse_diagonal(i); });
    compute_residual();
    while (!done() && result_.iterations < options_.max_iterations) {
      start();
      while (iterate()) {
      }
      if (is_singular())
        remove_mean();
      compute_residual();
    }
    result_.converged = std::isfinite(result_.residual) && result_.residual <= target_;
    return result_;
  }

private:
  bool is_singular() const { return options_.null_space == NullSpace::constants; }
  bool done() const { return !(result_.residual > target_) || !std::isfinite(result_.residual); }
  double rms(double sum_of_squares) const { return std::sqrt(sum_of_squares / std::max(n_, 1)); }
  double norm_of_rhs() const {
    return rms(sum(n_, [&](int i) {
      const double c = b_[i] * matrix_.inverse_diagonal(i);
      return c * c;
    }));
  }

  // r = D^-1 (b - A x) and its norm.
  void compute_residual() {
    for_each_block(
        n_,
        [&](IndexRange range, int) {
          matrix_.multiply(x_.data(), range, [&](int i, double product) {
            m_.r[i] = b_[i] * matrix_.inverse_diagonal(i) - product;
          });
        },
        Work::light);
    if (is_singular())
      result_.multiplier = project(m_.r);
    result_.residual = rms(sum(n_, [&](int i) { return m_.r[i] * m_.r[i]; }));
  }

  // Removes the multiplier's part from a residual, and returns the multiplier.
  double project(std::vector<double> &r) const {
    const double multiplier = sum(n_, [&](int i) { return r[i]; }) / column_sum_;
    for_each_row(n_, [&](int i) { r[i] -= multiplier * matrix_.inverse_diagonal(i); });
    return multiplier;
  }

  void remove_mean() {
    const double mean = sum(n_, [&](int i) { return x_[i]; }) / n_;
    for_each_row(n_, [&](int i) { x_[i] -= mean; });
  }

  // Begins anew from the residual of the present x.
  void start() {
    since_start_ = 0;
    unit_ = result_.residual;
    rho_ = sum(n_, [&](int i) {
      m_.r[i] /= unit_;
      m_.r_shadow[i] = m_.p[i] = m_.r[i];
      return m_.r[i] * m_.r[i];
    });
  }

  // One iteration; false when the residual is small enough, the count is used up, or the recurrence
  // has broken down or become too long, after which the true residual decides how to go on.
  bool iterate() {
    ++result_.iterations;
    ++since_start_;
    precondition(m_.p, m_.p_hat);
    const double shadow_v = multiply(m_.p_hat, m_.v, m_.r_shadow)[0];
    const double alpha = rho_ / shadow_v;
    if (!std::isfinite(alpha))
      return false;
    if (is_small(subtract_v(alpha)))
      return advance_half(alpha);
    precondition(m_.r, m_.r_hat);
    const auto [t_s, t_t] = multiply(m_.r_hat, m_.t, m_.r);
    const double omega = t_s / t_t;
    if (!std::isfinite(omega))
      return advance_half(alpha);
    return advance(alpha, omega);
  }

  void precondition(const std::vector<double> &r, std::vector<float> &z) {
    preconditioner_.apply(r, z);
    if (!is_singular())
      return;
    const float mean = static_cast<float>(sum(n_, [&](int i) { return z[i]; }) / n_);
    for_each_row(n_, [&](int i) { z[i] -= mean; });
  }

  // product = D^-1 A z (projected); returns {product . other, product . product}.
  std::array<double, 2> multiply(const std::vector<float> &z, std::vector<double> &product,
                                 const std::vector<double> &other) {
    if (is_singular())
      return multiply_singular(z, product, other);
    return block_sums<2>(n_, [&](IndexRange range) {
      matrix_.multiply(z.data(), range, [&](int i, double value) { product[i] = value; });
      return dots(product, other, range);
    });
  }

  std::array<double, 2> multiply_singular(const std::vector<float> &z, std::vector<double> &product,
                                          const std::vector<double> &other) {
    for_each_block(
        n_,
        [&](IndexRange range, int) {
          matrix_.multiply(z.data(), range, [&](int i, double value) { product[i] = value; });
        },
        Work::light);
    project(product);
    return block_sums<2>(n_, [&](IndexRange range) { return dots(product, other, range); });
  }

  static std::array<double, 2> dots(const std::vector<double> &v, const std::vector<double> &w,
                                    IndexRange range) {
    double v_w = 0, v_v = 0;
    for (int i = range.begin; i < range.end; ++i) {
      v_w += v[i] * w[i];
      v_v += v[i] * v[i];
    }
    return {v_w, v_v};
  }

  // r -= alpha v; returns r . r.
  double subtract_v(double alpha) {
    return sum(n_, [&](int i) {
      m_.r[i] -= alpha * m_.v[i];
      return m_.r[i] * m_.r[i];
    });
  }

  bool is_small(double r_r) const { return rms(r_r) * unit_ <= 0.9 * target_; }

  bool advance_half(double alpha) {
    for_each_row(n_, [&](int i) { x_[i] += unit_ * alpha * m_.p_hat[i]; });
    return false;
  }

  bool advance(double alpha, double omega) {
    const auto [r_r, shadow_r] = block_sums<2>(n_, [&](IndexRange range) {
      for (int i = range.begin; i < range.end; ++i) {
        x_[i] += unit_ * (alpha * m_.p_hat[i] + omega * m_.r_hat[i]);
        m_.r[i] -= omega * m_.t[i];
      }
      return swapped(dots(m_.r, m_.r_shadow, range));
    });
    const double beta = shadow_r / rho_ * (alpha / omega);
    rho_ = shadow_r;
    const bool broken = !std::isfinite(beta) || beta == 0 || since_start_ == longest_recurrence;
    if (is_small(r_r) || broken || result_.iterations >= options_.max_iterations)
      return false;
    for_each_row(n_, [&](int i) { m_.p[i] = m_.r[i] + beta * (m_.p[i] - omega * m_.v[i]); });
    return true;
  }

  static std::array<double, 2> swapped(std::array<double, 2> pair) { return {pair[1], pair[0]}; }

  const ScaledMatrix &matrix_;
  std::span<const double> b_;
  std::span<double> x_;
  Preconditioner &preconditioner_;
  const SolveOptions &options_;
  KrylovMemory &m_;
  // A recurrence that has not converged by then has lost its shadow residual and would not: ten
  // times the usual count.
  static constexpr int longest_recurrence = 40;

  int n_;
  int since_start_ = 0;
  double target_ = 0, unit_ = 1, rho_ = 0, column_sum_ = 0;
  SolveResult result_;
};

} // namespace

void KrylovMemory::resize(int n) {
  for (auto *vector : {&r, &r_shadow, &p, &v, &t})
    vector->resize(n);
  for (auto *vector : {&p_hat, &r_hat})
    vector->resize(n);
}

SolveResult bicgstab(const ScaledMatrix &matrix, std::span<const double> b, std::span<double> x,
                     Preconditioner &preconditioner, const SolveOptions &options,
                     KrylovMemory &memory) {
  return Solve(matrix, b, x, preconditioner, options, memory).run();
}

} // namespace sluice::fluid
