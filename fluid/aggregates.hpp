// SPDX-License-Identifier: MIT
// Aggregates of rows for the multigrid: cells of a background grid, which the neighbour search has
// at hand, instead of neighbourhoods in the matrix graph. Each cell holds at most one aggregate, so
// that a window of cells around it addresses everything it couples to.
#pragma once

#include "fluid/sparse_matrix.hpp"

#include <cstdint>
#include <vector>

namespace sluice::fluid {

/// Integer coordinates of a grid cell; directions that are not used are zero.
using Cell = std::array<std::int32_t, 3>;

inline Cell moved(const Cell &cell, const Cell &step) {
  return {cell[0] + step[0], cell[1] + step[1], cell[2] + step[2]};
}

/// Cell coordinates packed into one number, 21 bits each. Cells beyond a million from the origin
/// are taken for that far.
using CellKey = std::int64_t;

constexpr CellKey key_of(const Cell &cell) {
  CellKey key = 0;
  for (int d = 2; d >= 0; --d)
    key = (key << 21) + std::clamp(cell[d], -1'000'000, 1'000'000);
  return key;
}

/// Coordinates modulo 1024, ten bits each: enough to tell cells that are next to each other,
/// sixteen at a time.
using ShortKey = std::int32_t;
inline constexpr ShortKey no_cell = 1 << 30;

inline ShortKey short_key_of(const Cell &cell) {
  return (cell[0] & 1023) | (cell[1] & 1023) << 10 | (cell[2] & 1023) << 20;
}

/// A matrix I + O with O in slices and in single precision; a view.
struct UnitDiagonalView {
  const SlicedPattern &pattern;
  const std::vector<float> &off_diagonal;
  const std::vector<float> &off_diagonal_sum; ///< [rows] of the magnitudes in a row

  bool is_isolated(int i) const { return off_diagonal_sum[i] == 0; }
  int rows() const { return pattern.rows; }
  /// Calls body(column, value) for the entries of row i of O that are not zero.
  template <class Body> void for_each_entry(int i, Body &&body) const {
    const std::size_t first = pattern.place(i, 0);
    const std::size_t last = first + static_cast<std::size_t>(pattern.width(i)) * pattern.lanes;
    for (std::size_t at = first; at < last; at += pattern.lanes)
      if (off_diagonal[at] != 0)
        body(pattern.column[at], off_diagonal[at]);
  }
};

/// Sums of the magnitudes in every row. One plus the sum bounds what a row can make of a vector.
void sum_magnitudes(const SlicedPattern &pattern, const std::vector<float> &off_diagonal,
                    std::vector<float> &sum);

/// Weight of a Jacobi step on a row, `weight` where the off-diagonal magnitudes do not exceed the
/// diagonal and less beyond: weight (1 + sum) <= 2 * `weight` < 2 keeps the spectrum of the step
/// within the unit circle whatever the signs (Gershgorin).
inline float bounded_weight(float weight, float off_diagonal_sum) {
  return 2 * weight / (1 + std::max(1.0f, off_diagonal_sum));
}

/// Disjoint sets of rows, one per occupied cell. Rows in none (-1) are those without off-diagonal
/// entries, which dividing by the diagonal solves, and detached pieces in the cell of a larger one.
struct Aggregates {
  std::vector<int> of_row;               ///< [rows] aggregate or -1
  std::vector<ShortKey> key_of_row;      ///< [rows] cell of the aggregate or no_cell
  std::vector<Cell> cell;                ///< [aggregates]
  std::vector<int> member_start, member; ///< rows of each aggregate, ascending
  std::vector<int> place_of_row;         ///< [rows] where a row stands in member, or -1

  int count() const { return static_cast<int>(cell.size()); }
};

/// Finds aggregates: the largest connected set of rows of each cell. Where a thin wall cuts a cell,
/// the smaller part joins the aggregate of the next cell that it is most strongly connected to.
/// Keeps its memory between calls.
class AggregateFinder {
public:
  void find(const UnitDiagonalView &matrix, const std::vector<Cell> &cells, Aggregates &result);
  /// The aggregate in the cell, or -1.
  int aggregate_in(const Cell &cell) const;

private:
  void number_cells(const UnitDiagonalView &matrix, const std::vector<Cell> &cells,
                    Aggregates &result);
  void make_table(const std::vector<Cell> &cells);
  std::size_t slot_of(const Cell &cell) const;
  int number_of(const Cell &cell, Aggregates &result);
  void list_members(const std::vector<int> &of_row, Aggregates &result);
  void keep_largest_part(const UnitDiagonalView &matrix, int cell, Aggregates &result);
  bool connect(const UnitDiagonalView &matrix, int cell, const Aggregates &aggregates);
  int root(int i);
  void attach_rest(const UnitDiagonalView &matrix, Aggregates &result);

  // Numbers of the cells, or -1: one place for each cell of the box that holds all where that is
  // not much larger than the number of rows, else open addressing in a length that is a power of
  // two.
  std::vector<int> table_;
  bool is_box_ = false;
  Cell low_{}, extent_{};    // of the box
  std::vector<CellKey> key_; // [cells]
  std::vector<int> cell_of_; // [rows] cell number or -1
  std::vector<int> root_;    // [rows] a connected row of the same cell; the first row to itself
  std::vector<int> rest_;    // rows that are not in their cell's largest part
  std::vector<int> link_;    // [rows] for roots of the rest: where their piece is attached
  std::vector<float> strength_;
};

} // namespace sluice::fluid
