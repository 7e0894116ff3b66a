// SPDX-License-Identifier: MIT
#include "fluid/galerkin.hpp"

#include <cmath>

namespace sluice::fluid {

// An entry of slot_ is believed only if the place it names holds this column and is of this row.
void RowCollector::Row::add(int column, float value) {
  const auto at = static_cast<std::size_t>((*slot_)[column]);
  if (at >= begin_ && at < column_.size() && column_[at] == column) {
    value_[at] += value;
    return;
  }
  (*slot_)[column] = static_cast<int>(column_.size());
  column_.push_back(column);
  value_.push_back(value);
}

void RowCollector::Row::truncate(int length) {
  column_.resize(begin_ + length);
  value_.resize(begin_ + length);
}

void RowCollector::prepare(int rows, int columns) {
  slot_.resize(std::max<std::size_t>(slot_.size(), number_of_threads()));
  for (auto &slot : slot_)
    slot.resize(std::max<std::size_t>(slot.size(), columns));
  for (int b = 0; b < Blocks(rows).count(); ++b) {
    block_[b].column_.clear();
    block_[b].value_.clear();
    block_[b].length_.clear();
  }
}

void RowCollector::join(int rows, CompressedRows &result) {
  result.row_start.resize(rows + 1);
  result.row_start[0] = 0;
  const Blocks blocks(rows);
  for (int b = 0; b < blocks.count(); ++b)
    for (int i = blocks[b].begin; i < blocks[b].end; ++i)
      result.row_start[i + 1] = result.row_start[i] + block_[b].length_[i - blocks[b].begin];
  result.column.resize(result.row_start.back());
  result.value.resize(result.row_start.back());
  for_each_block(rows, [&](IndexRange range, int b) {
    const int at = result.row_start[range.begin];
    std::copy(block_[b].column_.begin(), block_[b].column_.end(), result.column.begin() + at);
    std::copy(block_[b].value_.begin(), block_[b].value_.end(), result.value.begin() + at);
  });
}

void build_prolongation(const UnitDiagonalView &matrix, const Aggregates &aggregates, float weight,
                        RowCollector &collector, CompressedRows &result) {
  const auto &of_row = aggregates.of_row;
  collector.collect(matrix.rows(), aggregates.count(), result, [&](int i, RowCollector::Row &row) {
    if (of_row[i] < 0)
      return;
    row.add(of_row[i], 1 - weight);
    matrix.for_each_entry(i, [&](int j, float value) {
      if (of_row[j] >= 0)
        row.add(of_row[j], -weight * value);
    });
  });
}

void transpose(const CompressedRows &rows, int columns, CompressedRows &result) {
  auto &start = result.row_start;
  start.assign(columns + 2, 0);
  for (const int c : rows.column)
    ++start[c + 2];
  for (int c = 2; c < columns + 2; ++c)
    start[c] += start[c - 1];
  result.column.resize(rows.column.size());
  result.value.resize(rows.column.size());
  for (int i = 0; i < rows.rows(); ++i)
    for (int k = rows.row_start[i]; k < rows.row_start[i + 1]; ++k) {
      const int at = start[rows.column[k] + 1]++;
      result.column[at] = i;
      result.value[at] = rows.value[k];
    }
  start.pop_back();
}

namespace {

void add_scaled(RowCollector::Row &row, float factor, const CompressedRows &rows, int i) {
  for (int k = rows.row_start[i]; k < rows.row_start[i + 1]; ++k)
    row.add(rows.column[k], factor * rows.value[k]);
}

void drop_small(RowCollector::Row &row, float drop) {
  const float threshold = drop * std::abs(row.value(0));
  int kept = 1;
  for (int k = 1; k < row.length(); ++k)
    if (std::abs(row.value(k)) < threshold)
      row.value(0) += row.value(k);
    else {
      row.column(kept) = row.column(k);
      row.value(kept++) = row.value(k);
    }
  row.truncate(kept);
}

} // namespace

void GalerkinProduct::build(const UnitDiagonalView &matrix, const CompressedRows &prolongation,
                            const CompressedRows &restriction, float drop, RowCollector &collector,
                            CompressedRows &coarse) {
  const int n = matrix.rows(), n_coarse = restriction.rows();
  collector.collect(n, n_coarse, a_p_, [&](int i, RowCollector::Row &row) {
    add_scaled(row, 1, prolongation, i);
    matrix.for_each_entry(i, [&](int j, float v) { add_scaled(row, v, prolongation, j); });
  });
  collector.collect(n_coarse, n_coarse, coarse, [&](int c, RowCollector::Row &row) {
    row.add(c, 0);
    for (int k = restriction.row_start[c]; k < restriction.row_start[c + 1]; ++k)
      add_scaled(row, restriction.value[k], a_p_, restriction.column[k]);
    drop_small(row, drop);
  });
}

} // namespace sluice::fluid
