// SPDX-License-Identifier: MIT
// The Voronoi cell of one point, cut out of a box by half-planes: perpendicular bisectors towards
// the neighbours and the tangent planes of walls. Its area is the volume that the point stands for,
// its centroid tells where the point should be, and a far corner tells that air is near: there is
// an empty circle of that radius through the point (the alpha shape of the cloud).
#pragma once

#include "bridge/base/vec.hpp"

#include <algorithm>
#include <array>
#include <cmath>

namespace sluice::fluid {

/// Convex polygon around the origin, in coordinates relative to the point.
class VoronoiCell {
public:
  /// The square [-half_width, half_width]^2 [m].
  explicit VoronoiCell(double half_width);

  /// Keeps the part with normal . x <= offset; `normal` is a unit vector, offset > 0 [m].
  void cut(const Vec<2> &normal, double offset);
  /// Cuts along the perpendicular bisector towards a neighbour at r; skipped when out of reach.
  void cut_towards(const Vec<2> &r) {
    const double distance = r.norm();
    if (distance > 1e-12 && distance < 2 * reach_)
      cut(r / distance, 0.5 * distance);
  }

  int size() const { return size_; }
  const Vec<2> &corner(int k) const { return corner_[k]; }
  /// Distance of the farthest corner [m].
  double reach() const { return reach_; }
  double area() const;     ///< [m^2]
  Vec<2> centroid() const; ///< relative to the point [m]

private:
  static constexpr int capacity = 32;
  std::array<Vec<2>, capacity> corner_;
  int size_ = 4;
  double reach_;
};

inline VoronoiCell::VoronoiCell(double w) : reach_(std::sqrt(2.0) * w) {
  corner_[0] = {-w, -w};
  corner_[1] = {w, -w};
  corner_[2] = {w, w};
  corner_[3] = {-w, w};
}

inline void VoronoiCell::cut(const Vec<2> &normal, double offset) {
  std::array<double, capacity> height;
  bool any_outside = false;
  for (int k = 0; k < size_; ++k) {
    height[k] = normal.dot(corner_[k]) - offset;
    any_outside = any_outside || height[k] > 0;
  }
  if (!any_outside)
    return;
  std::array<Vec<2>, capacity> old;
  std::copy_n(corner_.begin(), size_, old.begin());
  int n = 0;
  double reach2 = 0;
  const auto push = [&](const Vec<2> &x) {
    if (n == capacity)
      return;
    corner_[n++] = x;
    reach2 = std::max(reach2, x.squaredNorm());
  };
  for (int k = 0; k < size_; ++k) {
    const int m = k + 1 == size_ ? 0 : k + 1;
    if (height[k] <= 0)
      push(old[k]);
    if ((height[k] <= 0) != (height[m] <= 0))
      push(old[k] + height[k] / (height[k] - height[m]) * (old[m] - old[k]));
  }
  size_ = n;
  reach_ = std::sqrt(reach2);
}

inline double VoronoiCell::area() const {
  double twice = 0;
  for (int k = 0; k < size_; ++k)
    twice += cross(corner_[k], corner_[k + 1 == size_ ? 0 : k + 1]);
  return 0.5 * twice;
}

inline Vec<2> VoronoiCell::centroid() const {
  Vec<2> moment = Vec<2>::Zero();
  double twice = 0;
  for (int k = 0; k < size_; ++k) {
    const Vec<2> &a = corner_[k], &b = corner_[k + 1 == size_ ? 0 : k + 1];
    const double c = cross(a, b);
    moment += c * (a + b);
    twice += c;
  }
  return twice > 0 ? Vec<2>(moment / (3 * twice)) : Vec<2>::Zero();
}

} // namespace sluice::fluid
