// SPDX-License-Identifier: MIT
// The element kernel: internal force and tangent of one element, total Lagrangian.
//
//   F = I + sum_a u_a (x) G_a,   f_a = sum_q w_q tau g_a,   g_a = F^-T G_a
//   K_ab = sum_q w_q [ g_a . (J c) . g_b + (g_a . tau g_b) I ]
//
// in one of the two shapes of J c that a material answers with (response.hpp).
// A column a is a node or an internal (incompatible) mode; G_a is its gradient in the reference
// configuration, cached by Discretisation. Modes are condensed: they never leave the element.
//
// Source of the modes: E. L. Wilson, R. L. Taylor, W. P. Doherty, J. Ghaboussi, Incompatible
// displacement models (1973); the gradients taken at the element's centre, so that the patch test
// holds on distorted elements: R. L. Taylor, P. J. Beresford, E. L. Wilson, IJNME 10 (1976)
// 1211-1219; the same gradients in F at finite strain: J. C. Simo, F. Armero, IJNME 33 (1992)
// 1413-1449. Not done here: the modified modes that cure hourglassing under strong compression.
#pragma once

#include "solid-dealii/material.hpp"

#include <Eigen/Dense>

#include <algorithm>
#include <array>
#include <limits>

namespace sluice::solid {

/// q2_p1 is q2 with volume change and pressure in a discontinuous linear space (element_mixed.hpp).
enum class ElementKind { incompatible_modes, q1, q2, q3, q2_p1 };

/// `name` is the key's value in a case file.
inline ElementKind element_kind(std::string_view name) {
  constexpr std::array<std::pair<std::string_view, ElementKind>, 5> kinds{
      {{"incompatible-modes", ElementKind::incompatible_modes},
       {"q1", ElementKind::q1},
       {"q2", ElementKind::q2},
       {"q3", ElementKind::q3},
       {"q2-p1", ElementKind::q2_p1}}};
  for (const auto &[known, kind] : kinds)
    if (name == known)
      return kind;
  fail("solid: unknown element '{}'; give incompatible-modes, q1, q2, q3 or q2-p1", name);
}

inline int degree_of(ElementKind kind) {
  return kind == ElementKind::q3                                 ? 3
         : kind == ElementKind::q2 || kind == ElementKind::q2_p1 ? 2
                                                                 : 1;
}

/// Calls action.operator()<nodes, modes>() with the sizes of the element as constants.
template <int dim, class Action> void with_element(ElementKind kind, Action &&action) {
  constexpr int corners = 1 << dim;
  switch (kind) {
  case ElementKind::incompatible_modes:
    return action.template operator()<corners, dim>();
  case ElementKind::q1:
    return action.template operator()<corners, 0>();
  case ElementKind::q2:
  case ElementKind::q2_p1:
    return action.template operator() < dim == 2 ? 9 : 27, 0 > ();
  case ElementKind::q3:
    if constexpr (dim == 2)
      return action.template operator()<16, 0>();
    else
      fail("solid: the element q3 exists in two dimensions only; use q2 or incompatible-modes");
  }
}

/// Quadrature points of the largest element.
template <int dim> inline constexpr int max_points = dim == 2 ? 16 : 27;

/// One column per node or mode.
template <int dim, int columns> using Columns = Eigen::Matrix<double, dim, columns>;

/// Internal force [N] and tangent [N/m] of one element, component by component, column by column
/// (2-D: per metre of depth); `min_det` is the smallest det F of its points.
template <int dim, int columns> struct ElementSystem {
  static constexpr int size = dim * columns;
  Columns<dim, columns> force = Columns<dim, columns>::Zero();
  Eigen::Matrix<double, size, size> tangent = Eigen::Matrix<double, size, size>::Zero();
  double min_det = std::numeric_limits<double>::infinity();
};

template <int dim, int columns>
Mat<dim> deformation_gradient(const Columns<dim, columns> &displacement,
                              const Columns<dim, columns> &gradient) {
  return Mat<dim>::Identity() + displacement * gradient.transpose();
}

/// Adds the tangent of one point to the lower block triangle.
template <int dim, int columns>
void add_tangent(const MetricResponse<dim> &r, const Columns<dim, columns> &g, double weight,
                 ElementSystem<dim, columns> &element) {
  const Columns<dim, columns> h = r.metric * g;
  const Columns<dim, columns> t = weight * (r.carried * g);
  const Columns<dim, columns> lh = weight * r.volumetric * h;
  const Columns<dim, columns> mh = weight * r.shear * h;
  for (int b = 0; b < columns; ++b)
    for (int a = b; a < columns; ++a) {
      Mat<dim> block = lh.col(a) * h.col(b).transpose() + mh.col(b) * h.col(a).transpose() +
                       g.col(a).dot(mh.col(b)) * r.metric;
      block.diagonal().array() += g.col(a).dot(t.col(b));
      element.tangent.template block<dim, dim>(dim * a, dim * b) += block;
    }
}

/// Strain of the columns: one column per component, engineering shear.
template <int dim, int columns>
Eigen::Matrix<double, voigt_size<dim>, dim * columns>
strain_operator(const Columns<dim, columns> &g) {
  Eigen::Matrix<double, voigt_size<dim>, dim * columns> B;
  B.setZero();
  for (int a = 0; a < columns; ++a)
    for (int k = 0; k < voigt_size<dim>; ++k) {
      const int i = voigt_row<dim>(k), j = voigt_column<dim>(k);
      B(k, dim * a + i) = g(j, a);
      B(k, dim * a + j) = g(i, a);
    }
  return B;
}

template <int dim, int columns>
void add_tangent(const VoigtResponse<dim> &r, const Columns<dim, columns> &g, double weight,
                 ElementSystem<dim, columns> &element) {
  const auto B = strain_operator<dim, columns>(g);
  Eigen::Matrix<double, voigt_size<dim>, dim * columns> CB;
  for (int k = 0; k < dim * columns; ++k) // by columns: one product of all unrolls without limit
    CB.col(k).noalias() = weight * (r.tangent * B.col(k));
  for (int k = 0; k < dim * columns; ++k)
    element.tangent.col(k).noalias() += B.transpose() * CB.col(k);
  const Columns<dim, columns> t = weight * (r.carried * g);
  for (int b = 0; b < columns; ++b)
    for (int a = b; a < columns; ++a)
      element.tangent.template block<dim, dim>(dim * a, dim * b).diagonal().array() +=
          g.col(a).dot(t.col(b));
}

/// Adds one quadrature point. `push` G are the gradients that the response acts on.
template <int dim, int columns, class Response>
void add_point(const Response &response, const Columns<dim, columns> &gradient, double weight,
               bool with_tangent, ElementSystem<dim, columns> &element) {
  const Columns<dim, columns> g = response.push * gradient;
  element.force += weight * (response.stress * g);
  if (with_tangent)
    add_tangent<dim, columns>(response, g, weight, element);
}

/// Fills the upper block triangle from the lower one: dead loads and hyperelasticity are symmetric.
template <int size> void mirror(Eigen::Matrix<double, size, size> &tangent) {
  tangent.template triangularView<Eigen::StrictlyUpper>() =
      tangent.transpose().template triangularView<Eigen::StrictlyUpper>();
}

/// Static condensation of the last `modes` columns: the element as its nodes see it, and
/// `recovery` = K_mm^-1 [K_mu | f_m], from which the modes follow as dm = -recovery (du; 1).
template <int dim, int nodes, int modes> struct Condensed {
  static constexpr int n = dim * nodes;
  static constexpr int m = dim * modes;
  Eigen::Matrix<double, n, 1> force;
  Eigen::Matrix<double, n, n> tangent;
  Eigen::Matrix<double, m, n + 1> recovery;
};

template <int dim, int nodes, int modes>
Condensed<dim, nodes, modes> condense(const ElementSystem<dim, nodes + modes> &element) {
  using Result = Condensed<dim, nodes, modes>;
  constexpr int n = Result::n, m = Result::m;
  const Eigen::Matrix<double, n + m, 1> force = element.force.reshaped();
  Result result;
  result.force = force.template head<n>();
  result.tangent = element.tangent.template topLeftCorner<n, n>();
  if constexpr (m > 0) {
    Eigen::Matrix<double, m, n + 1> right;
    right << element.tangent.template bottomLeftCorner<m, n>(), force.template tail<m>();
    result.recovery =
        element.tangent.template bottomRightCorner<m, m>().partialPivLu().solve(right);
    const auto coupling = element.tangent.template topRightCorner<n, m>();
    result.tangent -= coupling * result.recovery.template leftCols<n>();
    result.force -= coupling * result.recovery.template rightCols<1>();
  }
  return result;
}

} // namespace sluice::solid
