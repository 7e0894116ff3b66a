// SPDX-License-Identifier: MIT
// Uniform grid over the points, the order of the points along it, and neighbour lists.
#pragma once

#include "bridge/base/vec.hpp"
#include "fluid/points.hpp"
#include "fluid/sparse_matrix.hpp"

#include <array>
#include <span>
#include <vector>

namespace sluice::fluid {

/// A uniform grid of square cells over the bounding box of the points; the first direction runs
/// fastest.
template <int dim> struct Grid {
  /// Cell numbers along each direction.
  using Place = std::array<int, dim>;

  Vec<dim> origin = Vec<dim>::Zero(); // [m], lowest corner
  double cell_size = 0;               // [m]
  Place size{};                       // cells along each direction

  int n_cells() const;
  Vec<dim> top() const; ///< highest corner [m]
  /// Number along direction d of the cell that holds the coordinate, clamped to the grid.
  int number(double coordinate, int d) const;
  Place place(const Vec<dim> &x) const;
  int cell(const Place &place) const;
  int cell(const Vec<dim> &x) const { return cell(place(x)); }
  Vec<dim> centre(int cell) const; ///< [m]
  double half_diagonal() const;    ///< of a cell [m]

  /// Calls visit(first, last) for the cells of the box from `low` to `high` [m], both clamped: runs
  /// of cells first .. last along the first direction.
  template <class Visit>
  void for_each_run(const Place &low, const Place &high, Visit &&visit) const;
};

/// Indices of the points in each cell: points are sorted, so a cell is a range.
struct CellRanges {
  std::vector<int> start; // n_cells + 1
};

/// Neighbours within the kernel radius, the point itself excluded.
/// Lists have room for `capacity` entries each, so that one pass fills them.
struct NeighbourLists {
  int capacity = 32;              // entries per point
  std::vector<int> count;         // length of each list
  std::vector<int> index;         // capacity entries per point
  std::vector<double> coordinate; // of the points, direction by direction, for the search

  std::span<const int> of(int i) const { return {first(i), static_cast<std::size_t>(count[i])}; }
  const int *first(int i) const { return index.data() + static_cast<std::size_t>(i) * capacity; }
  int *first(int i) { return index.data() + static_cast<std::size_t>(i) * capacity; }
};

/// Longest list that is kept: of a point with more neighbours (a clump) the first ones stay. Three
/// times that of a lattice.
template <int dim> inline constexpr int most_neighbours = dim == 2 ? 64 : 224;

/// A grid over all points with the given cell size.
/// Throws UserError when a position is not finite or the points spread over too many cells.
template <int dim> Grid<dim> grid_over(const Points<dim> &points, double cell_size);

/// Memory of the sorting, kept from step to step.
template <int dim> struct SortMemory {
  std::vector<int> cell, order, next;
  Points<dim> sorted;
};

/// Sorts the points by cell, row by row (stable), and returns the range of each cell.
template <int dim>
void sort_by_cell(Points<dim> &points, const Grid<dim> &grid, CellRanges &ranges,
                  SortMemory<dim> &memory);

/// All pairs closer than `radius`; the grid's cells must not be smaller than `radius`.
template <int dim>
void find_neighbours(const Points<dim> &points, const Grid<dim> &grid, const CellRanges &ranges,
                     double radius, NeighbourLists &lists);

/// The lists side by side: entry k of list i is the column of row i, short lists filled up with i.
void slice_lists(const NeighbourLists &lists, SlicedPattern &slices);

/// Rows with the point itself first and its neighbours after it, in the order of the lists; room
/// for the values, which are not set.
void lay_out_rows(const NeighbourLists &lists, SparseMatrix &matrix);

template <int dim>
template <class Visit>
void Grid<dim>::for_each_run(const Place &low, const Place &high, Visit &&visit) const {
  Place at = low;
  const auto rows = [&] {
    for (at[1] = low[1]; at[1] <= high[1]; ++at[1]) {
      const int first = cell(at);
      visit(first, first + high[0] - low[0]);
    }
  };
  if constexpr (dim == 2)
    rows();
  else
    for (at[2] = low[2]; at[2] <= high[2]; ++at[2])
      rows();
}

template <int dim> inline Vec<dim> Grid<dim>::centre(int cell) const {
  Vec<dim> at;
  for (int d = 0; d < dim; cell /= size[d++])
    at[d] = cell % size[d] + 0.5;
  return origin + cell_size * at;
}

template <int dim> inline int Grid<dim>::cell(const Place &place) const {
  if constexpr (dim == 2)
    return place[1] * size[0] + place[0];
  else
    return (place[2] * size[1] + place[1]) * size[0] + place[0];
}

} // namespace sluice::fluid
