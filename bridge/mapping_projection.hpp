// SPDX-License-Identifier: MIT
// Projection map: every fluid node takes the value at the nearest point of the solid's surface,
// interpolated with the shape functions of the face that it lies on (segments in 2-D, triangles or
// bilinear quadrilaterals in 3-D). Where the node lies off that face, the row is widened until it
// is exact for linear fields (linear_reproduction.hpp). Not done: any smoothing of forces; on a
// fluid surface as coarse as the solid's or coarser, nodal tractions are poor (see the coverage in
// the report): mapping_mortar.hpp.
#pragma once

#include "bridge/face_tree.hpp"
#include "bridge/interface_mesh.hpp"
#include "bridge/mapping.hpp"

namespace sluice::bridge {

/// A fluid node may be this far from the solid's surface, relative to the size of the nearest face
/// (its longest edge): the sagitta of a facet over a circular arc of one radius is an eighth.
inline constexpr double largest_relative_gap = 0.25;

/// Throws UserError when the meshes differ in dimension, or for the first fluid node whose gap is
/// larger than largest_relative_gap, with node, place, distance and face.
Mapping projection_map(const InterfaceMesh &fluid, const InterfaceMesh &solid);

// ---- for the other maps -------------------------------------------------------------------------

/// Throws UserError when the meshes differ in dimension.
void check_dimensions(const InterfaceMesh &fluid, const InterfaceMesh &solid);

/// Throws UserError when the mesh is a set of points.
void check_faces(const InterfaceMesh &mesh, std::string_view owner);

/// A fluid node on the solid's surface.
struct ProjectedNode {
  std::size_t face = 0;
  Projection projection;
  double distance = 0;    ///< [m]
  bool is_beyond = false; ///< on the rim, at a distance
};
/// Throws UserError for a gap larger than largest_relative_gap.
ProjectedNode project(const InterfaceMesh &fluid, std::size_t node, const FaceTree &tree,
                      const InterfaceMesh &solid);
/// The row of shape functions at a projected node.
using Triplets = std::vector<Eigen::Triplet<double>>;
void add_row(std::size_t row, std::span<const int> face, const Projection &projection,
             Triplets &entries);
/// Distance and overhang of fluid node `i` into the report.
void note(std::size_t i, const ProjectedNode &node, MapReport &report);

} // namespace sluice::bridge
