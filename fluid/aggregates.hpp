// SPDX-License-Identifier: MIT
// Aggregates of rows for the multigrid: cells of a background grid, which the neighbour search has
// at hand, instead of neighbourhoods in the matrix graph.
#pragma once

#include "fluid/sparse_matrix.hpp"

#include <cstdint>
#include <vector>

namespace sluice::fluid {

/// Integer coordinates of a grid cell; directions that are not used are zero.
using Cell = std::array<std::int32_t, 3>;

/// A matrix I + O with O in slices and in single precision; a view.
struct UnitDiagonalView {
  const SlicedPattern &pattern;
  const std::vector<float> &off_diagonal;

  int rows() const { return pattern.rows; }
  /// Calls body(column, value) for the entries of row i of O that are not zero.
  template <class Body> void for_each_entry(int i, Body &&body) const {
    const std::size_t first = pattern.place(i, 0);
    const std::size_t last = first + static_cast<std::size_t>(pattern.width(i)) * pattern.lanes;
    for (std::size_t at = first; at < last; at += pattern.lanes)
      if (off_diagonal[at] != 0)
        body(pattern.column[at], off_diagonal[at]);
  }
  bool is_isolated(int i) const {
    bool isolated = true;
    for_each_entry(i, [&](int, float) { isolated = false; });
    return isolated;
  }
};

/// Disjoint sets of rows. A row without off-diagonal entries is in none (aggregate -1): dividing by
/// its diagonal solves it, so a coarser level has nothing to add.
struct Aggregates {
  std::vector<int> of_row; ///< [rows] aggregate or -1
  std::vector<Cell> cell;  ///< [aggregates] the cell that each came from

  int count() const { return static_cast<int>(cell.size()); }
};

/// Finds aggregates: the rows of one cell that are connected by entries within that cell, so that a
/// cell cut by a thin wall gives two. Keeps its memory between calls.
class AggregateFinder {
public:
  void find(const UnitDiagonalView &matrix, const std::vector<Cell> &cells, Aggregates &result);

private:
  void number_cells(const UnitDiagonalView &matrix, const std::vector<Cell> &cells);
  int number_of(const Cell &cell);
  void list_members(int rows);
  void connect(const UnitDiagonalView &matrix, int cell);
  int root(int i);
  void number_aggregates(Aggregates &result);

  std::vector<int> table_;          // open addressing: cell number or -1; length a power of two
  std::vector<Cell> cell_;          // [cells] in order of first appearance
  std::vector<int> cell_of_;        // [rows] cell number or -1
  std::vector<int> start_, member_; // rows of each cell
  std::vector<int> root_;           // [rows] a row connected to this one; the first row to itself
};

} // namespace sluice::fluid
