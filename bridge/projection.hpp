// SPDX-License-Identifier: MIT
// The nearest point on one face and its shape function values. Pure functions.
// Source for the triangle: Ericson, Real-Time Collision Detection (2005), section 5.1.5.
#pragma once

#include "bridge/base/vec.hpp"

#include <array>
#include <span>

namespace sluice::bridge {

/// A point of the surface as weights of its face's nodes.
struct Projection {
  std::array<double, 4> weights{}; ///< of the face's nodes; they sum to one
  double distance_squared = 0;     ///< [m^2]
};

/// Nearest point of the segment a-b; dim 2 or 3.
template <int dim>
Projection project_on_segment(const Vec<dim> &p, const Vec<dim> &a, const Vec<dim> &b);
Projection project_on_triangle(const Vec<3> &p, std::span<const Vec<3>, 3> corners);
/// Nearest point of the bilinear patch through four corners, in order round the face.
Projection project_on_quadrilateral(const Vec<3> &p, std::span<const Vec<3>, 4> corners);

} // namespace sluice::bridge
