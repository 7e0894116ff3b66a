// SPDX-License-Identifier: MIT
#include "bridge/face_tree.hpp"

#include <algorithm>
#include <limits>
#include <numeric>

namespace sluice::bridge {

namespace {
constexpr std::size_t faces_per_leaf = 4;
}

FaceTree::FaceTree(const InterfaceMesh &mesh) : mesh_(mesh), order_(mesh.n_faces()) {
  std::iota(order_.begin(), order_.end(), std::size_t{0});
  branches_.push_back({Box(), 0, order_.size(), 0});
  for (std::size_t k = 0; k < branches_.size(); ++k)
    build(k);
}

// Halves the faces along the longest side of their box, by the boxes' centres.
void FaceTree::build(std::size_t branch) {
  Box box;
  const auto [first, last] = std::pair(branches_[branch].first, branches_[branch].last);
  for (std::size_t k = first; k < last; ++k)
    box.extend(box_of(order_[k]));
  branches_[branch].box = box;
  if (last - first <= faces_per_leaf)
    return;
  Eigen::Index axis = 0;
  box.sizes().maxCoeff(&axis);
  const std::size_t middle = (first + last) / 2;
  const auto at = [&](std::size_t k) { return order_.begin() + static_cast<std::ptrdiff_t>(k); };
  std::nth_element(at(first), at(middle), at(last), [&](std::size_t a, std::size_t b) {
    return box_of(a).center()[axis] < box_of(b).center()[axis];
  });
  branches_[branch].children = branches_.size();
  branches_.push_back({Box(), first, middle, 0});
  branches_.push_back({Box(), middle, last, 0});
}

FaceTree::Nearest FaceTree::nearest(const Vec<3> &p) const {
  Nearest best;
  best.face = order_.size();
  best.projection.distance_squared = std::numeric_limits<double>::infinity();
  search(0, p, best);
  return best;
}

void FaceTree::search(std::size_t branch, const Vec<3> &p, Nearest &best) const {
  const Branch &here = branches_[branch];
  if (here.box.squaredExteriorDistance(p) > best.projection.distance_squared)
    return;
  if (here.children == 0) {
    for (std::size_t k = here.first; k < here.last; ++k) {
      const Nearest candidate{order_[k], project(p, order_[k])};
      const double d = candidate.projection.distance_squared,
                   d_best = best.projection.distance_squared;
      if (d < d_best || (d == d_best && candidate.face < best.face))
        best = candidate;
    }
    return;
  }
  const std::size_t a = here.children, b = here.children + 1;
  const bool a_is_nearer =
      branches_[a].box.squaredExteriorDistance(p) <= branches_[b].box.squaredExteriorDistance(p);
  search(a_is_nearer ? a : b, p, best);
  search(a_is_nearer ? b : a, p, best);
}

void FaceTree::find(const Box &box, std::vector<std::size_t> &faces) const {
  faces.clear();
  std::vector<std::size_t> pending{0};
  while (!pending.empty()) {
    const Branch &here = branches_[pending.back()];
    pending.pop_back();
    if (!here.box.intersects(box))
      continue;
    if (here.children > 0) {
      pending.insert(pending.end(), {here.children, here.children + 1});
      continue;
    }
    for (std::size_t k = here.first; k < here.last; ++k)
      if (box_of(order_[k]).intersects(box))
        faces.push_back(order_[k]);
  }
}

FaceTree::Box FaceTree::box_of(std::size_t number) const {
  Box box;
  for (const int a : mesh_.face(number))
    box.extend(mesh_.point(static_cast<std::size_t>(a)));
  return box;
}

Projection FaceTree::project(const Vec<3> &p, std::size_t number) const {
  std::array<Vec<3>, 4> x;
  const auto nodes = mesh_.face(number);
  for (std::size_t a = 0; a < nodes.size(); ++a)
    x[a] = mesh_.point(static_cast<std::size_t>(nodes[a]));
  if (nodes.size() == 2)
    return project_on_segment<3>(p, x[0], x[1]);
  if (nodes.size() == 3)
    return project_on_triangle(p, std::span(x).first<3>());
  return project_on_quadrilateral(p, x);
}

} // namespace sluice::bridge
