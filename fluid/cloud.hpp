// SPDX-License-Identifier: MIT
// What the positions of the points say: neighbours that see each other, projections on walls,
// Voronoi cells, and which points are at the free surface. Built once per step; frozen while the
// coupling iterates.
#pragma once

#include "fluid/neighbours.hpp"
#include "fluid/points.hpp"
#include "fluid/walls.hpp"

#include <cstdint>
#include <vector>

namespace sluice::fluid {

enum class PointKind : std::uint8_t {
  interior, // pressure from the Poisson equation
  surface,  // at the free surface: pressure falls to zero half a spacing outside
  thin,     // open on both sides, or nearly alone: pressure is zero
};

struct Cloud {
  double spacing = 0; // nominal distance between points [m]
  double radius = 0;  // of the kernel [m]
  bool has_air = true; // false: the fluid fills its container, holes are no surface
  Grid grid;
  CellRanges ranges;
  NeighbourLists neighbours; // those in sight
  SegmentGrid near_segments;
  std::vector<int> wall_slot;          // per point: index into point_walls, or -1
  std::vector<int> wall_points;        // per slot: the point
  std::vector<PointWalls> point_walls; // projections within the kernel radius
  std::vector<PointKind> kind;
  std::vector<Vec<2>> surface_normal;  // unit, out of the fluid; zero for interior points
  std::vector<double> cell_area;       // [m^2]; that of the surface envelope at open cells
  std::vector<Vec<2>> centroid_offset; // cell centroid minus position [m]

  const PointWalls *walls_of(int i) const {
    return wall_slot[i] < 0 ? nullptr : &point_walls[wall_slot[i]];
  }
};

/// Ratio of kernel radius to spacing.
inline constexpr double kernel_radius_ratio = 2.6;

/// Sorts the points into cells and projects those near walls on them.
void update_walls(Points &points, const Walls &walls, double spacing, Cloud &cloud);

/// Neighbour lists of the sorted points, those behind a wall left out.
void update_neighbours(const Points &points, const Walls &walls, Cloud &cloud);

/// Voronoi cells and point kinds; needs neighbours and projections. A hole counts as air when the
/// radius of an empty circle through the point exceeds 1.2 spacings, or 1.0 for a point that was
/// open in the last step. Marks open points so for the next step.
void update_cells(Points &points, Cloud &cloud);

} // namespace sluice::fluid
