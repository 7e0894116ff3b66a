// SPDX-License-Identifier: MIT
// The matrices of one coarsening step: smoothed prolongation P = (I - weight A) P0 with P0
// piecewise constant over aggregates, restriction R = P^T, and the coarse matrix R A P. Source: P.
// Vanek, J. Mandel, M. Brezina, Computing 56 (1996) 179.
#pragma once

#include "fluid/aggregates.hpp"
#include "fluid/sparse_matrix.hpp"

#include <vector>

namespace sluice::fluid {

/// Computes compressed rows block by block in parallel and joins them in order; keeps its memory.
class RowCollector {
public:
  /// One row being added up. Entries stand in the order of their first addition.
  class Row {
  public:
    void add(int column, float value);
    int length() const { return static_cast<int>(column_.size() - begin_); }
    int &column(int k) { return column_[begin_ + k]; }
    float &value(int k) { return value_[begin_ + k]; }
    /// Keeps the first `length` entries.
    void truncate(int length);

  private:
    friend class RowCollector;
    std::vector<int> column_, length_;
    std::vector<float> value_;
    std::size_t begin_ = 0;
    std::vector<int> *slot_ =
        nullptr; // by column: where it may stand in column_; stale is harmless
  };

  /// result row i = what fill(i, row) adds, for rows with `columns` columns.
  template <class Fill> void collect(int rows, int columns, CompressedRows &result, Fill &&fill) {
    prepare(rows, columns);
    for_each_block(rows, [&](IndexRange range, int b) {
      Row &row = block_[b];
      row.slot_ = &slot_[thread_index()];
      for (int i = range.begin; i < range.end; ++i) {
        row.begin_ = row.column_.size();
        fill(i, row);
        row.length_.push_back(row.length());
      }
    });
    join(rows, result);
  }

private:
  void prepare(int rows, int columns);
  void join(int rows, CompressedRows &result);

  std::array<Row, Blocks::max_count> block_;
  std::vector<std::vector<int>> slot_; // one per thread
};

/// P = (I - weight A) P0; rows without aggregate are empty.
void build_prolongation(const UnitDiagonalView &matrix, const Aggregates &aggregates, float weight,
                        RowCollector &collector, CompressedRows &result);

/// The transpose of `rows`, which has `columns` columns; columns ascend in the result's rows.
void transpose(const CompressedRows &rows, int columns, CompressedRows &result);

/// R A P; entries below `drop` times the diagonal of their row are added to the diagonal instead,
/// which keeps row sums. The diagonal comes first in each row.
class GalerkinProduct {
public:
  void build(const UnitDiagonalView &matrix, const CompressedRows &prolongation,
             const CompressedRows &restriction, float drop, RowCollector &collector,
             CompressedRows &coarse);

private:
  CompressedRows a_p_;
};

} // namespace sluice::fluid
