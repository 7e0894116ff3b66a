// SPDX-License-Identifier: MIT
#include "bridge/mapping_rbf.hpp"

#include "bridge/linear_reproduction.hpp"
#include "bridge/mapping_projection.hpp"
#include "bridge/node_tree.hpp"

#include <Eigen/Dense>

#include <algorithm>
#include <cmath>
#include <optional>

namespace sluice::bridge {

namespace {

constexpr std::size_t nodes_per_patch = 50;
// A fluid node farther from every patch's centre, relative to the patch's radius, gets a patch of
// its own: patches overlap by the rest.
constexpr double inner_part = 0.7;
// Support of the basis functions in radii of the patch: about ten node distances.
constexpr double support_radii = 2.5;
// A direction in which a patch's nodes spread less, relative to the widest, is no direction.
constexpr double flatness = 1e-6;

double wendland_c6(double r) {
  if (r >= 1)
    return 0;
  const double a = (1 - r) * (1 - r) * (1 - r) * (1 - r);
  return a * a * (((32 * r + 25) * r + 8) * r + 1);
}

double wendland_c2(double r) {
  const double a = (1 - r) * (1 - r);
  return r < 1 ? a * a * (4 * r + 1) : 0;
}

/// Interpolation on the solid nodes round one centre.
class Patch {
public:
  Patch(const InterfaceMesh &solid, const std::vector<NodeTree::Neighbour> &near)
      : radius_(1.001 * std::sqrt(near.back().distance_squared)) {
    for (const auto &[distance, node] : near) {
      nodes_.push_back(node);
      points_.push_back(solid.point(static_cast<std::size_t>(node)));
    }
    find_directions();
    factorise();
  }

  double radius() const { return radius_; }
  const std::vector<int> &nodes() const { return nodes_; }

  /// Weights of the nodes at `x`; in exact arithmetic they reproduce linear fields.
  Eigen::VectorXd weights(const Vec<3> &x) const {
    const auto n = static_cast<Eigen::Index>(nodes_.size());
    Eigen::VectorXd right(n + 1 + n_directions_);
    for (Eigen::Index k = 0; k < n; ++k)
      right[k] = basis(x, points_[static_cast<std::size_t>(k)]);
    right.tail(1 + n_directions_) = polynomial(x);
    return factors_.solve(right).head(n);
  }

private:
  // The polynomial lives in the directions in which the nodes spread.
  void find_directions() {
    centre_.setZero();
    for (const Vec<3> &x : points_)
      centre_ += x / static_cast<double>(points_.size());
    Mat<3> covariance = Mat<3>::Zero();
    for (const Vec<3> &x : points_)
      covariance += (x - centre_) * (x - centre_).transpose() / static_cast<double>(points_.size());
    const Eigen::SelfAdjointEigenSolver<Mat<3>> spread(covariance);
    for (int d = 2; d >= 0; --d)
      if (spread.eigenvalues()[d] > flatness * flatness * spread.eigenvalues()[2])
        directions_.col(n_directions_++) =
            spread.eigenvectors().col(d) / std::sqrt(spread.eigenvalues()[d]);
  }

  Eigen::VectorXd polynomial(const Vec<3> &x) const {
    Eigen::VectorXd p(1 + n_directions_);
    p << 1, directions_.leftCols(n_directions_).transpose() * (x - centre_);
    return p;
  }

  double basis(const Vec<3> &x, const Vec<3> &y) const {
    return wendland_c6((x - y).norm() / (support_radii * radius_));
  }

  void factorise() {
    const auto n = static_cast<Eigen::Index>(points_.size());
    Eigen::MatrixXd system = Eigen::MatrixXd::Zero(n + 1 + n_directions_, n + 1 + n_directions_);
    for (Eigen::Index a = 0; a < n; ++a) {
      for (Eigen::Index b = 0; b <= a; ++b)
        system(a, b) = system(b, a) =
            basis(points_[static_cast<std::size_t>(a)], points_[static_cast<std::size_t>(b)]);
      system.col(a).tail(1 + n_directions_) = polynomial(points_[static_cast<std::size_t>(a)]);
      system.row(a).tail(1 + n_directions_) = system.col(a).tail(1 + n_directions_).transpose();
    }
    factors_.compute(system);
  }

  double radius_; // [m]
  std::vector<int> nodes_;
  std::vector<Vec<3>> points_;
  Vec<3> centre_;
  Mat<3> directions_ = Mat<3>::Zero();
  Eigen::Index n_directions_ = 0;
  Eigen::PartialPivLU<Eigen::MatrixXd> factors_;
};

/// Rows as sums over patches, not yet divided by the sum of the blending weights.
class Blend {
public:
  Blend(const InterfaceMesh &fluid, const InterfaceMesh &solid)
      : fluid_(fluid), solid_(solid), fluid_tree_(fluid), solid_tree_(solid),
        is_covered_(fluid.n_nodes(), false), sums_(fluid.n_nodes(), 0.0) {
    for (std::size_t i = 0; i < fluid.n_nodes(); ++i)
      if (!is_covered_[i])
        add_patch(solid.point(static_cast<std::size_t>(
                      solid_tree_.nearest(fluid.point(i), 1).front().node)),
                  i);
  }

  Mapping::Matrix matrix() const {
    Mapping::Matrix h(static_cast<int>(fluid_.n_nodes()), static_cast<int>(solid_.n_nodes()));
    h.setFromTriplets(entries_.begin(), entries_.end());
    for (int i = 0; i < h.rows(); ++i)
      h.row(i) /= sums_[static_cast<std::size_t>(i)];
    return h;
  }

private:
  void add_patch(const Vec<3> &centre, std::size_t i) {
    const auto near = solid_tree_.nearest(centre, nodes_per_patch);
    const Patch patch(solid_, near);
    // Where the solid is far coarser than its distance to the fluid, the node itself is the least.
    const double reach = std::max(patch.radius(), 1.5 * (fluid_.point(i) - centre).norm());
    for (const auto &[distance_squared, node] : fluid_tree_.within(centre, reach)) {
      const double r = std::sqrt(distance_squared) / reach;
      add_weights(static_cast<std::size_t>(node), patch, wendland_c2(r));
      if (r <= inner_part)
        is_covered_[static_cast<std::size_t>(node)] = true;
    }
    is_covered_[i] = true;
  }

  void add_weights(std::size_t i, const Patch &patch, double blending) {
    if (!(blending > 0))
      return;
    const Eigen::VectorXd weights = patch.weights(fluid_.point(i));
    for (std::size_t k = 0; k < patch.nodes().size(); ++k)
      entries_.emplace_back(static_cast<int>(i), patch.nodes()[k],
                            blending * weights[static_cast<Eigen::Index>(k)]);
    sums_[i] += blending;
  }

  const InterfaceMesh &fluid_, &solid_;
  NodeTree fluid_tree_, solid_tree_;
  std::vector<bool> is_covered_;
  std::vector<double> sums_;
  Triplets entries_;
};

} // namespace

Mapping rbf_map(const InterfaceMesh &fluid, const InterfaceMesh &solid) {
  check_dimensions(fluid, solid);
  const std::optional<FaceTree> faces =
      solid.n_faces() > 0 ? std::optional<FaceTree>(std::in_place, solid) : std::nullopt;
  const NodeTree nodes(solid);
  MapReport report;
  for (std::size_t i = 0; i < fluid.n_nodes(); ++i)
    note(i,
         faces ? project(fluid, i, *faces, solid)
               : ProjectedNode{0,
                               {},
                               std::sqrt(nodes.nearest(fluid.point(i), 1).front().distance_squared),
                               false},
         report);
  const Mapping::Matrix matrix = Blend(fluid, solid).matrix();
  return {fluid, solid, with_linear_reproduction(matrix, fluid, solid), report};
}

} // namespace sluice::bridge
