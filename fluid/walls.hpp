// SPDX-License-Identifier: MIT
// Walls: polylines of straight segments with the fluid on their left, used directly (no ghost
// points). Points see a wall through projections: the locally nearest points of the polylines.
#pragma once

#include "bridge/base/vec.hpp"
#include "fluid/neighbours.hpp"

#include <array>
#include <span>
#include <string>
#include <vector>

namespace sluice::fluid {

struct WallSegment {
  int a = 0, b = 0;            // vertices; the fluid lies on the left of a -> b
  int previous = -1, next = -1; // neighbouring segments of the outline, -1 at an open end
  int wall = 0;                // index into Walls::names
};

/// Wall surface of a scene: vertices with position and velocity, and the segments between them.
struct Walls {
  std::vector<Vec<2>> position; // [m]
  std::vector<Vec<2>> velocity; // [m/s]
  std::vector<WallSegment> segments;
  std::vector<std::string> names;
  std::vector<int> coupled_vertices; // moved by the bridge, in the order of its interface mesh
  std::vector<int> coupled_segments;

  Vec<2> tangent(const WallSegment &s) const { return (position[s.b] - position[s.a]).normalized(); }
  /// Unit normal of a segment, into the fluid.
  Vec<2> normal(const WallSegment &s) const { return rotated_left(tangent(s)); }
};

/// Nearest point of a wall to a fluid point.
struct Projection {
  Vec<2> point;    // on the wall [m]
  Vec<2> normal;   // unit, out of the fluid
  double distance; // [m], negative when the fluid point is behind the wall
  double t;        // position on the segment, 0 at vertex a, 1 at b
  int segment;
  bool at_edge;    // on a sharp edge (turning by more than 30 degrees) or an open end: flow leaves
};

/// Wall velocity at a projection [m/s].
inline Vec<2> wall_velocity(const Walls &walls, const Projection &p) {
  const WallSegment &s = walls.segments[p.segment];
  return (1 - p.t) * walls.velocity[s.a] + p.t * walls.velocity[s.b];
}

/// The projections of one point, nearest first: the nearest three directions that differ by more
/// than 30 degrees, of each the nearest wall.
struct PointWalls {
  int count = 0;
  std::array<Projection, 3> projection;
  auto begin() const { return projection.begin(); }
  auto end() const { return projection.begin() + count; }
};

/// Which segments come within `reach` of each grid cell.
struct SegmentGrid {
  std::vector<int> start; // n_cells + 1
  std::vector<int> segment;
  std::span<const int> near(int cell) const {
    return {segment.data() + start[cell], segment.data() + start[cell + 1]};
  }
};
void find_near_segments(const Walls &walls, const Grid &grid, double reach, SegmentGrid &near);

/// Projections of `x` on those of `candidates` within `reach`: local minima of the distance along
/// the outlines, nearest first.
PointWalls project_on_walls(const Walls &walls, std::span<const int> candidates, const Vec<2> &x,
                            double reach);

/// Distance from `x` to the nearest of all segments [m].
double distance_to_walls(const Walls &walls, const Vec<2> &x);

/// True when the straight line between two points crosses one of the segments.
bool is_hidden(const Walls &walls, std::span<const int> candidates, const Vec<2> &from,
               const Vec<2> &to);

/// Links segments that share a vertex position into outlines; throws UserError on a vertex with
/// more than two segments or two segments that point against each other.
void link_outlines(Walls &walls);

} // namespace sluice::fluid
