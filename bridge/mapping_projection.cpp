// SPDX-License-Identifier: MIT
#include "bridge/mapping_projection.hpp"

#include "bridge/base/check.hpp"
#include "bridge/linear_reproduction.hpp"

#include <algorithm>
#include <cmath>

namespace sluice::bridge {

namespace {

// Weights of rounding size are dropped, so that a fluid node on a solid node has one entry.
constexpr double smallest_weight = 1e-14;

void check_gap(const Vec<3> &x, std::size_t node, double distance, double size, std::size_t face) {
  check(
      distance <= largest_relative_gap * size,
      "bridge: fluid node {} at ({:.6g}, {:.6g}, {:.6g}) m lies {:.3g} m from the solid's surface; "
      "at most {:.3g} m ({} of the size of solid face {}) is allowed. Do both programs describe "
      "the "
      "same interface, in metres, in the same place?",
      node, x[0], x[1], x[2], distance, largest_relative_gap * size, largest_relative_gap, face);
}

// On the rim: every node of a flat surface that projects beyond it lands there, at a distance.
bool is_beyond(const Projection &projection, double distance, double size, std::size_t n_nodes) {
  const auto first = projection.weights.begin();
  const bool is_on_edge = std::any_of(first, first + static_cast<std::ptrdiff_t>(n_nodes),
                                      [](double w) { return w <= smallest_weight; });
  return is_on_edge && distance > 1e-9 * size;
}

} // namespace

void check_dimensions(const InterfaceMesh &fluid, const InterfaceMesh &solid) {
  check(fluid.dim == solid.dim,
        "bridge: the fluid's interface is {}-dimensional and the solid's {}-dimensional", fluid.dim,
        solid.dim);
}

void check_faces(const InterfaceMesh &mesh, std::string_view owner) {
  check(mesh.n_faces() > 0,
        "bridge: the {}'s interface mesh has {} nodes and no faces, which only bridge.mapping = "
        "\"nearest\" can use; give it the faces of its surface",
        owner, mesh.n_nodes());
}

void note(std::size_t i, const ProjectedNode &node, MapReport &report) {
  report.fluid_nodes_beyond += node.is_beyond;
  if (node.distance <= report.largest_distance)
    return;
  report.largest_distance = node.distance;
  report.farthest_node = i;
}

void add_row(std::size_t row, std::span<const int> nodes, const Projection &projection,
             Triplets &entries) {
  for (std::size_t a = 0; a < nodes.size(); ++a)
    if (projection.weights[a] > smallest_weight)
      entries.emplace_back(static_cast<int>(row), nodes[a], projection.weights[a]);
}

ProjectedNode project(const InterfaceMesh &fluid, std::size_t i, const FaceTree &tree,
                      const InterfaceMesh &solid) {
  const Vec<3> x = fluid.point(i);
  const auto [face, projection] = tree.nearest(x);
  const double distance = std::sqrt(projection.distance_squared), size = longest_edge(solid, face);
  check_gap(x, i, distance, size, face);
  return {face, projection, distance,
          is_beyond(projection, distance, size, solid.face(face).size())};
}

Mapping projection_map(const InterfaceMesh &fluid, const InterfaceMesh &solid) {
  check_dimensions(fluid, solid);
  check_faces(solid, "solid");
  const FaceTree tree(solid);
  MapReport report;
  Triplets entries;
  for (std::size_t i = 0; i < fluid.n_nodes(); ++i) {
    const ProjectedNode node = project(fluid, i, tree, solid);
    add_row(i, solid.face(node.face), node.projection, entries);
    note(i, node, report);
  }
  Mapping::Matrix matrix(static_cast<int>(fluid.n_nodes()), static_cast<int>(solid.n_nodes()));
  matrix.setFromTriplets(entries.begin(), entries.end());
  return {fluid, solid, with_linear_reproduction(matrix, fluid, solid), report};
}

} // namespace sluice::bridge
