// SPDX-License-Identifier: MIT
// Projection map: every fluid node takes the value at the nearest point of the solid's surface,
// interpolated with the shape functions of the face that it lies on (segments in 2-D, triangles or
// bilinear quadrilaterals in 3-D). Exact for linear fields where the node lies on a flat face.
// Not done: any smoothing of forces; on a fluid surface coarser than the solid's some solid nodes
// get no force (see the coverage in the report).
#pragma once

#include "bridge/interface_mesh.hpp"
#include "bridge/mapping.hpp"

namespace sluice::bridge {

/// A fluid node may be this far from the solid's surface, relative to the size of the nearest face
/// (its longest edge): the sagitta of a facet over a circular arc of one radius is an eighth.
inline constexpr double largest_relative_gap = 0.25;

/// Throws UserError when the meshes differ in dimension, or for the first fluid node whose gap is
/// larger than largest_relative_gap, with node, place, distance and face.
Mapping projection_map(const InterfaceMesh &fluid, const InterfaceMesh &solid);

} // namespace sluice::bridge
