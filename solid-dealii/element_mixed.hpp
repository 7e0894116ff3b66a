// SPDX-License-Identifier: MIT
// Locking-free element for nu up to 0.4999: displacement of second order, volume change theta and
// pressure p in the discontinuous linear functions phi_i of position, W = W_iso(F) + U(theta).
//
//   theta = phi_i t_i, t_i = int phi_i J dV;   p = phi_i p_i, p_i = int phi_i U'(theta) dV
//   f_a = int (tau_iso + J p I) g_a dV
//   K   = int [..c_iso.. + J p (I (x) I - 2 II) + tau] dV + D^T H D,
//   D_i = int phi_i J g dV,   H_ij = int U''(theta) phi_i phi_j dV
//
// with phi orthonormal over the element, so that theta and p follow from the displacement without
// any unknown of their own: the three-field principle with two fields eliminated exactly.
// Source: J. C. Simo, R. L. Taylor, K. S. Pister, Comput. Methods Appl. Mech. Engrg. 51 (1985) 177;
// stability of the pair: D. Boffi, F. Brezzi, M. Fortin, Mixed Finite Element Methods (2013), 8.6.
#pragma once

#include "solid-dealii/element.hpp"

#include <span>

namespace sluice::solid {

/// Pressure functions of one element.
template <int dim> inline constexpr int n_pressures = dim + 1;

/// Values of phi at the points of one element, point by point.
template <int dim>
using PressureBasis = Eigen::Map<const Eigen::Matrix<double, n_pressures<dim>, Eigen::Dynamic>>;

/// Volume change and pressure of one element at its points.
template <int dim> struct VolumeField {
  Eigen::Matrix<double, 1, Eigen::Dynamic, Eigen::RowMajor, 1, max_points<dim>> theta;    ///< [1]
  Eigen::Matrix<double, 1, Eigen::Dynamic, Eigen::RowMajor, 1, max_points<dim>> pressure; ///< [Pa]
};

/// `det_f` and `weights` [m^dim] at the points; theta must be positive for `pressure` to be valid.
template <int dim, class Row>
VolumeField<dim> volume_field(const PressureBasis<dim> &phi, const Row &det_f, const Row &weights,
                              const Volume &volume) {
  VolumeField<dim> field;
  const Vec<n_pressures<dim>> t = phi * weights.cwiseProduct(det_f).transpose();
  field.theta = t.transpose() * phi;
  const Vec<n_pressures<dim>> p =
      phi * (weights.array() *
             field.theta.array().unaryExpr([&](double theta) { return volume.pressure(theta); }))
                .matrix()
                .transpose();
  field.pressure = p.transpose() * phi;
  return field;
}

/// Adds D^T H D; `divergence` is D.
template <int dim, int columns>
void add_volume_stiffness(const Eigen::Matrix<double, n_pressures<dim>, dim * columns> &divergence,
                          const Mat<n_pressures<dim>> &stiffness,
                          ElementSystem<dim, columns> &element) {
  for (int k = 0; k < dim * columns; ++k)
    element.tangent.col(k).noalias() +=
        divergence.transpose() * (stiffness * divergence.col(k)).eval();
}

} // namespace sluice::solid
