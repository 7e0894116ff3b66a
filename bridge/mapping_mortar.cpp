// SPDX-License-Identifier: MIT
#include "bridge/mapping_mortar.hpp"

#include "bridge/linear_reproduction.hpp"
#include "bridge/mapping_projection.hpp"
#include "bridge/overlap.hpp"

#include <Eigen/Dense>

#include <algorithm>
#include <cmath>

namespace sluice::bridge {

namespace {

// A face of which a smaller part is covered has no say: its dual functions would be all rounding.
constexpr double smallest_cover = 1e-3;
// Functions that the covered part cannot tell apart, relative to those that it can.
constexpr double smallest_eigenvalue = 1e-9;
// Weights that sum to more in magnitude come from slivers of cover; the node is projected instead.
constexpr double largest_row = 5;

// What one fluid face contributes, per node of the face.
struct FaceIntegrals {
  double area = 0;                                  // of the whole face
  Eigen::Matrix4d mass = Eigen::Matrix4d::Zero();   // int phi_a phi_b over the covered part
  Eigen::Vector4d volume = Eigen::Vector4d::Zero(); // int phi_a
  std::vector<int> solid_nodes;
  std::vector<Eigen::Vector4d> with_solid; // int phi_a phi_j, per solid node

  void add(const Eigen::Vector4d &phi, int solid_node, double weight) {
    const auto found = std::find(solid_nodes.begin(), solid_nodes.end(), solid_node);
    const auto k = static_cast<std::size_t>(found - solid_nodes.begin());
    if (found == solid_nodes.end()) {
      solid_nodes.push_back(solid_node);
      with_solid.push_back(Eigen::Vector4d::Zero());
    }
    with_solid[k] += weight * phi;
  }
};

// Inverse of the leading n x n block. Two functions of a quadrilateral are the same on one of its
// four triangles: when only that is covered the block is singular, and the pseudo-inverse treats
// them alike.
Eigen::Matrix4d inverse_of(const Eigen::Matrix4d &mass, Eigen::Index n) {
  if (n < 4) {
    Eigen::Matrix4d padded = Eigen::Matrix4d::Identity();
    padded.topLeftCorner(n, n) = mass.topLeftCorner(n, n) / mass.trace();
    return padded.inverse() / mass.trace();
  }
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix4d> solver(mass);
  Eigen::Vector4d inverse = Eigen::Vector4d::Zero();
  for (int k = 0; k < 4; ++k)
    if (solver.eigenvalues()[k] > smallest_eigenvalue * solver.eigenvalues()[3])
      inverse[k] = 1 / solver.eigenvalues()[k];
  return solver.eigenvectors() * inverse.asDiagonal() * solver.eigenvectors().transpose();
}

class MortarRows {
public:
  MortarRows(const InterfaceMesh &fluid, const InterfaceMesh &solid, const FaceTree &tree)
      : fluid_(fluid), solid_(solid), tree_(tree),
        n_(static_cast<Eigen::Index>(fluid.nodes_per_face)), volumes_(fluid.n_nodes(), 0.0) {
    for (std::size_t f = 0; f < fluid.n_faces(); ++f)
      add(fluid.face(f), integrals(f));
  }

  /// int psi_i phi_j / int psi_i; rows of nodes without cover are empty.
  Mapping::Matrix matrix() const {
    Mapping::Matrix h(static_cast<int>(fluid_.n_nodes()), static_cast<int>(solid_.n_nodes()));
    h.setFromTriplets(entries_.begin(), entries_.end());
    for (int i = 0; i < h.rows(); ++i)
      if (const double volume = volumes_[static_cast<std::size_t>(i)]; volume > 0)
        h.row(i) /= volume;
    return h;
  }
  double area_covered() const { return covered_ / area_; }

private:
  FaceIntegrals integrals(std::size_t face) {
    FaceIntegrals sums;
    const double gap = largest_relative_gap * longest_edge(fluid_, face);
    for (const Facet &facet : facets_of(fluid_, face)) {
      sums.area += facet.area();
      Eigen::AlignedBox3d box;
      for (int a = 0; a < facet.corners; ++a)
        box.extend(facet.x[static_cast<std::size_t>(a)]);
      box.min().array() -= gap;
      box.max().array() += gap;
      tree_.find(box, near_);
      std::sort(near_.begin(), near_.end());
      for (const std::size_t other : near_)
        integrate(facet, other, std::max(gap, largest_relative_gap * longest_edge(solid_, other)),
                  sums);
    }
    return sums;
  }

  void integrate(const Facet &facet, std::size_t solid_face, double gap, FaceIntegrals &sums) {
    const auto nodes = solid_.face(solid_face);
    for (const Facet &other : facets_of(solid_, solid_face)) {
      points_.clear();
      add_overlap(facet, other, points_);
      for (const OverlapPoint &point : points_) {
        if ((place(facet, point.on_first) - place(other, point.on_second)).squaredNorm() >
            gap * gap)
          continue;
        const Eigen::Vector4d phi = facet.weights * point.on_first,
                              phi_solid = other.weights * point.on_second;
        sums.mass += point.weight * phi * phi.transpose();
        sums.volume += point.weight * phi;
        for (std::size_t a = 0; a < nodes.size(); ++a)
          sums.add(phi, nodes[a], point.weight * phi_solid[static_cast<Eigen::Index>(a)]);
      }
    }
  }

  static Vec<3> place(const Facet &facet, const Vec<3> &weights) {
    Vec<3> x = Vec<3>::Zero();
    for (int a = 0; a < facet.corners; ++a)
      x += weights[a] * facet.x[static_cast<std::size_t>(a)];
    return x;
  }

  // The dual functions of the face are C phi with C = diag(volume) mass^-1.
  void add(std::span<const int> nodes, const FaceIntegrals &sums) {
    area_ += sums.area;
    covered_ += sums.volume.sum();
    if (sums.volume.sum() < smallest_cover * sums.area)
      return;
    const Eigen::Matrix4d dual = sums.volume.asDiagonal() * inverse_of(sums.mass, n_);
    for (std::size_t k = 0; k < sums.solid_nodes.size(); ++k) {
      const Eigen::Vector4d parts = dual * sums.with_solid[k];
      for (std::size_t a = 0; a < nodes.size(); ++a)
        entries_.emplace_back(nodes[a], sums.solid_nodes[k], parts[static_cast<Eigen::Index>(a)]);
    }
    for (std::size_t a = 0; a < nodes.size(); ++a)
      volumes_[static_cast<std::size_t>(nodes[a])] += sums.volume[static_cast<Eigen::Index>(a)];
  }

  const InterfaceMesh &fluid_, &solid_;
  const FaceTree &tree_;
  Eigen::Index n_; // nodes per fluid face
  Triplets entries_;
  std::vector<double> volumes_; // int psi_i over the covered part
  double area_ = 0, covered_ = 0;
  std::vector<std::size_t> near_;
  std::vector<OverlapPoint> points_;
};

// A row of integrals that can be trusted: it sums to one, and its weights do not blow up.
bool is_sound(const Mapping::Matrix &h, int i) {
  double sum = 0, magnitude = 0;
  for (Mapping::Matrix::InnerIterator entry(h, i); entry; ++entry) {
    sum += entry.value();
    magnitude += std::abs(entry.value());
  }
  return std::abs(sum - 1) <= 1e-6 && magnitude <= largest_row;
}

} // namespace

Mapping mortar_map(const InterfaceMesh &fluid, const InterfaceMesh &solid) {
  check_dimensions(fluid, solid);
  check_faces(solid, "solid");
  check_faces(fluid, "fluid");
  const FaceTree tree(solid);
  const MortarRows integrals(fluid, solid, tree);
  const Mapping::Matrix whole = integrals.matrix();
  MapReport report;
  report.area_covered = integrals.area_covered();
  Triplets entries;
  entries.reserve(static_cast<std::size_t>(whole.nonZeros()));
  for (int i = 0; i < whole.rows(); ++i) {
    const ProjectedNode node = project(fluid, static_cast<std::size_t>(i), tree, solid);
    note(static_cast<std::size_t>(i), node, report);
    if (is_sound(whole, i))
      for (Mapping::Matrix::InnerIterator entry(whole, i); entry; ++entry)
        entries.emplace_back(i, static_cast<int>(entry.col()), entry.value());
    else
      add_row(static_cast<std::size_t>(i), solid.face(node.face), node.projection, entries);
  }
  Mapping::Matrix matrix(whole.rows(), whole.cols());
  matrix.setFromTriplets(entries.begin(), entries.end());
  return {fluid, solid, with_linear_reproduction(matrix, fluid, solid), report};
}

} // namespace sluice::bridge
