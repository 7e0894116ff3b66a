// SPDX-License-Identifier: MIT
// Uniform grid over the points, the order of the points along it, and neighbour lists.
#pragma once

#include "bridge/base/vec.hpp"
#include "fluid/points.hpp"

#include <span>
#include <vector>

namespace sluice::fluid {

/// A uniform grid of square cells over the bounding box of the points.
struct Grid {
  Vec<2> origin{0, 0};  // [m], lower left corner
  double cell_size = 0; // [m]
  int nx = 0, ny = 0;

  int n_cells() const { return nx * ny; }
  int column(double x) const; ///< clamped to the grid
  int row(double y) const;    ///< clamped to the grid
  int cell(const Vec<2> &x) const { return row(x.y()) * nx + column(x.x()); }
};

/// Indices of the points in each cell: points are sorted, so a cell is a range.
struct CellRanges {
  std::vector<int> start; // n_cells + 1
};

/// Neighbours within the kernel radius, the point itself excluded.
struct NeighbourLists {
  std::vector<int> start; // where the list of a point begins
  std::vector<int> count; // its length; hidden neighbours have been taken out behind it
  std::vector<int> index;

  std::span<const int> of(int i) const {
    return {index.data() + start[i], static_cast<std::size_t>(count[i])};
  }
};

/// A grid over all points with the given cell size.
/// Throws UserError when a position is not finite or the points spread over too many cells.
Grid grid_over(const Points &points, double cell_size);

/// Sorts the points by cell, row by row (stable), and returns the range of each cell.
void sort_by_cell(Points &points, const Grid &grid, CellRanges &ranges);

/// All pairs closer than `radius`; the grid's cells must not be smaller than `radius`.
void find_neighbours(const Points &points, const Grid &grid, const CellRanges &ranges,
                     double radius, NeighbourLists &lists);

} // namespace sluice::fluid
