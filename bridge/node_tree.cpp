// SPDX-License-Identifier: MIT
#include "bridge/node_tree.hpp"

#include <Eigen/Geometry>

#include <algorithm>
#include <limits>
#include <numeric>

namespace sluice::bridge {

namespace {

// The nearest `capacity` of those seen, as a heap whose top is the farthest.
struct Nearest {
  std::size_t capacity;
  std::vector<NodeTree::Neighbour> heap;
  double reach() const {
    return heap.size() < capacity ? std::numeric_limits<double>::infinity()
                                  : heap.front().distance_squared;
  }
  void operator()(const NodeTree::Neighbour &candidate) {
    if (heap.size() == capacity) {
      if (!(candidate < heap.front()))
        return;
      std::pop_heap(heap.begin(), heap.end());
      heap.pop_back();
    }
    heap.push_back(candidate);
    std::push_heap(heap.begin(), heap.end());
  }
};

struct Within {
  double radius_squared;
  std::vector<NodeTree::Neighbour> found;
  double reach() const { return radius_squared; }
  void operator()(const NodeTree::Neighbour &candidate) {
    if (candidate.distance_squared <= radius_squared)
      found.push_back(candidate);
  }
};

} // namespace

NodeTree::NodeTree(const InterfaceMesh &mesh)
    : points_(mesh.n_nodes()), nodes_(mesh.n_nodes()), axes_(mesh.n_nodes()) {
  for (std::size_t a = 0; a < points_.size(); ++a)
    points_[a] = mesh.point(a);
  std::iota(nodes_.begin(), nodes_.end(), 0);
  build(0, nodes_.size());
  for (std::size_t k = 0; k < points_.size(); ++k)
    points_[k] = mesh.point(static_cast<std::size_t>(nodes_[k]));
}

// Until the tree is built, points_ is in the order of the mesh.
void NodeTree::build(std::size_t first, std::size_t last) {
  if (last - first < 2)
    return;
  Eigen::AlignedBox3d box;
  for (std::size_t k = first; k < last; ++k)
    box.extend(points_[static_cast<std::size_t>(nodes_[k])]);
  Eigen::Index axis = 0;
  box.sizes().maxCoeff(&axis);
  const std::size_t middle = (first + last) / 2;
  const auto at = [&](std::size_t k) { return nodes_.begin() + static_cast<std::ptrdiff_t>(k); };
  std::nth_element(at(first), at(middle), at(last), [&](int a, int b) {
    return points_[static_cast<std::size_t>(a)][axis] < points_[static_cast<std::size_t>(b)][axis];
  });
  axes_[middle] = static_cast<int>(axis);
  build(first, middle);
  build(middle + 1, last);
}

template <class Visit>
void NodeTree::search(std::size_t first, std::size_t last, const Vec<3> &p, Visit &visit) const {
  if (first >= last)
    return;
  const std::size_t middle = (first + last) / 2;
  visit({(p - points_[middle]).squaredNorm(), nodes_[middle]});
  if (last - first == 1)
    return;
  const double side = p[axes_[middle]] - points_[middle][axes_[middle]];
  const bool is_below = side < 0;
  is_below ? search(first, middle, p, visit) : search(middle + 1, last, p, visit);
  if (side * side <= visit.reach())
    is_below ? search(middle + 1, last, p, visit) : search(first, middle, p, visit);
}

std::vector<NodeTree::Neighbour> NodeTree::nearest(const Vec<3> &p, std::size_t n) const {
  Nearest visit{n, {}};
  search(0, points_.size(), p, visit);
  std::sort_heap(visit.heap.begin(), visit.heap.end());
  return std::move(visit.heap);
}

std::vector<NodeTree::Neighbour> NodeTree::within(const Vec<3> &p, double radius) const {
  Within visit{radius * radius, {}};
  search(0, points_.size(), p, visit);
  std::sort(visit.found.begin(), visit.found.end());
  return std::move(visit.found);
}

} // namespace sluice::bridge
