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

enum class PointKind : std::int32_t { // wide enough to be gathered
  interior,                           // pressure from the Poisson equation
  surface, // at the free surface: pressure falls to zero at its depth outside
  thin,    // open on both sides, or nearly alone: pressure is zero
};

/// The points that cut one cell, counter-clockwise; none: not known.
struct CellGenerators {
  static constexpr int most = 11;
  int count = 0;
  std::array<std::int32_t, most> id;
};

/// What is remembered of cells, by the id of their point.
struct CellMemory {
  std::vector<CellGenerators> generators;
  std::vector<int> index_of_id; // in the present order of the points, -1: gone
};

template <int dim> struct Cloud {
  double spacing = 0;  // nominal distance between points [m]
  double radius = 0;   // of the kernel [m]
  bool has_air = true; // false: the fluid fills its container, holes are no surface
  Grid<dim> grid;
  CellRanges ranges;
  NeighbourLists neighbours;                // those in sight
  SlicedPattern slices;                     // the same lists side by side
  FaceTree<dim> face_tree;                  // of the walls
  std::vector<int> wall_slot;               // per point: index into point_walls, or -1
  std::vector<int> wall_points;             // per slot: the point
  std::vector<PointWalls<dim>> point_walls; // projections within the kernel radius
  std::vector<PointKind> kind;
  std::vector<Vec<dim>> surface_normal;  // unit, out of the fluid; zero where openness is 0
  std::vector<double> openness;          // 1: open, 0: interior; between: an interior point that
                                         // comes up to the surface [-]
  std::vector<double> surface_depth;     // of such a point below the surface, as far as its
                                         // volume reaches [m]
  std::vector<double> cell_volume;       // [m^dim]; that of the surface envelope at open cells
  std::vector<Vec<dim>> centroid_offset; // cell centroid minus position [m]

  SortMemory<dim> sort_memory;
  CellMemory cell_memory;      // of the last step's cells, in the plane
  bool remembers_cells = true; // false: every cell is cut anew, with the same result
  int cells_cut = 0;           // in the last update; the others were known

  const PointWalls<dim> *walls_of(int i) const {
    return wall_slot[i] < 0 ? nullptr : &point_walls[wall_slot[i]];
  }
};

/// Ratio of kernel radius to spacing.
inline constexpr double kernel_radius_ratio = 2.6;

/// Sorts the points into cells and projects those near walls on them.
template <int dim>
void update_walls(Points<dim> &points, const Walls<dim> &walls, double spacing, Cloud<dim> &cloud);

/// Neighbour lists of the sorted points, those behind a wall left out.
template <int dim>
void update_neighbours(const Points<dim> &points, const Walls<dim> &walls, Cloud<dim> &cloud);

/// Voronoi cells and point kinds; needs neighbours and projections. A hole counts as air when the
/// radius of an empty ball through the point exceeds 1.2 spacings; an interior point next to an
/// open one emerges from 0.9 (in space 1.05) on. Marks open points so for the next step.
template <int dim> void update_cells(Points<dim> &points, Cloud<dim> &cloud);

} // namespace sluice::fluid
