// SPDX-License-Identifier: MIT
#include "bridge/linear_reproduction.hpp"

#include <Eigen/Eigenvalues>

#include <algorithm>
#include <cmath>

namespace sluice::bridge {

namespace {

// A correction whose weights would sum to more than this in magnitude does more harm than the gap.
constexpr double largest_correction = 0.7;
// The row is widened so often before a direction is given up.
constexpr int most_rings = 4;
// Nodes that leave a plane by less than this, relative to their distance, do not leave it: what is
// left is the rounding of a mesh file.
constexpr double flatness = 1e-6;

struct Row {
  std::vector<int> nodes;
  std::vector<double> weights;

  void insert(int node) {
    if (std::find(nodes.begin(), nodes.end(), node) != nodes.end())
      return;
    nodes.push_back(node);
    weights.push_back(0);
  }
};

// Nodes that share a face, in compressed rows.
class Neighbours {
public:
  explicit Neighbours(const InterfaceMesh &mesh) : first_(mesh.n_nodes() + 1, 0) {
    std::vector<std::vector<int>> lists(mesh.n_nodes());
    for (std::size_t f = 0; f < mesh.n_faces(); ++f)
      for (const int a : mesh.face(f))
        for (const int b : mesh.face(f))
          if (a != b)
            lists[static_cast<std::size_t>(a)].push_back(b);
    for (std::size_t a = 0; a < lists.size(); ++a) {
      std::sort(lists[a].begin(), lists[a].end());
      lists[a].erase(std::unique(lists[a].begin(), lists[a].end()), lists[a].end());
      nodes_.insert(nodes_.end(), lists[a].begin(), lists[a].end());
      first_[a + 1] = nodes_.size();
    }
  }
  std::span<const int> of(int node) const {
    const auto a = static_cast<std::size_t>(node);
    return std::span(nodes_).subspan(first_[a], first_[a + 1] - first_[a]);
  }

private:
  std::vector<std::size_t> first_;
  std::vector<int> nodes_;
};

// The nodes of a row as seen from the fluid's node: where they are, and how much each may change.
struct Support {
  std::vector<Vec<3>> offsets; // X_j - X_mean [m]
  std::vector<double> weights; // w_j
  double total = 0;            // sum w_j
  Mat<3> covariance = Mat<3>::Zero();
};

Support support_of(const Vec<3> &x, const Row &row, const InterfaceMesh &solid) {
  Support support;
  double reach = 0;
  for (const int node : row.nodes) {
    support.offsets.push_back(solid.point(static_cast<std::size_t>(node)) - x);
    reach = std::max(reach, support.offsets.back().squaredNorm());
  }
  Vec<3> mean = Vec<3>::Zero();
  for (const Vec<3> &d : support.offsets) {
    const double bell = 1 - d.squaredNorm() / (1.1 * reach);
    support.weights.push_back(bell * bell);
    support.total += bell * bell;
    mean += bell * bell * d;
  }
  mean /= support.total;
  for (std::size_t k = 0; k < support.offsets.size(); ++k) {
    support.offsets[k] -= mean;
    support.covariance += support.weights[k] * support.offsets[k] * support.offsets[k].transpose();
  }
  return support;
}

class Corrector {
public:
  explicit Corrector(const InterfaceMesh &solid)
      : solid_(solid), neighbours_(solid), rounding_(1e-15 * extent(solid)) {}

  /// Widens the row until it can be closed with small weights in every direction.
  void correct(const Vec<3> &x, Row &row) const {
    if (residual(x, row).norm() <= rounding_)
      return;
    bool is_closed = false;
    for (int ring = 0; ring < most_rings && !is_closed; ++ring) {
      widen(row);
      is_closed = close(x, row);
    }
    if (is_closed)
      close(x, row); // what rounding left of the first time
  }

private:
  Vec<3> residual(const Vec<3> &x, const Row &row) const {
    Vec<3> r = Vec<3>::Zero();
    for (std::size_t k = 0; k < row.nodes.size(); ++k)
      r -= row.weights[k] * (solid_.point(static_cast<std::size_t>(row.nodes[k])) - x);
    return r;
  }

  void widen(Row &row) const {
    for (std::size_t k = 0, n = row.nodes.size(); k < n; ++k)
      for (const int b : neighbours_.of(row.nodes[k]))
        row.insert(b);
  }

  // The principal directions of the support one by one; false when one had to be left out.
  bool close(const Vec<3> &x, Row &row) const {
    const Support support = support_of(x, row, solid_);
    const Eigen::SelfAdjointEigenSolver<Mat<3>> spread(support.covariance);
    const double largest = spread.eigenvalues()[2];
    const Vec<3> r = residual(x, row);
    Vec<3> lambda = Vec<3>::Zero();
    bool is_closed = true;
    for (int d = 0; d < 3; ++d) {
      const Vec<3> axis = spread.eigenvectors().col(d);
      const double part = axis.dot(r), variance = spread.eigenvalues()[d];
      if (std::abs(part) <= rounding_)
        continue;
      // sum_j |w_j part axis.d_j / variance| is at most this, by the Cauchy-Schwarz inequality
      if (variance > flatness * flatness * largest &&
          std::abs(part) * std::sqrt(support.total / variance) <= largest_correction)
        lambda += part / variance * axis;
      else
        is_closed = false;
    }
    for (std::size_t k = 0; k < row.weights.size(); ++k)
      row.weights[k] += support.weights[k] * lambda.dot(support.offsets[k]);
    return is_closed;
  }

  const InterfaceMesh &solid_;
  Neighbours neighbours_;
  double rounding_; // [m]
};

} // namespace

Mapping::Matrix with_linear_reproduction(const Mapping::Matrix &h, const InterfaceMesh &fluid,
                                         const InterfaceMesh &solid) {
  const Corrector corrector(solid);
  std::vector<Eigen::Triplet<double>> entries;
  entries.reserve(static_cast<std::size_t>(h.nonZeros()));
  for (int i = 0; i < h.rows(); ++i) {
    Row row;
    for (Mapping::Matrix::InnerIterator entry(h, i); entry; ++entry) {
      row.nodes.push_back(static_cast<int>(entry.col()));
      row.weights.push_back(entry.value());
    }
    corrector.correct(fluid.point(static_cast<std::size_t>(i)), row);
    for (std::size_t k = 0; k < row.nodes.size(); ++k)
      if (row.weights[k] != 0)
        entries.emplace_back(i, row.nodes[k], row.weights[k]);
  }
  Mapping::Matrix corrected(h.rows(), h.cols());
  corrected.setFromTriplets(entries.begin(), entries.end());
  return corrected;
}

double largest_offset(const Mapping::Matrix &h, const InterfaceMesh &fluid,
                      const InterfaceMesh &solid) {
  double largest = 0;
  for (int i = 0; i < h.rows(); ++i) {
    const Vec<3> x = fluid.point(static_cast<std::size_t>(i));
    Vec<3> r = Vec<3>::Zero();
    for (Mapping::Matrix::InnerIterator entry(h, i); entry; ++entry)
      r -= entry.value() * (solid.point(static_cast<std::size_t>(entry.col())) - x);
    largest = std::max(largest, r.head(fluid.dim).norm());
  }
  return largest;
}

} // namespace sluice::bridge
