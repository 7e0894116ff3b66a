// SPDX-License-Identifier: MIT
#include "bridge/mapping_extruded.hpp"

#include "bridge/base/check.hpp"

#include <algorithm>

namespace sluice::bridge {

namespace {

// The z at which the solid has nodes, ascending [m].
std::vector<double> layers_of(const InterfaceMesh &solid) {
  std::vector<double> z;
  for (std::size_t a = 0; a < solid.n_nodes(); ++a)
    z.push_back(solid.point(a).z());
  std::sort(z.begin(), z.end());
  const double rounding = 1e-9 * extent(solid);
  z.erase(std::unique(z.begin(), z.end(), [&](double a, double b) { return b - a <= rounding; }),
          z.end());
  check(z.size() >= 2,
        "bridge: the fluid is 2-dimensional and the solid 3-dimensional, but all of the solid's "
        "interface lies at z = {} m; it needs a depth along z",
        z.front());
  return z;
}

InterfaceMesh drawn_out(const InterfaceMesh &line, const std::vector<double> &z) {
  InterfaceMesh mesh{3, 4, {}, {}};
  const auto n = static_cast<int>(line.n_nodes());
  for (std::size_t layer = 0; layer < z.size(); ++layer)
    for (std::size_t a = 0; a < line.n_nodes(); ++a)
      mesh.positions.insert(mesh.positions.end(), {line.point(a).x(), line.point(a).y(), z[layer]});
  for (int layer = 0; layer + 1 < static_cast<int>(z.size()); ++layer)
    for (std::size_t f = 0; f < line.n_faces(); ++f) {
      const int a = layer * n + line.face(f)[0], b = layer * n + line.face(f)[1];
      mesh.faces.insert(mesh.faces.end(), {a, b, b + n, a + n});
    }
  return mesh;
}

// E: the mean over the layers, by the trapezoidal rule.
Mapping::Matrix mean_over_layers(int n_nodes, const std::vector<double> &z) {
  const auto n = static_cast<int>(z.size());
  std::vector<Eigen::Triplet<double>> entries;
  for (int layer = 0; layer < n; ++layer) {
    const double below = z[static_cast<std::size_t>(std::max(layer - 1, 0))];
    const double above = z[static_cast<std::size_t>(std::min(layer + 1, n - 1))];
    for (int a = 0; a < n_nodes; ++a)
      entries.emplace_back(a, layer * n_nodes + a, 0.5 * (above - below) / (z.back() - z.front()));
  }
  Mapping::Matrix mean(n_nodes, n * n_nodes);
  mean.setFromTriplets(entries.begin(), entries.end());
  return mean;
}

} // namespace

Mapping extruded_map(MapKind kind, const InterfaceMesh &fluid, const InterfaceMesh &solid) {
  const std::vector<double> z = layers_of(solid);
  const Mapping in_space = make_mapping(kind, drawn_out(fluid, z), solid);
  MapReport report = in_space.report();
  report.farthest_node %= fluid.n_nodes();
  report.fluid_nodes_beyond /= z.size();
  const Mapping::Matrix mean = mean_over_layers(static_cast<int>(fluid.n_nodes()), z);
  return {fluid, solid, mean * in_space.matrix(), report, z.back() - z.front()};
}

} // namespace sluice::bridge
