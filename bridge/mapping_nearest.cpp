// SPDX-License-Identifier: MIT
#include "bridge/mapping_nearest.hpp"

#include "bridge/mapping_projection.hpp"
#include "bridge/node_tree.hpp"

#include <cmath>
#include <optional>

namespace sluice::bridge {

Mapping nearest_map(const InterfaceMesh &fluid, const InterfaceMesh &solid) {
  check_dimensions(fluid, solid);
  const std::optional<FaceTree> faces =
      solid.n_faces() > 0 ? std::optional<FaceTree>(std::in_place, solid) : std::nullopt;
  const NodeTree nodes(solid);
  MapReport report;
  Mapping::Matrix matrix(static_cast<int>(fluid.n_nodes()), static_cast<int>(solid.n_nodes()));
  matrix.reserve(Eigen::VectorXi::Ones(matrix.rows()));
  for (std::size_t i = 0; i < fluid.n_nodes(); ++i) {
    const NodeTree::Neighbour nearest = nodes.nearest(fluid.point(i), 1).front();
    matrix.insert(static_cast<int>(i), nearest.node) = 1;
    if (faces)
      note(i, project(fluid, i, *faces, solid), report);
    else
      note(i, {0, {}, std::sqrt(nearest.distance_squared), false}, report);
  }
  matrix.makeCompressed();
  return {fluid, solid, std::move(matrix), report};
}

} // namespace sluice::bridge
