// SPDX-License-Identifier: MIT
#include "bridge/projection.hpp"

#include <Eigen/Dense>

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

namespace sluice::bridge {

namespace {

using Corners = std::span<const Vec<3>>;

// The last weight is what the others leave, so that the sum is one to the last bit or two.
Projection weighted(const Vec<3> &p, Corners corners, std::array<double, 4> weights) {
  Vec<3> q = Vec<3>::Zero();
  for (std::size_t a = 0; a < corners.size(); ++a)
    q += weights[a] * corners[a];
  return {weights, (p - q).squaredNorm()};
}

// Nearest point on the rim of the face.
Projection project_on_edges(const Vec<3> &p, Corners corners) {
  Projection best;
  best.distance_squared = std::numeric_limits<double>::infinity();
  for (std::size_t a = 0; a < corners.size(); ++a) {
    const std::size_t b = (a + 1) % corners.size();
    const Projection edge = project_on_segment<3>(p, corners[a], corners[b]);
    if (edge.distance_squared >= best.distance_squared)
      continue;
    best = {};
    best.weights[a] = edge.weights[0];
    best.weights[b] = edge.weights[1];
    best.distance_squared = edge.distance_squared;
  }
  return best;
}

// Bilinear patch q(r, s) = sum N_a(r, s) x_a over the unit square, and its derivatives.
struct Patch {
  Corners x;
  static std::array<double, 4> weights(double r, double s) {
    return {(1 - r) * (1 - s), r * (1 - s), r * s, (1 - r) * s};
  }
  Vec<3> point(double r, double s) const {
    const auto w = weights(r, s);
    return w[0] * x[0] + w[1] * x[1] + w[2] * x[2] + w[3] * x[3];
  }
  Vec<3> along_r(double s) const { return (1 - s) * (x[1] - x[0]) + s * (x[2] - x[3]); }
  Vec<3> along_s(double r) const { return (1 - r) * (x[3] - x[0]) + r * (x[2] - x[1]); }
  Vec<3> mixed() const { return x[0] - x[1] + x[2] - x[3]; }
};

// Stationary point of |p - q(r, s)|^2 by Newton's method, as far as it got; nothing when the patch
// is degenerate. Convergence is quadratic: after a step of 1e-12 the next one is below rounding.
std::optional<Vec<2>> stationary_point(const Vec<3> &p, const Patch &patch) {
  Vec<2> rs(0.5, 0.5);
  for (int k = 0; k < 30; ++k) {
    const Vec<3> gap = p - patch.point(rs.x(), rs.y());
    const Vec<3> qr = patch.along_r(rs.y()), qs = patch.along_s(rs.x());
    const Vec<2> gradient(gap.dot(qr), gap.dot(qs));
    Mat<2> hessian;
    const double twist = qr.dot(qs) - gap.dot(patch.mixed());
    hessian << qr.squaredNorm(), twist, twist, qs.squaredNorm();
    const Vec<2> step = hessian.inverse() * gradient;
    if (!step.allFinite())
      return std::nullopt;
    rs += step;
    if (step.norm() <= 1e-12 * (1 + rs.norm()))
      break;
  }
  return rs;
}

} // namespace

template <int dim>
Projection project_on_segment(const Vec<dim> &p, const Vec<dim> &a, const Vec<dim> &b) {
  const Vec<dim> edge = b - a;
  const double t = std::clamp((p - a).dot(edge) / edge.squaredNorm(), 0.0, 1.0);
  return {{1 - t, t, 0, 0}, (p - a - t * edge).squaredNorm()};
}
template Projection project_on_segment<2>(const Vec<2> &, const Vec<2> &, const Vec<2> &);
template Projection project_on_segment<3>(const Vec<3> &, const Vec<3> &, const Vec<3> &);

Projection project_on_triangle(const Vec<3> &p, std::span<const Vec<3>, 3> corners) {
  const Vec<3> u = corners[1] - corners[0], v = corners[2] - corners[0], w = p - corners[0];
  const double uu = u.dot(u), uv = u.dot(v), vv = v.dot(v), wu = w.dot(u), wv = w.dot(v);
  const double area = uu * vv - uv * uv;
  const double b = (vv * wu - uv * wv) / area, c = (uu * wv - uv * wu) / area;
  if (b >= 0 && c >= 0 && b + c <= 1)
    return weighted(p, corners, {1 - b - c, b, c, 0});
  return project_on_edges(p, corners);
}

// About the first corner: the differences of which everything is made are then exact to the size of
// the face, not to its distance from the origin.
Projection project_on_quadrilateral(const Vec<3> &point, std::span<const Vec<3>, 4> nodes) {
  const Vec<3> p = point - nodes[0];
  const std::array<Vec<3>, 4> corners{Vec<3>::Zero(), nodes[1] - nodes[0], nodes[2] - nodes[0],
                                      nodes[3] - nodes[0]};
  const Projection rim = project_on_edges(p, corners);
  const auto rs = stationary_point(p, Patch{corners});
  if (!rs || rs->minCoeff() < 0 || rs->maxCoeff() > 1)
    return rim;
  const Projection inner = weighted(p, corners, Patch::weights(rs->x(), rs->y()));
  return inner.distance_squared <= rim.distance_squared ? inner : rim;
}

} // namespace sluice::bridge
