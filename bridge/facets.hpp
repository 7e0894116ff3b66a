// SPDX-License-Identifier: MIT
// A face as flat simplices on which its shape functions are linear: a segment or a triangle is one,
// a quadrilateral is four triangles round its centre, where the value is the mean of the corners,
// so that no diagonal is preferred.
#pragma once

#include "bridge/interface_mesh.hpp"

#include <array>

namespace sluice::bridge {

/// One simplex of a face: `corners` points, and what each of the face's nodes contributes there.
struct Facet {
  int corners = 3;                              ///< 2: segment, 3: triangle
  std::array<Vec<3>, 3> x;                      ///< [m]
  Eigen::Matrix<double, 4, 3> weights;          ///< shape function of node (row) at corner (column)
  double area() const;                          ///< [m^2]; of a segment its length [m]
  double mean_weight(Eigen::Index node) const { ///< mean of the node's shape function
    return weights.row(node).head(corners).sum() / corners;
  }
};

/// The facets of one face: at most four.
class Facets {
public:
  void add(const Facet &facet) { facets_[n_++] = facet; }
  const Facet *begin() const { return facets_.data(); }
  const Facet *end() const { return facets_.data() + n_; }

private:
  std::array<Facet, 4> facets_;
  std::size_t n_ = 0;
};

Facets facets_of(const InterfaceMesh &mesh, std::size_t face);

} // namespace sluice::bridge
