// SPDX-License-Identifier: MIT
// Hyperelastic laws in closed form: strain energy, Kirchhoff stress and its tangent.
//
// In two dimensions the state is true plane strain: F33 = 1, so the out-of-plane stretch enters no
// sum below and the two-dimensional formulas are those of three dimensions with nothing dropped.
//
// Both laws have a spatial (Lie derivative) tangent of one shape, with a symmetric "metric" A:
//   J c_ijkl = lambda A_ij A_kl + m (A_ik A_jl + A_il A_jk)
//   neo-Hookean             A = I,         m = mu - lambda ln J
//   St. Venant-Kirchhoff    A = b = F F^T, m = mu
// so one element kernel serves both, without a fourth-order tensor.
// Source: Bonet and Wood, Nonlinear Continuum Mechanics for Finite Element Analysis, 2nd ed.
// (2008), sections 6.4.3 (neo-Hookean) and 6.3.1 (St. Venant-Kirchhoff); tau = J sigma.
#pragma once

#include "bridge/base/check.hpp"
#include "bridge/base/vec.hpp"

#include <Eigen/Dense>

#include <cmath>
#include <string_view>
#include <variant>

namespace sluice::solid {

/// Kirchhoff stress and tangent at one point; the tangent in the shape of the file head.
template <int dim> struct Response {
  Mat<dim> stress;     ///< tau [Pa]
  Mat<dim> metric;     ///< A [1]
  double volumetric{}; ///< lambda [Pa]
  double shear{};      ///< m [Pa]

  /// Change of tau [Pa] without its rotation for a symmetric gradient `rate`: (J c) : rate.
  Mat<dim> tangent_times(const Mat<dim> &rate) const {
    const Mat<dim> symmetric = 0.5 * (rate + rate.transpose());
    return volumetric * metric.cwiseProduct(symmetric).sum() * metric +
           2 * shear * metric * symmetric * metric;
  }
};

/// Lame's constants [Pa] of small strains.
struct Lame {
  double lambda = 0;
  double mu = 0;
};

/// From Young's modulus [Pa] and Poisson's ratio in (-1, 0.5).
inline Lame lame_constants(double youngs_modulus, double poisson_ratio) {
  check(youngs_modulus > 0, "solid: Young's modulus is {} Pa; it must be positive", youngs_modulus);
  check(poisson_ratio > -1 && poisson_ratio < 0.5,
        "solid: Poisson's ratio is {}; it must lie between -1 and 0.5", poisson_ratio);
  const double mu = youngs_modulus / (2 * (1 + poisson_ratio));
  return {2 * mu * poisson_ratio / (1 - 2 * poisson_ratio), mu};
}

/// W = mu/2 (tr b - 3) - mu ln J + lambda/2 (ln J)^2;  tau = mu (b - I) + lambda ln J I.
struct NeoHookean {
  Lame lame;

  /// Strain energy per reference volume [J/m^3].
  template <int dim> double energy(const Mat<dim> &F) const {
    const double log_j = std::log(F.determinant());
    return 0.5 * lame.mu * (F.squaredNorm() - dim) - lame.mu * log_j +
           0.5 * lame.lambda * log_j * log_j;
  }
  /// Needs det F > 0.
  template <int dim> Response<dim> response(const Mat<dim> &F, double det_f) const {
    const Mat<dim> one = Mat<dim>::Identity();
    const double log_j = std::log(det_f);
    return {lame.mu * (F * F.transpose() - one) + lame.lambda * log_j * one, one, lame.lambda,
            lame.mu - lame.lambda * log_j};
  }
};

/// W = lambda/2 (tr E)^2 + mu E:E;  S = lambda tr E I + 2 mu E;  tau = F S F^T.
struct SaintVenantKirchhoff {
  Lame lame;

  /// Strain energy per reference volume [J/m^3].
  template <int dim> double energy(const Mat<dim> &F) const {
    const Mat<dim> E = green_lagrange_strain(F);
    return 0.5 * lame.lambda * E.trace() * E.trace() + lame.mu * E.squaredNorm();
  }
  template <int dim> Response<dim> response(const Mat<dim> &F, double /*det_f*/) const {
    const Mat<dim> E = green_lagrange_strain(F);
    const Mat<dim> S = lame.lambda * E.trace() * Mat<dim>::Identity() + 2 * lame.mu * E;
    return {F * S * F.transpose(), F * F.transpose(), lame.lambda, lame.mu};
  }

private:
  template <int dim> static Mat<dim> green_lagrange_strain(const Mat<dim> &F) {
    return 0.5 * (F.transpose() * F - Mat<dim>::Identity());
  }
};

/// Visited once per sweep over the elements, never per point.
using Material = std::variant<NeoHookean, SaintVenantKirchhoff>;

/// `law` is "neo-hookean" or "st-venant-kirchhoff".
inline Material make_material(std::string_view law, double youngs_modulus, double poisson_ratio) {
  const Lame lame = lame_constants(youngs_modulus, poisson_ratio);
  if (law == "neo-hookean")
    return NeoHookean{lame};
  check(law == "st-venant-kirchhoff",
        "solid: unknown material '{}'; give neo-hookean or st-venant-kirchhoff", law);
  return SaintVenantKirchhoff{lame};
}

} // namespace sluice::solid
