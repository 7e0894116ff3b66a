// SPDX-License-Identifier: MIT
#include "fluid/aggregates.hpp"

#include <bit>

namespace sluice::fluid {
namespace {

std::uint32_t hash(const Cell &cell) {
  const auto x = static_cast<std::uint64_t>(static_cast<std::uint32_t>(cell[0]));
  const auto y = static_cast<std::uint64_t>(static_cast<std::uint32_t>(cell[1]));
  const auto z = static_cast<std::uint64_t>(static_cast<std::uint32_t>(cell[2]));
  const std::uint64_t mixed =
      (x * 0x9E3779B97F4A7C15u) ^ (y * 0xC2B2AE3D27D4EB4Fu) ^ (z * 0x165667B19E3779F9u);
  return static_cast<std::uint32_t>(mixed >> 32) ^ static_cast<std::uint32_t>(mixed);
}

} // namespace

void AggregateFinder::find(const UnitDiagonalView &matrix, const std::vector<Cell> &cells,
                           Aggregates &result) {
  const int n = matrix.rows();
  number_cells(matrix, cells);
  list_members(n);
  root_.resize(n);
  for_each_index(n, [&](int i) { root_[i] = i; });
  for_each_index(static_cast<int>(cell_.size()), [&](int cell) { connect(matrix, cell); });
  number_aggregates(result);
}

// Neighbouring rows are mostly in one cell, which saves most look-ups.
void AggregateFinder::number_cells(const UnitDiagonalView &matrix, const std::vector<Cell> &cells) {
  const int n = matrix.rows();
  table_.assign(std::bit_ceil(static_cast<std::size_t>(n) + 1), -1);
  cell_.clear();
  cell_of_.resize(n);
  for_each_index(n, [&](int i) { cell_of_[i] = matrix.is_isolated(i) ? -1 : 0; });
  for (int i = 0, last = -1; i < n; ++i) {
    if (cell_of_[i] < 0)
      continue;
    if (last < 0 || cells[i] != cell_[last])
      last = number_of(cells[i]);
    cell_of_[i] = last;
  }
}

int AggregateFinder::number_of(const Cell &cell) {
  const std::size_t mask = table_.size() - 1;
  std::size_t slot = hash(cell) & mask;
  while (table_[slot] >= 0 && cell_[table_[slot]] != cell)
    slot = (slot + 1) & mask;
  if (table_[slot] < 0) {
    table_[slot] = static_cast<int>(cell_.size());
    cell_.push_back(cell);
  }
  return table_[slot];
}

// Counting sort; start_ is used as the cursor and shifted back by it.
void AggregateFinder::list_members(int rows) {
  start_.assign(cell_.size() + 2, 0);
  for (int i = 0; i < rows; ++i)
    ++start_[cell_of_[i] + 2];
  start_[1] = 0; // rows in no cell
  for (std::size_t c = 2; c < start_.size(); ++c)
    start_[c] += start_[c - 1];
  member_.resize(start_.back());
  for (int i = 0; i < rows; ++i)
    if (cell_of_[i] >= 0)
      member_[start_[cell_of_[i] + 1]++] = i;
}

int AggregateFinder::root(int i) {
  while (root_[i] != i)
    i = root_[i] = root_[root_[i]];
  return i;
}

// The smaller row becomes the root, so the result does not depend on the order of the entries.
void AggregateFinder::connect(const UnitDiagonalView &matrix, int cell) {
  for (int m = start_[cell]; m < start_[cell + 1]; ++m) {
    const int i = member_[m];
    matrix.for_each_entry(i, [&](int j, float) {
      if (cell_of_[j] != cell)
        return;
      const int a = root(i), b = root(j);
      root_[std::max(a, b)] = std::min(a, b);
    });
  }
}

// Members ascend, so a root comes before the rows that point to it.
void AggregateFinder::number_aggregates(Aggregates &result) {
  result.of_row.resize(cell_of_.size());
  result.cell.clear();
  for (std::size_t i = 0; i < cell_of_.size(); ++i) {
    const int first = root(static_cast<int>(i));
    if (cell_of_[i] < 0)
      result.of_row[i] = -1;
    else if (first != static_cast<int>(i))
      result.of_row[i] = result.of_row[first];
    else {
      result.of_row[i] = result.count();
      result.cell.push_back(cell_[cell_of_[i]]);
    }
  }
}

} // namespace sluice::fluid
