// SPDX-License-Identifier: MIT
#include "bridge/facets.hpp"

#include <Eigen/Geometry>

namespace sluice::bridge {

namespace {

// A segment or a triangle: its nodes are its corners.
Facet whole(const InterfaceMesh &mesh, std::span<const int> nodes) {
  Facet facet;
  facet.corners = static_cast<int>(nodes.size());
  facet.weights.setZero();
  for (std::size_t a = 0; a < nodes.size(); ++a) {
    facet.x[a] = mesh.point(static_cast<std::size_t>(nodes[a]));
    facet.weights(static_cast<Eigen::Index>(a), static_cast<Eigen::Index>(a)) = 1;
  }
  return facet;
}

// The triangle over edge `a` of a quadrilateral with its centre as third corner.
Facet quarter(const std::array<Vec<3>, 4> &x, const Vec<3> &centre, std::size_t a) {
  const std::size_t b = (a + 1) % 4;
  Facet facet;
  facet.x = {x[a], x[b], centre};
  facet.weights.setZero();
  facet.weights(static_cast<Eigen::Index>(a), 0) = 1;
  facet.weights(static_cast<Eigen::Index>(b), 1) = 1;
  facet.weights.col(2).setConstant(0.25);
  return facet;
}

} // namespace

double Facet::area() const {
  return corners == 2 ? (x[1] - x[0]).norm() : 0.5 * (x[1] - x[0]).cross(x[2] - x[0]).norm();
}

Facets facets_of(const InterfaceMesh &mesh, std::size_t face) {
  Facets facets;
  const auto nodes = mesh.face(face);
  if (nodes.size() < 4) {
    facets.add(whole(mesh, nodes));
    return facets;
  }
  std::array<Vec<3>, 4> x;
  for (std::size_t a = 0; a < 4; ++a)
    x[a] = mesh.point(static_cast<std::size_t>(nodes[a]));
  const Vec<3> centre = 0.25 * (x[0] + x[1] + x[2] + x[3]);
  for (std::size_t a = 0; a < 4; ++a)
    facets.add(quarter(x, centre, a));
  return facets;
}

} // namespace sluice::bridge
