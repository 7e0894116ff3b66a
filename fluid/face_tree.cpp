// SPDX-License-Identifier: MIT
#include "fluid/face_tree.hpp"

#include "fluid/walls.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>

namespace sluice::fluid {

namespace {

// Faces of a node without descendants.
constexpr int most_together = 1;
// Boxes are wider by this part of the largest coordinate, cones by this angle [rad]: more than
// rounding moves a foot.
constexpr double box_margin = 1e-12, angle_margin = 1e-5;

constexpr double no_bound = std::numbers::pi;

/// Normals within an angle [rad] of an axis; beyond a right angle they say nothing.
template <int dim> struct Cone {
  Vec<dim> axis;
  double angle;
};

double angle_between(const auto &a, const auto &b) {
  return std::acos(std::clamp(a.dot(b), -1.0, 1.0));
}

template <int dim> Cone<dim> around_both(const Cone<dim> &a, const Cone<dim> &b) {
  const Vec<dim> sum = a.axis + b.axis;
  const double length = sum.norm();
  if (a.angle >= no_bound || b.angle >= no_bound || length < 0.1)
    return {a.axis, no_bound};
  const Vec<dim> axis = sum / length;
  return {axis,
          std::max(a.angle + angle_between(a.axis, axis), b.angle + angle_between(b.axis, axis))};
}

// Calls visit(face) for the faces around the corners of one, itself among them.
template <int dim, class Visit>
void for_each_around(const Walls<dim> &walls, const WallFace<dim> &f, Visit &&visit) {
  if constexpr (dim == 2)
    for (const int other : f.beyond)
      visit(other);
  else
    for (const int v : f.vertex)
      for (int k = walls.around_start[v]; k < walls.around_start[v + 1]; ++k)
        visit(walls.around[k]);
}

template <int dim> bool has_open_side(const WallFace<dim> &f) {
  return std::any_of(f.beyond.begin(), f.beyond.end(), [](int other) { return other < 0; });
}

// Directions from a face to points whose foot is there. At a border they are not bounded by
// normals.
template <int dim>
Cone<dim> cone_of(const Walls<dim> &walls, const std::vector<Vec<dim>> &normal, int face) {
  Cone<dim> cone{normal[face], 0};
  const auto bound = [&](int other) {
    if (has_open_side(walls.faces[other]))
      cone.angle = no_bound;
    else
      cone.angle = std::max(cone.angle, angle_between(normal[face], normal[other]));
  };
  bound(face);
  if (cone.angle < no_bound)
    for_each_around(walls, walls.faces[face], bound);
  return cone;
}

} // namespace

template <int dim> void FaceTree<dim>::update(const Walls<dim> &walls) {
  const bool is_new =
      face_.size() != walls.faces.size() || position_.size() != walls.position.size();
  if (!is_new && position_ == walls.position)
    return;
  position_ = walls.position;
  if (is_new)
    build(walls);
  fit_boxes(walls);
  fit_cones(walls);
}

template <int dim> void FaceTree<dim>::build(const Walls<dim> &walls) {
  std::vector<FaceBox> box;
  for (const WallFace<dim> &f : walls.faces) {
    box.push_back({walls.position[f.vertex[0]], walls.position[f.vertex[0]]});
    for (const int v : f.vertex)
      box.back().widen({walls.position[v], walls.position[v]});
  }
  face_.resize(walls.faces.size());
  std::iota(face_.begin(), face_.end(), 0);
  nodes_.clear();
  if (!face_.empty())
    split(box, 0, static_cast<int>(face_.size()));
}

// Into halves along the direction that makes the smallest boxes: long faces part from short ones.
template <int dim> void FaceTree<dim>::split(const std::vector<FaceBox> &box, int begin, int end) {
  const std::size_t node = nodes_.size();
  nodes_.emplace_back();
  nodes_[node].begin = begin;
  nodes_[node].end = end;
  if (end - begin > most_together) {
    const int half = (begin + end) / 2;
    const auto sort = [&](int d) {
      const auto middle = [&](int f) { return std::pair(box[f].low[d] + box[f].high[d], f); };
      const auto first = face_.begin();
      std::nth_element(first + begin, first + half, first + end,
                       [&](int f, int g) { return middle(f) < middle(g); });
    };
    const auto measure = [&](int from, int to) {
      FaceBox around = box[face_[from]];
      for (int f = from; f < to; ++f)
        around.widen(box[face_[f]]);
      return around.measure();
    };
    std::array<double, dim> cost;
    for (int d = 0; d < dim; ++d) {
      sort(d);
      cost[d] = measure(begin, half) + measure(half, end);
    }
    sort(static_cast<int>(std::min_element(cost.begin(), cost.end()) - cost.begin()));
    split(box, begin, half);
    split(box, half, end);
  }
  nodes_[node].next = static_cast<int>(nodes_.size());
}

// Descendants stand behind their node: from the last to the first those are known.
template <int dim> void FaceTree<dim>::fit_boxes(const Walls<dim> &walls) {
  double largest = 0;
  for (const Vec<dim> &x : position_)
    largest = std::max(largest, x.cwiseAbs().maxCoeff());
  const Vec<dim> margin = Vec<dim>::Constant(box_margin * largest);
  for (int k = static_cast<int>(nodes_.size()) - 1; k >= 0; --k) {
    Node &node = nodes_[k];
    Vec<dim> low, high;
    if (node.next == k + 1) {
      low = high = walls.position[walls.faces[face_[node.begin]].vertex[0]];
      for (int f = node.begin; f < node.end; ++f)
        for (const int v : walls.faces[face_[f]].vertex) {
          low = low.cwiseMin(walls.position[v] - margin);
          high = high.cwiseMax(walls.position[v] + margin);
        }
    } else {
      const Node &left = nodes_[k + 1], &right = nodes_[left.next];
      low = (left.centre - left.half).cwiseMin(right.centre - right.half);
      high = (left.centre + left.half).cwiseMax(right.centre + right.half);
    }
    node.centre = 0.5 * (low + high);
    node.half = 0.5 * (high - low);
  }
}

template <int dim> void FaceTree<dim>::fit_cones(const Walls<dim> &walls) {
  normal_.clear();
  for (const WallFace<dim> &f : walls.faces)
    normal_.push_back(walls.normal(f));
  for (int k = static_cast<int>(nodes_.size()) - 1; k >= 0; --k) {
    Node &node = nodes_[k];
    Cone<dim> cone;
    if (node.next == k + 1) {
      cone = cone_of(walls, normal_, face_[node.begin]);
      for (int f = node.begin + 1; f < node.end; ++f)
        cone = around_both(cone, cone_of(walls, normal_, face_[f]));
    } else {
      const Node &left = nodes_[k + 1], &right = nodes_[left.next];
      cone = around_both(Cone<dim>{left.axis, left.angle}, Cone<dim>{right.axis, right.angle});
    }
    node.axis = cone.axis;
    node.angle = cone.angle;
    const double widened = cone.angle + angle_margin;
    node.cos2 = widened < 0.5 * std::numbers::pi ? std::cos(widened) * std::cos(widened) : 0;
  }
}

template class FaceTree<2>;
template class FaceTree<3>;

} // namespace sluice::fluid
