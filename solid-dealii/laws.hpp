// SPDX-License-Identifier: MIT
// Elastic laws of one term: small strain, St. Venant-Kirchhoff, compressible neo-Hookean.
//
// A law is one class: `energy` per reference volume as a template over the number type (the tests
// differentiate it automatically), and `respond`, stress and tangent in closed form. In two
// dimensions the state is true plane strain, F33 = 1: nothing is dropped from the formulas.
//
// Source: Bonet and Wood, Nonlinear Continuum Mechanics for Finite Element Analysis, 2nd ed.
// (2008), sections 6.4.3 (neo-Hookean) and 6.3.1 (St. Venant-Kirchhoff); tau = J sigma.
#pragma once

#include "bridge/base/check.hpp"
#include "solid-dealii/response.hpp"

#include <Eigen/Dense>

#include <cmath>

namespace sluice::solid {

/// Lame's constants [Pa] of small strains.
struct Lame {
  double lambda = 0;
  double mu = 0;
  double bulk() const { return lambda + 2 * mu / 3; }
};

/// From Young's modulus [Pa] and Poisson's ratio in (-1, 0.5).
inline Lame lame_constants(double youngs_modulus, double poisson_ratio) {
  check(youngs_modulus > 0, "solid: Young's modulus is {} Pa; it must be positive", youngs_modulus);
  check(poisson_ratio > -1 && poisson_ratio < 0.5,
        "solid: Poisson's ratio is {}; it must lie between -1 and 0.5", poisson_ratio);
  const double mu = youngs_modulus / (2 * (1 + poisson_ratio));
  return {2 * mu * poisson_ratio / (1 - 2 * poisson_ratio), mu};
}

/// tr b, tr b^2 and det F, for any number type.
template <class Number> struct Invariants {
  Number b, bb, j;
  explicit Invariants(const Eigen::Matrix<Number, 3, 3> &F) : b(0), bb(0), j(0) {
    for (int i = 0; i < 3; ++i)
      for (int k = 0; k < 3; ++k) {
        Number product = F(i, 0) * F(k, 0) + F(i, 1) * F(k, 1) + F(i, 2) * F(k, 2);
        if (i == k)
          b += product;
        bb += product * product;
      }
    for (int i = 0; i < 3; ++i)
      j +=
          F(0, i) * (F(1, (i + 1) % 3) * F(2, (i + 2) % 3) - F(1, (i + 2) % 3) * F(2, (i + 1) % 3));
  }
};

/// W = mu/2 (tr b - 3) - mu ln J + lambda/2 (ln J)^2;  tau = mu (b - I) + lambda ln J I.
struct NeoHookean {
  static constexpr const char *name = "neo-hookean";
  Lame lame;

  /// Strain energy per reference volume [J/m^3].
  template <class Number> Number energy(const Eigen::Matrix<Number, 3, 3> &F) const {
    using std::log;
    const Invariants<Number> i(F);
    const Number log_j = log(i.j);
    return 0.5 * lame.mu * (i.b - 3.0) - lame.mu * log_j + 0.5 * lame.lambda * log_j * log_j;
  }
  /// Needs det F > 0.
  template <int dim> MetricResponse<dim> respond(const Mat<dim> &F) const {
    const Mat<dim> one = Mat<dim>::Identity();
    const double log_j = std::log(F.determinant());
    const Mat<dim> tau = lame.mu * (F * F.transpose() - one) + lame.lambda * log_j * one;
    return {F.inverse().transpose(), tau, tau, one, lame.lambda, lame.mu - lame.lambda * log_j};
  }
};

/// W = lambda/2 (tr E)^2 + mu E:E;  S = lambda tr E I + 2 mu E;  tau = F S F^T.
struct SaintVenantKirchhoff {
  static constexpr const char *name = "st-venant-kirchhoff";
  Lame lame;

  /// Strain energy per reference volume [J/m^3].
  template <class Number> Number energy(const Eigen::Matrix<Number, 3, 3> &F) const {
    const Invariants<Number> i(F);
    const Number trace = 0.5 * (i.b - 3.0);
    return 0.5 * lame.lambda * trace * trace + 0.25 * lame.mu * (i.bb - 2.0 * i.b + 3.0);
  }
  template <int dim> MetricResponse<dim> respond(const Mat<dim> &F) const {
    const Mat<dim> E = 0.5 * (F.transpose() * F - Mat<dim>::Identity());
    const Mat<dim> S = lame.lambda * E.trace() * Mat<dim>::Identity() + 2 * lame.mu * E;
    const Mat<dim> tau = F * S * F.transpose();
    return {F.inverse().transpose(), tau, tau, F * F.transpose(), lame.lambda, lame.mu};
  }
};

/// Small strain, e = sym(F) - I: W = lambda/2 (tr e)^2 + mu e:e. Rotations of more than a few
/// degrees count as strain; for comparison with linear theory.
struct LinearElastic {
  static constexpr const char *name = "linear-elastic";
  Lame lame;

  /// Strain energy per reference volume [J/m^3].
  template <class Number> Number energy(const Eigen::Matrix<Number, 3, 3> &F) const {
    Number trace = -3.0, square = 0.0;
    for (int i = 0; i < 3; ++i) {
      trace += F(i, i);
      for (int k = 0; k < 3; ++k) {
        const Number e = 0.5 * (F(i, k) + F(k, i)) - (i == k ? 1.0 : 0.0);
        square += e * e;
      }
    }
    return 0.5 * lame.lambda * trace * trace + lame.mu * square;
  }
  template <int dim> MetricResponse<dim> respond(const Mat<dim> &F) const {
    const Mat<dim> one = Mat<dim>::Identity();
    const Mat<dim> e = 0.5 * (F + F.transpose()) - one;
    return {
        one,    lame.lambda * e.trace() * one + 2 * lame.mu * e, Mat<dim>::Zero(), one, lame.lambda,
        lame.mu};
  }
};

} // namespace sluice::solid
