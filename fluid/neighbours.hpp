// SPDX-License-Identifier: MIT
// Uniform grid over the points, the order of the points along it, and neighbour lists.
#pragma once

#include "bridge/base/vec.hpp"
#include "fluid/points.hpp"
#include "fluid/sparse_matrix.hpp"

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
/// Lists have room for `capacity` entries each, so that one pass fills them.
struct NeighbourLists {
  int capacity = 32;      // entries per point
  std::vector<int> count; // length of each list
  std::vector<int> index; // capacity entries per point

  std::span<const int> of(int i) const { return {first(i), static_cast<std::size_t>(count[i])}; }
  const int *first(int i) const { return index.data() + static_cast<std::size_t>(i) * capacity; }
  int *first(int i) { return index.data() + static_cast<std::size_t>(i) * capacity; }
};

/// Longest list that is kept: of a point with more neighbours (a clump) the first ones stay.
inline constexpr int most_neighbours = 64;

/// A grid over all points with the given cell size.
/// Throws UserError when a position is not finite or the points spread over too many cells.
Grid grid_over(const Points &points, double cell_size);

/// Sorts the points by cell, row by row (stable), and returns the range of each cell.
void sort_by_cell(Points &points, const Grid &grid, CellRanges &ranges);

/// All pairs closer than `radius`; the grid's cells must not be smaller than `radius`.
void find_neighbours(const Points &points, const Grid &grid, const CellRanges &ranges,
                     double radius, NeighbourLists &lists);

/// Rows with the point itself first and its neighbours after it, in the order of the lists; room for
/// the values, which are not set.
void lay_out_rows(const NeighbourLists &lists, SparseMatrix &matrix);

} // namespace sluice::fluid
