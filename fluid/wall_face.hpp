// SPDX-License-Identifier: MIT
// Geometry of one face of a wall: a segment a b in the plane with the fluid on its left, a triangle
// a b c in space, counter-clockwise seen from the fluid. Nearest point, normal, crossing by a line,
// quadrature. A side of a segment is one of its ends, of a triangle one of its edges.
#pragma once

#include "bridge/base/vec.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <tuple>

namespace sluice::fluid {

/// Corners of a face [m].
template <int dim> using Corners = std::array<Vec<dim>, dim>;
/// Linear shape functions of the corners at a place on the face; they sum to one.
template <int dim> using Shape = std::array<double, dim>;

/// sum_k shape_k value_k
template <class Value> Value interpolated(const Shape<2> &shape, const Value &a, const Value &b) {
  return shape[0] * a + shape[1] * b;
}
template <class Value>
Value interpolated(const Shape<3> &shape, const Value &a, const Value &b, const Value &c) {
  return shape[0] * a + shape[1] * b + shape[2] * c;
}

/// A part of a face: its inside, side k (of a triangle from corner k to the next), or a corner that
/// is not itself a side.
class FacePart {
public:
  static FacePart inside() { return FacePart(-1); }
  static FacePart side(int k) { return FacePart(k); }
  static FacePart corner(int k) { return FacePart(3 + k); }
  bool is_inside() const { return part_ < 0; }
  bool is_side() const { return part_ >= 0 && part_ < 3; }
  /// Number of the side or of the corner.
  int number() const { return part_ % 3; }
  bool operator==(const FacePart &) const = default;

private:
  explicit FacePart(int part) : part_(part) {}
  int part_;
};

/// The point of a face that is nearest to another point.
template <int dim> struct Foot {
  Vec<dim> point; // [m]
  Shape<dim> shape;
  FacePart part;
};

/// Normal into the fluid, of length one.
inline Vec<2> face_normal(const Corners<2> &c) { return rotated_left((c[1] - c[0]).normalized()); }
inline Vec<3> face_normal(const Corners<3> &c) {
  return cross(Vec<3>(c[1] - c[0]), Vec<3>(c[2] - c[0])).normalized();
}

/// Length or area [m, m^2].
inline double face_measure(const Corners<2> &c) { return (c[1] - c[0]).norm(); }
inline double face_measure(const Corners<3> &c) {
  return 0.5 * cross(Vec<3>(c[1] - c[0]), Vec<3>(c[2] - c[0])).norm();
}

/// Where on a segment its nearest point lies: 0 at `a`, 1 at `b`.
template <int dim>
double nearest_fraction(const Vec<dim> &a, const Vec<dim> &b, const Vec<dim> &x) {
  const Vec<dim> e = b - a;
  return std::clamp((x - a).dot(e) / e.squaredNorm(), 0.0, 1.0);
}

inline Foot<2> nearest_on_face(const Corners<2> &c, const Vec<2> &x) {
  const double t = nearest_fraction(c[0], c[1], x);
  const FacePart part = t <= 0   ? FacePart::side(0)
                        : t >= 1 ? FacePart::side(1)
                                 : FacePart::inside();
  return {c[0] + t * (c[1] - c[0]), {1 - t, t}, part};
}

/// Order of two corners that does not depend on the face: both faces of an edge compute with the
/// same numbers, and agree on what is nearest.
inline bool is_ordered(const Vec<3> &a, const Vec<3> &b) {
  return std::tie(a.x(), a.y(), a.z()) < std::tie(b.x(), b.y(), b.z());
}

/// The nearest point of side k.
inline Foot<3> nearest_on_side(const Corners<3> &c, int k, const Vec<3> &x) {
  const int m = (k + 1) % 3;
  const bool ordered = is_ordered(c[k], c[m]);
  const Vec<3> &a = ordered ? c[k] : c[m], &b = ordered ? c[m] : c[k];
  const double t = nearest_fraction(a, b, x), along = ordered ? t : 1 - t;
  Foot<3> foot{a + t * (b - a), {0, 0, 0}, FacePart::side(k)};
  foot.shape[k] = 1 - along;
  foot.shape[m] = along;
  if (t <= 0 || t >= 1) {
    const int corner = (t <= 0) == ordered ? k : m;
    foot = {c[corner], {0, 0, 0}, FacePart::corner(corner)};
    foot.shape[corner] = 1;
  }
  return foot;
}

inline Foot<3> nearest_on_face(const Corners<3> &c, const Vec<3> &x) {
  const Vec<3> e = c[1] - c[0], f = c[2] - c[0], d = x - c[0], n = cross(e, f);
  const double n2 = n.squaredNorm();
  const double t = n.dot(cross(d, f)) / n2, s = n.dot(cross(e, d)) / n2;
  if (t > 0 && s > 0 && 1 - t - s > 0)
    return {c[0] + t * e + s * f, {1 - t - s, t, s}, FacePart::inside()};
  Foot<3> nearest = nearest_on_side(c, 0, x);
  for (int k = 1; k < 3; ++k) {
    const Foot<3> foot = nearest_on_side(c, k, x);
    const double distance2 = (foot.point - x).squaredNorm();
    const double least2 = (nearest.point - x).squaredNorm();
    if (distance2 < least2 || (distance2 == least2 && !foot.part.is_side()))
      nearest = foot;
  }
  return nearest;
}

/// True when the straight line from `from` to `to` goes through the face. A line through a side
/// that two faces share goes through one of them.
inline bool is_crossed(const Corners<2> &c, const Vec<2> &from, const Vec<2> &to) {
  const Vec<2> path = to - from;
  const Vec<2> a = c[0] - from, b = c[1] - from;
  const double side_a = cross(path, a), side_b = cross(path, b);
  if ((side_a > 0) == (side_b > 0))
    return false;
  const Vec<2> e = b - a;
  const double start = cross(e, Vec<2>(-a)), end = cross(e, Vec<2>(path - a));
  return (start > 0) != (end > 0);
}

/// Does the line pass the edge from a to b on its left? The same numbers whichever way round the
/// edge is asked for.
inline bool passes_left(const Vec<3> &from, const Vec<3> &path, const Vec<3> &a, const Vec<3> &b) {
  if (!is_ordered(a, b))
    return !(path.dot(cross(Vec<3>(b - from), Vec<3>(a - from))) > 0);
  return path.dot(cross(Vec<3>(a - from), Vec<3>(b - from))) > 0;
}

inline bool is_crossed(const Corners<3> &c, const Vec<3> &from, const Vec<3> &to) {
  const Vec<3> n = cross(Vec<3>(c[1] - c[0]), Vec<3>(c[2] - c[0]));
  if ((n.dot(from - c[0]) > 0) == (n.dot(to - c[0]) > 0))
    return false;
  const Vec<3> path = to - from;
  const bool side = passes_left(from, path, c[0], c[1]);
  return passes_left(from, path, c[1], c[2]) == side && passes_left(from, path, c[2], c[0]) == side;
}

/// Calls visit(shape, weight) for the points of a quadrature over pieces no longer than `longest`
/// [m]; exact for the product of two linear functions on each piece. Left out are parts of the face
/// for whose corners concerns(corners) is false. Two Gauss points on pieces of equal length.
template <class Visit, class Concerns>
void for_each_quadrature_point(const Corners<2> &c, double longest, Visit &&visit,
                               Concerns &&concerns) {
  const double length = face_measure(c);
  const int pieces = std::max(1, static_cast<int>(std::ceil(length / longest)));
  const double gauss = 0.5 / std::sqrt(3.0);
  const auto at = [&](double t) { return Vec<2>((1 - t) * c[0] + t * c[1]); };
  const auto halve = [&](const auto &self, int first, int last) -> void {
    if (!concerns(Corners<2>{at(double(first) / pieces), at(double(last) / pieces)}))
      return;
    if (last - first > 1) {
      const int middle = (first + last) / 2;
      self(self, first, middle);
      self(self, middle, last);
      return;
    }
    for (const double offset : {-gauss, gauss}) {
      const double t = (first + 0.5 + offset) / pieces;
      visit(Shape<2>{1 - t, t}, 0.5 * length / pieces);
    }
  };
  halve(halve, 0, pieces);
}

/// Three points on triangles that come from halving the longest edge.
template <class Visit, class Concerns>
void for_each_quadrature_point(const Corners<3> &c, double longest, Visit &&visit,
                               Concerns &&concerns) {
  const auto mean = [](const Shape<3> &a, double w, const Shape<3> &b) {
    Shape<3> m;
    for (int k = 0; k < 3; ++k)
      m[k] = (1 - w) * a[k] + w * b[k];
    return m;
  };
  const auto at = [&](const Shape<3> &s) { return interpolated<Vec<3>>(s, c[0], c[1], c[2]); };
  const auto halve = [&](const auto &self, const std::array<Shape<3>, 3> &piece,
                         double area) -> void {
    int widest = 0;
    double length = 0;
    for (int k = 0; k < 3; ++k)
      if (const double l = (at(piece[(k + 1) % 3]) - at(piece[k])).norm(); l > length) {
        widest = k;
        length = l;
      }
    const Shape<3> &a = piece[widest], &b = piece[(widest + 1) % 3], &top = piece[(widest + 2) % 3];
    const Shape<3> middle = mean(a, 0.5, b);
    if (!concerns(Corners<3>{at(piece[0]), at(piece[1]), at(piece[2])}))
      return;
    if (length > longest) {
      self(self, {a, middle, top}, 0.5 * area);
      self(self, {middle, b, top}, 0.5 * area);
      return;
    }
    const Shape<3> centre = mean(middle, 1.0 / 3, top);
    for (const Shape<3> &corner : piece)
      visit(mean(corner, 0.5, centre), area / 3);
  };
  halve(halve, {Shape<3>{1, 0, 0}, Shape<3>{0, 1, 0}, Shape<3>{0, 0, 1}}, face_measure(c));
}

/// The same over the whole face.
template <class FaceCorners, class Visit>
void for_each_quadrature_point(const FaceCorners &c, double longest, Visit &&visit) {
  for_each_quadrature_point(c, longest, visit, [](const FaceCorners &) { return true; });
}

} // namespace sluice::fluid
