// SPDX-License-Identifier: MIT
// The coupled surface as one participant sees it: what the two sides exchange once, at connect.
#pragma once

#include "bridge/base/vec.hpp"

#include <cstddef>
#include <span>
#include <string_view>
#include <vector>

namespace sluice::bridge {

/// Nodes and faces of the wetted surface in the reference configuration. Node `a` has the
/// components positions[dim*a .. dim*a+dim-1]; every field of the bridge uses the same order: node
/// by node.
struct InterfaceMesh {
  int dim = 2;                   ///< 2 or 3
  int nodes_per_face = 2;        ///< 2: segments (dim 2); 3: triangles, 4: quadrilaterals (dim 3)
  std::vector<double> positions; ///< [m], dim per node, reference configuration
  std::vector<int> faces;        ///< node numbers, nodes_per_face per face; none: a set of points

  std::size_t n_nodes() const { return positions.size() / static_cast<std::size_t>(dim); }
  std::size_t n_faces() const { return faces.size() / static_cast<std::size_t>(nodes_per_face); }
  std::span<const double> position(std::size_t node) const {
    const auto d = static_cast<std::size_t>(dim);
    return std::span(positions).subspan(d * node, d);
  }
  /// The same with three components; the third is zero in 2-D.
  Vec<3> point(std::size_t node) const {
    const auto x = position(node);
    return {x[0], x[1], dim == 3 ? x[2] : 0.0};
  }
  std::span<const int> face(std::size_t number) const {
    const auto n = static_cast<std::size_t>(nodes_per_face);
    return std::span(faces).subspan(n * number, n);
  }
};

/// Throws UserError when `mesh` is not usable: no nodes, a node number out of range, a
/// position that is not finite, a face of zero size. `owner` is named in the message.
void check_mesh(const InterfaceMesh &mesh, std::string_view owner);

/// Diagonal of the bounding box [m].
double extent(const InterfaceMesh &mesh);

/// Longest edge of a face [m].
double longest_edge(const InterfaceMesh &mesh, std::size_t face);

/// Integral of each node's shape function over the surface [m^2; 2-D: m]: the area that turns a
/// nodal traction into a nodal force. A quadrilateral is the sum of four triangles round its
/// centre.
std::vector<double> node_areas(const InterfaceMesh &mesh);

} // namespace sluice::bridge
