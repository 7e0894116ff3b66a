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

#include "fluid/packs.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>

namespace sluice::fluid {

/// Convex polygon or polyhedron around the origin, in coordinates relative to the point.
template <int dim> class VoronoiCell;

/// Volume [m^dim] and centroid [m] of a cell.
template <int dim> struct CellMeasures {
  double volume;
  Vec<dim> centroid;
};

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
  CellMeasures<2> measures() const { return {volume(), centroid()}; }

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
  Vec<3> corner(int k) const { return {coordinate_[0][k], coordinate_[1][k], coordinate_[2][k]}; }
  /// Distance of the farthest corner [m].
  double reach() const { return reach_; }
  CellMeasures<3> measures() const;
  double volume() const { return measures().volume; }     ///< [m^3]
  Vec<3> centroid() const { return measures().centroid; } ///< relative to the point [m]

private:
  using Face = std::uint8_t;
  using Triple = std::array<Face, 3>;
  static constexpr int most_faces = 64, most_corners = 128;

  /// Lanes of the corners first .. first + 7 that there are.
  unsigned present(int first) const {
    return size_ - first < pack_size ? (1u << (size_ - first)) - 1 : (1u << pack_size) - 1;
  }
  Pack coordinates(int d, int first) const { return load(&coordinate_[d][first]); }
  int unused_face();
  void set_corner(int k, const Vec<3> &x, const Triple &faces);
  void update_reach();

  // Corners side by side, eight of which a plane is held against at a time.
  alignas(64) std::array<std::array<double, most_corners>, 3> coordinate_{};
  std::array<Triple, most_corners> faces_;
  /// after_[p][q]: the corner at which the outline of face p leaves the edge that it shares with q;
  /// its faces are p, q and the next one along the outline. Holds for edges of the cell.
  std::array<std::array<std::uint8_t, most_faces>, most_faces> after_;
  int size_ = 0, faces_used_ = 6; // numbers below were given to a face
  double reach_ = 0;
};

/// Cuts along the perpendicular bisector towards the neighbour j at r; skipped when out of reach.
template <int dim> void cut_towards(VoronoiCell<dim> &cell, const Vec<dim> &r, int j = 0) {
  const double distance2 = r.squaredNorm();
  if (!(distance2 > 1e-24 && distance2 < 4 * cell.reach() * cell.reach()))
    return;
  const double distance = std::sqrt(distance2);
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
  for (int d = 0; d < 3; ++d)
    coordinate_[d][k] = x[d];
  faces_[k] = f;
  for (int m = 0; m < 3; ++m)
    after_[f[m]][f[(m + 1) % 3]] = static_cast<std::uint8_t>(k);
}

// A number that no face has: a new one, or when these are used up one that was cut off.
inline int VoronoiCell<3>::unused_face() {
  if (faces_used_ < most_faces)
    return faces_used_++;
  std::uint64_t used = 0;
  for (int k = 0; k < size_; ++k)
    for (const Face f : faces_[k])
      used |= std::uint64_t{1} << f;
  return std::countr_one(used);
}

inline void VoronoiCell<3>::update_reach() {
  Pack farthest{};
  for (int first = 0; first < size_; first += pack_size) {
    Pack r2{};
    for (int d = 0; d < 3; ++d)
      r2 += coordinates(d, first) * coordinates(d, first);
    farthest = r2 > farthest ? r2 : farthest;
  }
  double reach2 = 0;
  for (int lane = 0; lane < pack_size; ++lane)
    reach2 = std::max(reach2, farthest[lane]);
  reach_ = std::sqrt(reach2);
}

inline void VoronoiCell<3>::cut(const Vec<3> &normal, double offset) {
  alignas(64) std::array<double, most_corners> height;
  std::array<std::uint8_t, most_corners> outside;
  const double tolerance = 1e-12 * reach_;
  int n_outside = 0;
  for (int first = 0; first < size_; first += pack_size) {
    const Pack h = normal[0] * coordinates(0, first) + normal[1] * coordinates(1, first) +
                   normal[2] * coordinates(2, first) - offset;
    store(h, &height[first]);
    for (unsigned lanes = bits_of(h > tolerance) & present(first); lanes != 0; lanes &= lanes - 1)
      outside[n_outside++] = static_cast<std::uint8_t>(first + std::countr_zero(lanes));
  }
  const int face = n_outside > 0 && n_outside < size_ ? unused_face() : most_faces;
  if (face == most_faces)
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
      added[n_added] = corner(out) + std::min(t, 1.0) * (corner(in) - corner(out));
      added_faces[n_added++] = {p, q, static_cast<Face>(face)};
    }
  }
  if (size_ - n_outside + n_added > most_corners)
    return;
  // New corners take the places of those that go; what is left over is filled from the end, which
  // leaves the origin there.
  int next = 0;
  for (; next < n_added; ++next)
    set_corner(next < n_outside ? outside[next] : size_++, added[next], added_faces[next]);
  for (int m = n_outside - 1; m >= next; --m) {
    const int last = --size_;
    if (outside[m] != last)
      set_corner(outside[m], corner(last), faces_[last]);
    for (int d = 0; d < 3; ++d)
      coordinate_[d][last] = 0;
  }
  update_reach();
}

// Sum over the faces of the pyramids above them, each cut into tetrahedra around one of its
// corners.
inline CellMeasures<3> VoronoiCell<3>::measures() const {
  std::array<std::uint8_t, most_faces> base;
  for (int k = 0; k < size_; ++k)
    for (const Face f : faces_[k])
      base[f] = static_cast<std::uint8_t>(k);
  double six_volumes = 0;
  Vec<3> moment = Vec<3>::Zero();
  for (int k = 0; k < size_; ++k)
    for (int e = 0; e < 3; ++e) {
      const Face p = faces_[k][e], r = faces_[k][(e + 2) % 3];
      const int from = base[p], next = after_[p][r];
      if (from == k || from == next)
        continue;
      const Vec<3> a = corner(from), b = corner(k), c = corner(next);
      const double volume = a.dot(cross(b, c));
      six_volumes += volume;
      moment += volume * (a + b + c);
    }
  return {six_volumes / 6,
          six_volumes > 0 ? Vec<3>(0.25 / six_volumes * moment) : Vec<3>(Vec<3>::Zero())};
}

} // namespace sluice::fluid
