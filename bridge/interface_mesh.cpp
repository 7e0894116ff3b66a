// SPDX-License-Identifier: MIT
#include "bridge/interface_mesh.hpp"

#include "bridge/base/check.hpp"
#include "bridge/facets.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace sluice::bridge {

namespace {

void check_shape(const InterfaceMesh &mesh, std::string_view owner) {
  check(mesh.dim == 2 || mesh.dim == 3, "bridge: the {}'s interface mesh has dimension {}", owner,
        mesh.dim);
  const bool fits = mesh.dim == 2 ? mesh.nodes_per_face == 2
                                  : mesh.nodes_per_face == 3 || mesh.nodes_per_face == 4;
  check(fits, "bridge: the {}'s interface mesh has {} nodes per face in {} dimensions", owner,
        mesh.nodes_per_face, mesh.dim);
  const auto d = static_cast<std::size_t>(mesh.dim),
             n = static_cast<std::size_t>(mesh.nodes_per_face);
  check(!mesh.positions.empty() && mesh.positions.size() % d == 0 && mesh.faces.size() % n == 0,
        "bridge: the {}'s interface mesh has {} coordinates and {} face nodes", owner,
        mesh.positions.size(), mesh.faces.size());
}

void check_positions(const InterfaceMesh &mesh, std::string_view owner) {
  constexpr double farthest = 1e100; // [m], squares of distances must not overflow
  for (std::size_t k = 0; k < mesh.positions.size(); ++k)
    check(std::abs(mesh.positions[k]) < farthest, // not so for what is no number, either
          "bridge: node {} of the {}'s interface mesh is at {} m",
          k / static_cast<std::size_t>(mesh.dim), owner, mesh.positions[k]);
}

double distance(const InterfaceMesh &mesh, int a, int b) {
  return (mesh.point(static_cast<std::size_t>(a)) - mesh.point(static_cast<std::size_t>(b))).norm();
}

void check_face(const InterfaceMesh &mesh, std::size_t face, std::string_view owner) {
  const auto nodes = mesh.face(face);
  const std::size_t n = nodes.size();
  for (const int a : nodes)
    check(a >= 0 && static_cast<std::size_t>(a) < mesh.n_nodes(),
          "bridge: face {} of the {}'s interface mesh names node {}; there are {}", face, owner, a,
          mesh.n_nodes());
  for (std::size_t a = 0; a < n; ++a)
    check(distance(mesh, nodes[a], nodes[(a + 1) % n]) > 0,
          "bridge: face {} of the {}'s interface mesh has an edge of no length", face, owner);
}

} // namespace

void check_mesh(const InterfaceMesh &mesh, std::string_view owner) {
  check_shape(mesh, owner);
  check_positions(mesh, owner);
  for (std::size_t f = 0; f < mesh.n_faces(); ++f)
    check_face(mesh, f, owner);
}

double extent(const InterfaceMesh &mesh) {
  double sum = 0;
  const auto dim = static_cast<std::size_t>(mesh.dim);
  for (std::size_t d = 0; d < dim; ++d) {
    double low = std::numeric_limits<double>::infinity(), high = -low;
    for (std::size_t k = d; k < mesh.positions.size(); k += dim) {
      low = std::min(low, mesh.positions[k]);
      high = std::max(high, mesh.positions[k]);
    }
    sum += (high - low) * (high - low);
  }
  return std::sqrt(sum);
}

double longest_edge(const InterfaceMesh &mesh, std::size_t face) {
  const auto nodes = mesh.face(face);
  double longest = 0;
  for (std::size_t a = 0; a < nodes.size(); ++a)
    longest = std::max(longest, distance(mesh, nodes[a], nodes[(a + 1) % nodes.size()]));
  return longest;
}

std::vector<double> node_areas(const InterfaceMesh &mesh) {
  std::vector<double> areas(mesh.n_nodes(), 0.0);
  for (std::size_t f = 0; f < mesh.n_faces(); ++f)
    for (const Facet &facet : facets_of(mesh, f))
      for (std::size_t a = 0; a < mesh.face(f).size(); ++a)
        areas[static_cast<std::size_t>(mesh.face(f)[a])] +=
            facet.area() * facet.mean_weight(static_cast<Eigen::Index>(a));
  return areas;
}

} // namespace sluice::bridge
