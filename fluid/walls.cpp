// SPDX-License-Identifier: MIT
#include "fluid/walls.hpp"

#include "bridge/base/check.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace sluice::fluid {

namespace {

constexpr double cos_30_degrees = 0.866;

struct Foot {
  Vec<2> point;
  double t;
};

Foot nearest_on_segment(const Vec<2> &a, const Vec<2> &b, const Vec<2> &x) {
  const Vec<2> e = b - a;
  const double t = std::clamp((x - a).dot(e) / e.squaredNorm(), 0.0, 1.0);
  return {a + t * e, t};
}

Foot foot_on(const Walls &walls, int segment, const Vec<2> &x) {
  const WallSegment &s = walls.segments[segment];
  return nearest_on_segment(walls.position[s.a], walls.position[s.b], x);
}

// A foot is a local minimum of the distance along the outline unless it is a vertex from which
// the neighbouring segment comes nearer. A shared vertex is reported by the segment that ends in it.
bool is_local_minimum(const Walls &walls, int segment, const Foot &foot, const Vec<2> &x) {
  const WallSegment &s = walls.segments[segment];
  if (foot.t > 0 && foot.t < 1)
    return true;
  if (foot.t >= 1)
    return s.next < 0 || foot_on(walls, s.next, x).t <= 0;
  return s.previous < 0;
}

// Side of the wall at a foot: the segment's normal inside it, the mean normal at a shared vertex.
Vec<2> fluid_side(const Walls &walls, int segment, const Foot &foot) {
  const WallSegment &s = walls.segments[segment];
  if (foot.t >= 1 && s.next >= 0)
    return walls.normal(s) + walls.normal(walls.segments[s.next]);
  return walls.normal(s);
}

bool is_sharp_edge(const Walls &walls, int segment, const Foot &foot) {
  const WallSegment &s = walls.segments[segment];
  if (foot.t > 0 && foot.t < 1)
    return false;
  return foot.t <= 0 || s.next < 0 ||
         walls.tangent(s).dot(walls.tangent(walls.segments[s.next])) < cos_30_degrees;
}

Projection make_projection(const Walls &walls, int segment, const Foot &foot, const Vec<2> &x) {
  const Vec<2> side = fluid_side(walls, segment, foot);
  const Vec<2> offset = x - foot.point;
  const double length = offset.norm();
  const bool at_vertex = foot.t <= 0 || foot.t >= 1;
  const double sign = offset.dot(side) >= 0 ? 1.0 : -1.0;
  const Vec<2> normal = at_vertex && length > 1e-12
                            ? Vec<2>(-sign * offset / length)
                            : Vec<2>(-side.normalized());
  return {foot.point, normal, sign * length, foot.t, segment,
          is_sharp_edge(walls, segment, foot)};
}

// Candidates of one point, nearest first: their order on the outlines has no influence.
class NearestFirst {
public:
  void insert(const Projection &p) {
    if (count_ == most && std::abs(p.distance) >= std::abs(all_[most - 1].distance))
      return;
    int k = count_ < most ? count_++ : most - 1;
    for (; k > 0 && std::abs(all_[k - 1].distance) > std::abs(p.distance); --k)
      all_[k] = all_[k - 1];
    all_[k] = p;
  }
  /// The nearest of each direction.
  PointWalls by_direction() const {
    PointWalls found;
    for (int k = 0; k < count_ && found.count < static_cast<int>(found.projection.size()); ++k) {
      const bool is_new = std::none_of(found.begin(), found.end(), [&](const Projection &p) {
        return p.normal.dot(all_[k].normal) > cos_30_degrees;
      });
      if (is_new)
        found.projection[found.count++] = all_[k];
    }
    return found;
  }

private:
  static constexpr int most = 12;
  int count_ = 0;
  std::array<Projection, most> all_;
};

// The far face of a plate is behind its near face: not a wall of this point.
void drop_far_faces(PointWalls &found) {
  int kept = 0;
  for (int k = 0; k < found.count; ++k) {
    const Projection &p = found.projection[k];
    bool is_far_face = false;
    for (int m = 0; m < kept; ++m) {
      const Projection &near = found.projection[m];
      is_far_face = is_far_face || (p.distance < 0 && near.distance >= 0 &&
                                    near.normal.dot(p.point - near.point) > 0);
    }
    if (!is_far_face)
      found.projection[kept++] = p;
  }
  found.count = kept;
}

} // namespace

PointWalls project_on_walls(const Walls &walls, std::span<const int> candidates, const Vec<2> &x,
                            double reach) {
  NearestFirst nearest;
  for (const int s : candidates) {
    const Foot foot = foot_on(walls, s, x);
    if ((x - foot.point).squaredNorm() > reach * reach || !is_local_minimum(walls, s, foot, x))
      continue;
    nearest.insert(make_projection(walls, s, foot, x));
  }
  PointWalls found = nearest.by_direction();
  drop_far_faces(found);
  return found;
}

double distance_to_walls(const Walls &walls, const Vec<2> &x) {
  double nearest = std::numeric_limits<double>::infinity();
  for (int s = 0; s < static_cast<int>(walls.segments.size()); ++s)
    nearest = std::min(nearest, (foot_on(walls, s, x).point - x).norm());
  return nearest;
}

bool is_hidden(const Walls &walls, std::span<const int> candidates, const Vec<2> &from,
               const Vec<2> &to) {
  const Vec<2> path = to - from;
  for (const int k : candidates) {
    const WallSegment &s = walls.segments[k];
    const Vec<2> a = walls.position[s.a] - from, b = walls.position[s.b] - from;
    const double side_a = cross(path, a), side_b = cross(path, b);
    if ((side_a > 0) == (side_b > 0))
      continue;
    const Vec<2> e = b - a;
    const double start = cross(e, -a), end = cross(e, path - a);
    if ((start > 0) != (end > 0))
      return true;
  }
  return false;
}

namespace {

// Calls visit(cell) for every cell that the segment may come within `reach` of.
template <class Visit>
void for_each_cell_near(const Walls &walls, const WallSegment &s, const Grid &grid, double reach,
                        Visit &&visit) {
  const Vec<2> &a = walls.position[s.a], &b = walls.position[s.b];
  const Vec<2> low = a.cwiseMin(b).array() - reach, high = a.cwiseMax(b).array() + reach;
  const Vec<2> top = grid.origin + grid.cell_size * Vec<2>(grid.nx, grid.ny);
  if (high.x() < grid.origin.x() || high.y() < grid.origin.y() || low.x() > top.x() ||
      low.y() > top.y())
    return;
  const double limit = reach + 0.7072 * grid.cell_size;
  for (int y = grid.row(low.y()); y <= grid.row(high.y()); ++y)
    for (int x = grid.column(low.x()); x <= grid.column(high.x()); ++x) {
      const Vec<2> centre = grid.origin + grid.cell_size * Vec<2>(x + 0.5, y + 0.5);
      if ((nearest_on_segment(a, b, centre).point - centre).squaredNorm() <= limit * limit)
        visit(y * grid.nx + x);
    }
}

} // namespace

void find_near_segments(const Walls &walls, const Grid &grid, double reach, SegmentGrid &near) {
  near.start.assign(grid.n_cells() + 1, 0);
  for (const WallSegment &s : walls.segments)
    for_each_cell_near(walls, s, grid, reach, [&](int c) { ++near.start[c + 1]; });
  for (int c = 0; c < grid.n_cells(); ++c)
    near.start[c + 1] += near.start[c];
  near.segment.resize(near.start.back());
  std::vector<int> next(near.start.begin(), near.start.end() - 1);
  for (int k = 0; k < static_cast<int>(walls.segments.size()); ++k)
    for_each_cell_near(walls, walls.segments[k], grid, reach,
                       [&](int c) { near.segment[next[c]++] = k; });
}

namespace {

[[noreturn]] void refuse_opposed(const Walls &walls, const WallSegment &s, const WallSegment &t,
                                 int vertex) {
  const Vec<2> &x = walls.position[vertex];
  fail("walls '{}' and '{}' run against each other at ({}, {}) m; reverse the points_m of one: the "
       "fluid lies on the left of both",
       walls.names[s.wall], walls.names[t.wall], x.x(), x.y());
}

} // namespace

namespace {

// Vertices closer than this are one [m].
constexpr double same_place = 1e-9;

struct SegmentEnd {
  Vec<2> place;
  int segment;
  bool is_start;
};

void link(Walls &walls, const SegmentEnd &p, const SegmentEnd &q) {
  WallSegment &s = walls.segments[p.segment], &t = walls.segments[q.segment];
  if (p.is_start == q.is_start)
    refuse_opposed(walls, s, t, p.is_start ? s.a : s.b);
  WallSegment &from = p.is_start ? t : s, &to = p.is_start ? s : t;
  check(from.next < 0 && to.previous < 0,
        "walls '{}' and '{}': more than two segments meet at ({}, {}) m; "
        "walls must be simple outlines with the fluid on their left",
        walls.names[from.wall], walls.names[to.wall], p.place.x(), p.place.y());
  from.next = p.is_start ? p.segment : q.segment;
  to.previous = p.is_start ? q.segment : p.segment;
}

} // namespace

void link_outlines(Walls &walls) {
  std::vector<SegmentEnd> ends;
  for (int k = 0; k < static_cast<int>(walls.segments.size()); ++k) {
    ends.push_back({walls.position[walls.segments[k].a], k, true});
    ends.push_back({walls.position[walls.segments[k].b], k, false});
  }
  // Along a direction that no wall of a scene has by design: few ends fall on one spot.
  const auto along = [](const SegmentEnd &e) { return Vec<2>(0.5403, 0.8415).dot(e.place); };
  std::sort(ends.begin(), ends.end(), [&](const SegmentEnd &p, const SegmentEnd &q) {
    return along(p) < along(q);
  });
  for (std::size_t k = 0; k < ends.size(); ++k)
    for (std::size_t m = k + 1; m < ends.size(); ++m) {
      if (along(ends[m]) - along(ends[k]) > 1.01 * same_place)
        break;
      if (ends[m].segment != ends[k].segment && (ends[m].place - ends[k].place).norm() < same_place)
        link(walls, ends[k], ends[m]);
    }
}

} // namespace sluice::fluid
