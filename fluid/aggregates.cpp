// SPDX-License-Identifier: MIT
#include "fluid/aggregates.hpp"

#include <bit>
#include <cmath>

namespace sluice::fluid {
namespace {

std::size_t hash(CellKey key) {
  return static_cast<std::size_t>((static_cast<std::uint64_t>(key) * 0x9E3779B97F4A7C15u) >> 32);
}

} // namespace

void sum_magnitudes(const SlicedPattern &pattern, const std::vector<float> &off_diagonal,
                    std::vector<float> &sum) {
  sum.resize(pattern.rows);
  constexpr int lanes = SlicedPattern::lanes;
  const auto sum_slice = [&](int s) {
    Floats total{};
    for (int k = pattern.slice_start[s]; k < pattern.slice_start[s + 1]; ++k) {
      const Floats v = load(&off_diagonal[static_cast<std::size_t>(k) * lanes]);
      total += v < 0 ? -v : v;
    }
    for (int i = s * lanes; i < std::min(pattern.rows, (s + 1) * lanes); ++i)
      sum[i] = total[i % lanes];
  };
  for_each_block(pattern.rows, [&](IndexRange range, int) {
    for (int first = range.begin; first < range.end; first += lanes)
      sum_slice(first / lanes);
  });
}

void AggregateFinder::find(const UnitDiagonalView &matrix, const std::vector<Cell> &cells,
                           Aggregates &result) {
  const int n = matrix.rows();
  number_cells(matrix, cells, result);
  list_members(cell_of_, result);
  result.of_row.resize(n);
  root_.resize(n);
  for_each_index(n, [&](int i) {
    root_[i] = i;
    result.of_row[i] = cell_of_[i];
  });
  for_each_index(result.count(), [&](int c) { keep_largest_part(matrix, c, result); });
  attach_rest(matrix, result);
  result.key_of_row.resize(n);
  for_each_index(n, [&](int i) {
    result.key_of_row[i] =
        result.of_row[i] < 0 ? no_cell : short_key_of(result.cell[result.of_row[i]]);
  });
}

int AggregateFinder::aggregate_in(const Cell &cell) const {
  if (is_box_)
    for (int d = 0; d < 3; ++d)
      if (cell[d] < low_[d] || cell[d] >= low_[d] + extent_[d])
        return -1;
  return table_[slot_of(cell)];
}

// In a box the cell must be one of it; else the place of the cell, or a free one.
std::size_t AggregateFinder::slot_of(const Cell &cell) const {
  if (is_box_)
    return (static_cast<std::size_t>(cell[2] - low_[2]) * extent_[1] + (cell[1] - low_[1])) *
               extent_[0] +
           (cell[0] - low_[0]);
  const CellKey key = key_of(cell);
  const std::size_t mask = table_.size() - 1;
  std::size_t slot = hash(key) & mask;
  while (table_[slot] >= 0 && key_[table_[slot]] != key)
    slot = (slot + 1) & mask;
  return slot;
}

void AggregateFinder::make_table(const std::vector<Cell> &cells) {
  const int n = static_cast<int>(cells.size());
  std::array<Cell, Blocks::max_count> low, high;
  for_each_block(
      n,
      [&](IndexRange range, int b) {
        low[b] = high[b] = cells[range.begin];
        for (int i = range.begin; i < range.end; ++i)
          for (int d = 0; d < 3; ++d) {
            low[b][d] = std::min(low[b][d], cells[i][d]);
            high[b][d] = std::max(high[b][d], cells[i][d]);
          }
      },
      Work::light);
  double size = n > 0 ? 1 : 0;
  for (int d = 0; d < 3 && n > 0; ++d) {
    low_[d] = low[0][d];
    int top = high[0][d];
    for (int b = 1; b < Blocks(n).count(); ++b) {
      low_[d] = std::min(low_[d], low[b][d]);
      top = std::max(top, high[b][d]);
    }
    size *= static_cast<double>(top) - low_[d] + 1;
    extent_[d] = static_cast<int>(std::min<std::int64_t>(std::int64_t{top} - low_[d] + 1, 1 << 30));
  }
  constexpr double roomy = 8; // cells of the box per row; a full one has a quarter
  is_box_ = n > 0 && size <= roomy * n;
  table_.assign(is_box_ ? static_cast<std::size_t>(size)
                        : std::bit_ceil(static_cast<std::size_t>(n) + 1),
                -1);
}

// Consecutive rows are mostly in one cell, which saves look-ups.
void AggregateFinder::number_cells(const UnitDiagonalView &matrix, const std::vector<Cell> &cells,
                                   Aggregates &result) {
  const int n = matrix.rows();
  make_table(cells);
  key_.clear();
  result.cell.clear();
  cell_of_.resize(n);
  for_each_index(n, [&](int i) { cell_of_[i] = matrix.is_isolated(i) ? -1 : 0; });
  for (int i = 0, last = -1; i < n; ++i) {
    if (cell_of_[i] < 0)
      continue;
    if (last < 0 || cells[i] != result.cell[last])
      last = number_of(cells[i], result);
    cell_of_[i] = last;
  }
}

int AggregateFinder::number_of(const Cell &cell, Aggregates &result) {
  int &number = table_[slot_of(cell)];
  if (number < 0) {
    number = result.count();
    key_.push_back(key_of(cell));
    result.cell.push_back(cell);
  }
  return number;
}

// Counting sort. member_start holds ends first, then walks down to the beginnings.
void AggregateFinder::list_members(const std::vector<int> &of_row, Aggregates &result) {
  auto &start = result.member_start;
  start.assign(result.count() + 1, 0);
  for (const int a : of_row)
    if (a >= 0)
      ++start[a];
  for (int a = 0, total = 0; a <= result.count(); ++a)
    start[a] = total += start[a];
  result.member.resize(start.back());
  result.place_of_row.assign(of_row.size(), -1);
  for (int i = static_cast<int>(of_row.size()) - 1; i >= 0; --i)
    if (of_row[i] >= 0) {
      result.place_of_row[i] = --start[of_row[i]];
      result.member[result.place_of_row[i]] = i;
    }
}

int AggregateFinder::root(int i) {
  while (root_[i] != i)
    i = root_[i] = root_[root_[i]];
  return i;
}

// Unites rows of the cell that are connected; true if that leaves one set.
bool AggregateFinder::connect(const UnitDiagonalView &matrix, int cell,
                              const Aggregates &aggregates) {
  const int begin = aggregates.member_start[cell], end = aggregates.member_start[cell + 1];
  int parts = end - begin;
  for (int m = begin; m < end && parts > 1; ++m) {
    const int i = aggregates.member[m];
    for (int k = 0; k < matrix.pattern.width(i) && parts > 1; ++k) {
      const std::size_t at = matrix.pattern.place(i, k);
      const int j = matrix.pattern.column[at];
      if (cell_of_[j] != cell || matrix.off_diagonal[at] == 0)
        continue;
      const int a = root(i), b = root(j);
      root_[std::max(a, b)] = std::min(a, b);
      parts -= a != b;
    }
  }
  return parts == 1;
}

void AggregateFinder::keep_largest_part(const UnitDiagonalView &matrix, int cell,
                                        Aggregates &result) {
  if (connect(matrix, cell, result))
    return;
  const int begin = result.member_start[cell], end = result.member_start[cell + 1];
  int largest = -1, most = 0;
  for (int m = begin; m < end; ++m) {
    int size = 0;
    for (int other = begin; other < end; ++other)
      size += root(result.member[other]) == root(result.member[m]);
    if (size > most) {
      most = size;
      largest = root(result.member[m]);
    }
  }
  for (int m = begin; m < end; ++m)
    if (root(result.member[m]) != largest)
      result.of_row[result.member[m]] = -1;
}

// Each piece of the rest goes where its strongest entry into a kept part points.
void AggregateFinder::attach_rest(const UnitDiagonalView &matrix, Aggregates &result) {
  const int n = matrix.rows();
  rest_.clear();
  for (int i = 0; i < n; ++i)
    if (cell_of_[i] >= 0 && result.of_row[i] < 0)
      rest_.push_back(i);
  if (rest_.empty())
    return;
  link_.assign(n, -1);
  strength_.assign(n, 0);
  for (const int i : rest_)
    matrix.for_each_entry(i, [&](int j, float value) {
      const int piece = root(i);
      if (result.of_row[j] < 0 || std::abs(value) <= strength_[piece])
        return;
      strength_[piece] = std::abs(value);
      link_[piece] = result.of_row[j];
    });
  for (const int i : rest_)
    result.of_row[i] = link_[root(i)];
  list_members(result.of_row, result);
}

} // namespace sluice::fluid
