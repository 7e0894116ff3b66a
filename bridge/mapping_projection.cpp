// SPDX-License-Identifier: MIT
#include "bridge/mapping_projection.hpp"

#include "bridge/base/check.hpp"
#include "bridge/face_tree.hpp"

#include <algorithm>
#include <cmath>

namespace sluice::bridge {

namespace {

using Triplets = std::vector<Eigen::Triplet<double>>;

// Weights of rounding size are dropped, so that a fluid node on a solid node has one entry.
constexpr double smallest_weight = 1e-14;

double longest_edge(const FaceTree &tree, std::size_t face) {
  const auto nodes = tree.face(face);
  double longest = 0;
  for (std::size_t a = 0; a < nodes.size(); ++a)
    longest =
        std::max(longest, (tree.node(nodes[a]) - tree.node(nodes[(a + 1) % nodes.size()])).norm());
  return longest;
}

Vec<3> position_of(const InterfaceMesh &mesh, std::size_t node) {
  const auto x = mesh.position(node);
  return {x[0], x[1], mesh.dim == 3 ? x[2] : 0.0};
}

void check_gap(const Vec<3> &x, std::size_t node, double distance, double size, std::size_t face) {
  check(
      distance <= largest_relative_gap * size,
      "bridge: fluid node {} at ({:.6g}, {:.6g}, {:.6g}) m lies {:.3g} m from the solid's surface; "
      "at most {:.3g} m ({} of the size of solid face {}) is allowed. Do both programs describe "
      "the "
      "same interface, in metres, in the same place?",
      node, x[0], x[1], x[2], distance, largest_relative_gap * size, largest_relative_gap, face);
}

void add_row(std::size_t row, std::span<const int> nodes, const Projection &projection,
             Triplets &entries) {
  for (std::size_t a = 0; a < nodes.size(); ++a)
    if (projection.weights[a] > smallest_weight)
      entries.emplace_back(static_cast<int>(row), nodes[a], projection.weights[a]);
}

// On the rim: every node of a flat surface that projects beyond it lands there, at a distance.
bool is_beyond(const Projection &projection, double distance, double size, std::size_t n_nodes) {
  const auto first = projection.weights.begin();
  const bool is_on_edge = std::any_of(first, first + static_cast<std::ptrdiff_t>(n_nodes),
                                      [](double w) { return w <= smallest_weight; });
  return is_on_edge && distance > 1e-9 * size;
}

void finish_report(const Mapping::Matrix &matrix, MapReport &report) {
  const Eigen::VectorXd row_sums = matrix * Eigen::VectorXd::Ones(matrix.cols());
  const Eigen::VectorXd reached = matrix.transpose() * Eigen::VectorXd::Ones(matrix.rows());
  report.row_sum_error = (row_sums.array() - 1).abs().maxCoeff();
  report.solid_nodes_reached = static_cast<std::size_t>((reached.array() > 0).count());
}

void check_dimensions(const InterfaceMesh &fluid, const InterfaceMesh &solid) {
  check(fluid.dim == solid.dim,
        "bridge: the fluid's interface is {}-dimensional and the solid's {}-dimensional", fluid.dim,
        solid.dim);
}

} // namespace

Mapping projection_map(const InterfaceMesh &fluid, const InterfaceMesh &solid) {
  check_dimensions(fluid, solid);
  const FaceTree tree(solid);
  MapReport report{fluid.n_nodes(), solid.n_nodes()};
  Triplets entries;
  for (std::size_t i = 0; i < fluid.n_nodes(); ++i) {
    const Vec<3> x = position_of(fluid, i);
    const auto [face, projection] = tree.nearest(x);
    const double distance = std::sqrt(projection.distance_squared), size = longest_edge(tree, face);
    check_gap(x, i, distance, size, face);
    add_row(i, tree.face(face), projection, entries);
    report.fluid_nodes_beyond += is_beyond(projection, distance, size, tree.face(face).size());
    if (distance > report.largest_distance) {
      report.largest_distance = distance;
      report.farthest_node = i;
    }
  }
  Mapping::Matrix matrix(static_cast<int>(fluid.n_nodes()), static_cast<int>(solid.n_nodes()));
  matrix.setFromTriplets(entries.begin(), entries.end());
  finish_report(matrix, report);
  return {fluid.dim, std::move(matrix), report};
}

} // namespace sluice::bridge
