// SPDX-License-Identifier: MIT
#include "bridge/overlap.hpp"

#include <Eigen/Dense>

#include <algorithm>
#include <cmath>
#include <numbers>

namespace sluice::bridge {

namespace {

// ---- segments -----------------------------------------------------------------------------------

void add_segments(const Facet &first, const Facet &second, std::vector<OverlapPoint> &points) {
  const Vec<3> along = first.x[1] - first.x[0], other = second.x[1] - second.x[0];
  const double square = along.squaredNorm();
  const double from = (second.x[0] - first.x[0]).dot(along) / square;
  const double to = (second.x[1] - first.x[0]).dot(along) / square;
  if (std::abs(along.dot(other)) < steepest * std::sqrt(square) * other.norm())
    return;
  const double low = std::max(0.0, std::min(from, to)), high = std::min(1.0, std::max(from, to));
  if (!(high > low))
    return;
  for (const double side : {-1.0, 1.0}) { // Gauss, two points
    const double s = 0.5 * (low + high) + side * 0.5 * (high - low) / std::numbers::sqrt3;
    const double t = (s - from) / (to - from);
    points.push_back({{1 - s, s, 0}, {1 - t, t, 0}, 0.5 * (high - low) * std::sqrt(square)});
  }
}

// ---- triangles ----------------------------------------------------------------------------------

// Barycentric coordinates in the plane of the first triangle: the weights of its second and third
// corner. The first triangle is b >= 0, c >= 0, b + c <= 1.
struct Polygon {
  std::array<Vec<2>, 8> corners;
  std::size_t n = 0;
  void add(const Vec<2> &p) { corners[n++] = p; }
};

// The part where `inside` (linear) is not negative.
template <class Inside> Polygon clipped(const Polygon &polygon, Inside &&inside) {
  Polygon result;
  for (std::size_t k = 0; k < polygon.n; ++k) {
    const Vec<2> &p = polygon.corners[k], &q = polygon.corners[(k + 1) % polygon.n];
    const double at_p = inside(p), at_q = inside(q);
    if (at_p >= 0)
      result.add(p);
    if ((at_p > 0 && at_q < 0) || (at_p < 0 && at_q > 0))
      result.add(p + at_p / (at_p - at_q) * (q - p));
  }
  return result;
}

Polygon common_part(const std::array<Vec<2>, 3> &triangle) {
  Polygon polygon;
  for (const Vec<2> &p : triangle)
    polygon.add(p);
  polygon = clipped(polygon, [](const Vec<2> &p) { return p.x(); });
  polygon = clipped(polygon, [](const Vec<2> &p) { return p.y(); });
  return clipped(polygon, [](const Vec<2> &p) { return 1 - p.x() - p.y(); });
}

void add_triangles(const Facet &first, const Facet &second, std::vector<OverlapPoint> &points) {
  const Vec<3> u = first.x[1] - first.x[0], v = first.x[2] - first.x[0], normal = u.cross(v);
  const Vec<3> other = (second.x[1] - second.x[0]).cross(second.x[2] - second.x[0]);
  if (std::abs(normal.dot(other)) < steepest * normal.norm() * other.norm())
    return;
  const double uu = u.dot(u), uv = u.dot(v), vv = v.dot(v), area = uu * vv - uv * uv;
  std::array<Vec<2>, 3> x;
  for (std::size_t a = 0; a < 3; ++a) {
    const Vec<3> w = second.x[a] - first.x[0];
    x[a] = {(vv * u.dot(w) - uv * v.dot(w)) / area, (uu * v.dot(w) - uv * u.dot(w)) / area};
  }
  const Polygon polygon = common_part(x);
  const Vec<2> e = x[1] - x[0], f = x[2] - x[0];
  const double determinant = cross(e, f);
  const auto add = [&](const Vec<2> &p, double weight) {
    const double s = cross(p - x[0], f) / determinant, t = cross(e, p - x[0]) / determinant;
    points.push_back({{1 - p.x() - p.y(), p.x(), p.y()}, {1 - s - t, s, t}, weight});
  };
  for (std::size_t k = 1; k + 1 < polygon.n; ++k) {
    const Vec<2> &a = polygon.corners[0], &b = polygon.corners[k], &c = polygon.corners[k + 1];
    const double piece = 0.5 * std::abs(cross(b - a, c - a)) * std::sqrt(area);
    if (!(piece > 0))
      continue;
    add(0.5 * (a + b), piece / 3); // middles of the edges: exact for second degree
    add(0.5 * (b + c), piece / 3);
    add(0.5 * (c + a), piece / 3);
  }
}

} // namespace

void add_overlap(const Facet &first, const Facet &second, std::vector<OverlapPoint> &points) {
  if (first.corners == 2)
    add_segments(first, second, points);
  else
    add_triangles(first, second, points);
}

} // namespace sluice::bridge
