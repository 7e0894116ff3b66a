// SPDX-License-Identifier: MIT
// The only small-vector type of the project. Fixed size, on the stack, no allocation.
#pragma once

#include <Eigen/Core>
#include <concepts>

namespace sluice {

/// A point or vector in `dim` dimensions [SI units, stated where it is used].
template <int dim> using Vec = Eigen::Matrix<double, dim, 1>;
template <int dim> using Mat = Eigen::Matrix<double, dim, dim>;

/// z-component of the cross product of two plane vectors.
inline double cross(const Vec<2> &a, const Vec<2> &b) { return a.x() * b.y() - a.y() * b.x(); }

/// Cross product of two vectors in space. Of nothing but vectors: an expression in the plane is for
/// the function above.
template <class Vector>
requires std::same_as<Vector, Vec<3>> Vec<3> cross(const Vector &a, const Vector &b) {
  return {a.y() * b.z() - a.z() * b.y(), a.z() * b.x() - a.x() * b.z(),
          a.x() * b.y() - a.y() * b.x()};
}

/// `v` turned by 90 degrees counter-clockwise.
inline Vec<2> rotated_left(const Vec<2> &v) { return {-v.y(), v.x()}; }

} // namespace sluice
