// SPDX-License-Identifier: MIT
// The Voronoi cell of one point, cut out of a box by half-spaces: perpendicular bisectors towards
// the neighbours and the tangent planes of walls. Its volume is what the point stands for, its
// centroid tells where the point should be, and a far corner tells that air is near: there is an
// empty ball of that radius through the point (the alpha shape of the cloud).
//
// In the plane the cell is a polygon, clipped along its outline. In space it is a simple polyhedron
// that is known by its corners alone: each is where three faces meet, and is written as their
// numbers, counter-clockwise seen from outside. A cut removes corners; every edge between a corner
// that goes and one that stays gets a new one. Nothing is allocated. Source: N. Ray, D. Sokolov, S.
// Lefebvre, B. Levy, ACM Trans. Graph. 37 (2018) 265; corners found along the edges, and the sums
// over them, are ours.
#pragma once

#include "bridge/base/vec.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>

namespace sluice::fluid {

/// Convex polygon or polyhedron around the origin, in coordinates relative to the point.
template <int dim> class VoronoiCell;

template <> class VoronoiCell<2> {
public:
  /// The square [-half_width, half_width]^2 [m].
  explicit VoronoiCell(double half_width);

  /// Whose edge an edge is, where nobody was named.
  static constexpr int nobody = -1;

  /// Keeps the part with normal . x <= offset; `normal` is a unit vector, offset > 0 [m]. The new
  /// edge is `whose`.
  void cut(const Vec<2> &normal, double offset, int whose = nobody);

  int size() const { return size_; }
  const Vec<2> &corner(int k) const { return corner_[k]; }
  /// Whose the edge from corner k to the next one is.
  int edge_of(int k) const { return edge_[k]; }
  /// Distance of the farthest corner [m].
  double reach() const { return reach_; }
  double volume() const;   ///< [m^2]
  Vec<2> centroid() const; ///< relative to the point [m]

private:
  static constexpr int capacity = 32;
  std::array<Vec<2>, capacity> corner_;
  std::array<int, capacity> edge_;
  int size_ = 4;
  double reach_;
};

template <> class VoronoiCell<3> {
public:
  /// The cube [-half_width, half_width]^3 [m].
  explicit VoronoiCell(double half_width);

  /// Keeps the part with normal . x <= offset; `normal` is a unit vector, offset > 0 [m]. A cut
  /// that takes off less than 1e-12 of the reach is none: where more than three faces would meet in
  /// a corner, they do so in several corners at one place.
  void cut(const Vec<3> &normal, double offset);

  int size() const { return size_; }
  const Vec<3> &corner(int k) const { return corner_[k]; }
  /// Distance of the farthest corner [m].
  double reach() const { return reach_; }
  double volume() const { return moments().volume; } ///< [m^3]
  Vec<3> centroid() const;                           ///< relative to the point [m]

private:
  using Face = std::uint8_t;
  using Triple = std::array<Face, 3>;
  static constexpr int most_faces = 64, most_corners = 128;

  struct Moments {
    double volume = 0;             // [m^3]
    Vec<3> first = Vec<3>::Zero(); // integral of x [m^4]
  };
  Moments moments() const;
  int unused_face() const;
  void set_corner(int k, const Vec<3> &x, const Triple &faces);

  std::array<Vec<3>, most_corners> corner_;
  std::array<Triple, most_corners> faces_;
  /// after_[p][q]: the corner at which the outline of face p leaves the edge that it shares with q;
  /// its faces are p, q and the next one along the outline. Holds for edges of the cell.
  std::array<std::array<std::uint8_t, most_faces>, most_faces> after_;
  int size_ = 0;
  double reach_ = 0;
};

/// Cuts along the perpendicular bisector towards the neighbour j at r; skipped when out of reach.
template <int dim> void cut_towards(VoronoiCell<dim> &cell, const Vec<dim> &r, int j = 0) {
  const double distance = r.norm();
  if (!(distance > 1e-12 && distance < 2 * cell.reach()))
    return;
  if constexpr (dim == 2)
    cell.cut(r / distance, 0.5 * distance, j);
  else
    cell.cut(r / distance, 0.5 * distance);
}

// --- polygon ------------------------------------------------------------------------------------

inline VoronoiCell<2>::VoronoiCell(double w) : reach_(std::sqrt(2.0) * w) {
  corner_[0] = {-w, -w};
  corner_[1] = {w, -w};
  corner_[2] = {w, w};
  corner_[3] = {-w, w};
  std::fill_n(edge_.begin(), 4, nobody);
}

inline void VoronoiCell<2>::cut(const Vec<2> &normal, double offset, int whose) {
  std::array<double, capacity> height;
  bool any_outside = false;
  for (int k = 0; k < size_; ++k) {
    height[k] = normal.dot(corner_[k]) - offset;
    any_outside = any_outside || height[k] > 0;
  }
  if (!any_outside)
    return;
  std::array<Vec<2>, capacity> old;
  std::array<int, capacity> old_edge;
  std::copy_n(corner_.begin(), size_, old.begin());
  std::copy_n(edge_.begin(), size_, old_edge.begin());
  int n = 0;
  double reach2 = 0;
  const auto push = [&](const Vec<2> &x, int edge) {
    if (n == capacity)
      return;
    corner_[n] = x;
    edge_[n++] = edge;
    reach2 = std::max(reach2, x.squaredNorm());
  };
  for (int k = 0; k < size_; ++k) {
    const int m = k + 1 == size_ ? 0 : k + 1;
    if (height[k] <= 0)
      push(old[k], old_edge[k]);
    if ((height[k] <= 0) != (height[m] <= 0))
      push(old[k] + height[k] / (height[k] - height[m]) * (old[m] - old[k]),
           height[k] <= 0 ? whose : old_edge[k]);
  }
  size_ = n;
  reach_ = std::sqrt(reach2);
}

inline double VoronoiCell<2>::volume() const {
  double twice = 0;
  for (int k = 0; k < size_; ++k)
    twice += cross(corner_[k], corner_[k + 1 == size_ ? 0 : k + 1]);
  return 0.5 * twice;
}

inline Vec<2> VoronoiCell<2>::centroid() const {
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

// --- polyhedron ---------------------------------------------------------------------------------

inline VoronoiCell<3>::VoronoiCell(double w) : reach_(std::sqrt(3.0) * w) {
  // Faces 0 .. 5: low x, high x, low y, high y, low z, high z.
  for (int k = 0; k < 8; ++k) {
    const int x = k & 1, y = k >> 1 & 1, z = k >> 2;
    const Face a = static_cast<Face>(x), b = static_cast<Face>(2 + y), c = static_cast<Face>(4 + z);
    const bool odd = (x + y + z) % 2 != 0;
    set_corner(size_++, {x ? w : -w, y ? w : -w, z ? w : -w},
               odd ? Triple{a, b, c} : Triple{a, c, b});
  }
}

inline void VoronoiCell<3>::set_corner(int k, const Vec<3> &x, const Triple &f) {
  corner_[k] = x;
  faces_[k] = f;
  for (int m = 0; m < 3; ++m)
    after_[f[m]][f[(m + 1) % 3]] = static_cast<std::uint8_t>(k);
}

inline int VoronoiCell<3>::unused_face() const {
  std::uint64_t used = 0;
  for (int k = 0; k < size_; ++k)
    for (const Face f : faces_[k])
      used |= std::uint64_t{1} << f;
  int f = 0;
  while (f < most_faces && (used >> f & 1) != 0)
    ++f;
  return f;
}

inline void VoronoiCell<3>::cut(const Vec<3> &normal, double offset) {
  std::array<double, most_corners> height;
  std::array<std::uint8_t, most_corners> outside;
  const double tolerance = 1e-12 * reach_;
  int n_outside = 0;
  for (int k = 0; k < size_; ++k) {
    height[k] = normal.dot(corner_[k]) - offset;
    if (height[k] > tolerance)
      outside[n_outside++] = static_cast<std::uint8_t>(k);
  }
  const int face = n_outside > 0 ? unused_face() : most_faces;
  if (face == most_faces || n_outside == size_)
    return;
  std::array<Vec<3>, most_corners> added;
  std::array<Triple, most_corners> added_faces;
  int n_added = 0;
  for (int m = 0; m < n_outside; ++m) {
    const int out = outside[m];
    const Triple &f = faces_[out];
    for (int e = 0; e < 3; ++e) {
      const Face p = f[e], q = f[(e + 1) % 3];
      const int in = after_[q][p]; // the other end of the edge between p and q
      if (height[in] > tolerance)
        continue;
      const double t = std::max(height[out] / (height[out] - height[in]), 0.0);
      added[n_added] = corner_[out] + std::min(t, 1.0) * (corner_[in] - corner_[out]);
      added_faces[n_added++] = {p, q, static_cast<Face>(face)};
    }
  }
  if (size_ - n_outside + n_added > most_corners)
    return;
  // New corners take the places of those that go; what is left over is filled from the end.
  int next = 0;
  for (; next < n_added; ++next)
    set_corner(next < n_outside ? outside[next] : size_++, added[next], added_faces[next]);
  for (int m = n_outside - 1; m >= next; --m) {
    const int last = --size_;
    if (outside[m] != last)
      set_corner(outside[m], corner_[last], faces_[last]);
  }
  double reach2 = 0;
  for (int k = 0; k < size_; ++k)
    reach2 = std::max(reach2, corner_[k].squaredNorm());
  reach_ = std::sqrt(reach2);
}

// Sum over the faces of the pyramids above them, each cut into tetrahedra around one of its
// corners.
inline VoronoiCell<3>::Moments VoronoiCell<3>::moments() const {
  std::array<const Vec<3> *, most_faces> base{};
  for (int k = 0; k < size_; ++k)
    for (const Face f : faces_[k])
      base[f] = &corner_[k];
  Moments sum;
  for (int k = 0; k < size_; ++k)
    for (int e = 0; e < 3; ++e) {
      const Face p = faces_[k][e], r = faces_[k][(e + 2) % 3];
      const Vec<3> &a = *base[p], &b = corner_[k], &c = corner_[after_[p][r]];
      const double volume = a.dot(cross(b, c)) / 6;
      sum.volume += volume;
      sum.first += 0.25 * volume * (a + b + c);
    }
  return sum;
}

inline Vec<3> VoronoiCell<3>::centroid() const {
  const Moments sum = moments();
  return sum.volume > 0 ? Vec<3>(sum.first / sum.volume) : Vec<3>(Vec<3>::Zero());
}

} // namespace sluice::fluid
