// SPDX-License-Identifier: MIT
// What a material answers at one point: stress and tangent, in one of two shapes.
//
// The force of a column (node or mode) with reference gradient G is w tau g, g = push G, and its
// stiffness w [ g . (J c) . g + (g . carried g) I ]. At finite strain push = F^-T and carried =
// tau; small-strain elasticity has push = I and carries nothing.
#pragma once

#include "bridge/base/vec.hpp"

namespace sluice::solid {

template <int dim> inline constexpr int voigt_size = dim *(dim + 1) / 2;

/// Tangent of the shape J c_ijkl = volumetric A_ij A_kl + shear (A_ik A_jl + A_il A_jk): cheap, and
/// enough for St. Venant-Kirchhoff, the coupled neo-Hookean law and small strain.
template <int dim> struct MetricResponse {
  Mat<dim> push;       ///< [1]
  Mat<dim> stress;     ///< tau [Pa]
  Mat<dim> carried;    ///< [Pa]
  Mat<dim> metric;     ///< A [1]
  double volumetric{}; ///< [Pa]
  double shear{};      ///< [Pa]

  /// Change of tau [Pa] without its rotation for a symmetric gradient `rate`: (J c) : rate.
  Mat<dim> tangent_times(const Mat<dim> &rate) const {
    const Mat<dim> symmetric = 0.5 * (rate + rate.transpose());
    return volumetric * metric.cwiseProduct(symmetric).sum() * metric +
           2 * shear * metric * symmetric * metric;
  }
  void scale(double factor) {
    stress *= factor;
    carried *= factor;
    volumetric *= factor;
    shear *= factor;
  }
};

/// Any symmetric tangent as a matrix over xx yy zz xy xz yz (plane: xx yy xy), engineering shear.
template <int dim> struct VoigtResponse {
  static constexpr int n = voigt_size<dim>;
  Mat<dim> push;                       ///< [1]
  Mat<dim> stress;                     ///< tau [Pa]
  Mat<dim> carried;                    ///< [Pa]
  Eigen::Matrix<double, n, n> tangent; ///< J c [Pa]

  Mat<dim> tangent_times(const Mat<dim> &rate) const;
  void scale(double factor) {
    stress *= factor;
    carried *= factor;
    tangent *= factor;
  }
};

/// Row and column of Voigt component `k`.
template <int dim> constexpr int voigt_row(int k) {
  return k < dim ? k : (dim == 2 || k < 5 ? 0 : 1);
}
template <int dim> constexpr int voigt_column(int k) {
  return k < dim ? k : (dim == 2 || k == 3 ? 1 : 2);
}

/// A symmetric tensor as a column of its components, shear once.
template <int dim> Eigen::Matrix<double, voigt_size<dim>, 1> to_voigt(const Mat<dim> &tensor) {
  Eigen::Matrix<double, voigt_size<dim>, 1> v;
  for (int k = 0; k < voigt_size<dim>; ++k)
    v[k] = tensor(voigt_row<dim>(k), voigt_column<dim>(k));
  return v;
}

template <int dim> Mat<dim> from_voigt(const Eigen::Matrix<double, voigt_size<dim>, 1> &v) {
  Mat<dim> tensor;
  for (int k = 0; k < voigt_size<dim>; ++k)
    tensor(voigt_row<dim>(k), voigt_column<dim>(k)) =
        tensor(voigt_column<dim>(k), voigt_row<dim>(k)) = v[k];
  return tensor;
}

template <int dim> Mat<dim> VoigtResponse<dim>::tangent_times(const Mat<dim> &rate) const {
  Eigen::Matrix<double, n, 1> strain = to_voigt<dim>(0.5 * (rate + rate.transpose()));
  strain.template tail<n - dim>() *= 2; // engineering shear
  return from_voigt<dim>(tangent * strain);
}

/// The products a_ik b_jl made symmetric in ij, kl, as a Voigt matrix: (a (.) b)_ijkl =
/// (a_ik b_jl + a_il b_jk) / 2.
inline Eigen::Matrix<double, 6, 6> symmetric_product(const Mat<3> &a, const Mat<3> &b) {
  Eigen::Matrix<double, 6, 6> m;
  for (int p = 0; p < 6; ++p)
    for (int q = 0; q < 6; ++q) {
      const int i = voigt_row<3>(p), j = voigt_column<3>(p), k = voigt_row<3>(q),
                l = voigt_column<3>(q);
      m(p, q) = 0.5 * (a(i, k) * b(j, l) + a(i, l) * b(j, k));
    }
  return m;
}

/// A closed form as a matrix.
inline VoigtResponse<3> to_voigt(const MetricResponse<3> &r) {
  const Eigen::Matrix<double, 6, 1> a = to_voigt<3>(r.metric);
  return {r.push, r.stress, r.carried,
          r.volumetric * a * a.transpose() + 2 * r.shear * symmetric_product(r.metric, r.metric)};
}
inline const VoigtResponse<3> &to_voigt(const VoigtResponse<3> &r) { return r; }

/// The part in the plane of a response whose third direction does not deform.
inline VoigtResponse<2> in_plane(const VoigtResponse<3> &r) {
  constexpr int at[3] = {0, 1, 3};
  VoigtResponse<2> p{r.push.topLeftCorner<2, 2>(),
                     r.stress.topLeftCorner<2, 2>(),
                     r.carried.topLeftCorner<2, 2>(),
                     {}};
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j)
      p.tangent(i, j) = r.tangent(at[i], at[j]);
  return p;
}

/// A plane deformation as one of space, with `thickness` the stretch out of the plane.
inline Mat<3> in_space(const Mat<2> &F, double thickness = 1) {
  Mat<3> whole = Mat<3>::Identity();
  whole.topLeftCorner<2, 2>() = F;
  whole(2, 2) = thickness;
  return whole;
}
inline const Mat<3> &in_space(const Mat<3> &F) { return F; }

} // namespace sluice::solid
