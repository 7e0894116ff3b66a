// SPDX-License-Identifier: MIT
#include "fluid/sparse_matrix.hpp"

#include <iomanip>
#include <ostream>

namespace sluice::fluid {

void write_matrix_market(std::ostream &out, const SparseMatrix &matrix) {
  out << "%%MatrixMarket matrix coordinate real general\n"
      << matrix.rows() << ' ' << matrix.rows() << ' ' << matrix.column.size() << '\n'
      << std::setprecision(17);
  for (int i = 0; i < matrix.rows(); ++i)
    for (int k = matrix.row_start[i]; k < matrix.row_start[i + 1]; ++k)
      out << i + 1 << ' ' << matrix.column[k] + 1 << ' ' << matrix.value[k] << '\n';
}

SparseMatrix compressed(const SlicedMatrix &matrix) {
  SparseMatrix rows;
  for (int i = 0; i < matrix.rows(); ++i) {
    rows.column.push_back(i);
    rows.value.push_back(matrix.diagonal[i]);
    matrix.for_each_entry(i, [&](int j, double value) {
      if (value == 0)
        return;
      rows.column.push_back(j);
      rows.value.push_back(value);
    });
    rows.row_start.push_back(static_cast<int>(rows.column.size()));
  }
  return rows;
}

namespace {

// Rows beyond the last one complete the last slice with zeros.
void fill_row(const SparseMatrix &a, int i, SlicedMatrix &sliced) {
  const int row = std::min(i, a.rows() - 1);
  const int first = a.row_start[row] + 1;
  const int length = i < a.rows() ? a.row_start[row + 1] - first : 0;
  for (int k = 0; k < sliced.pattern.width(i); ++k) {
    const std::size_t at = sliced.pattern.place(i, k);
    sliced.pattern.column[at] = k < length ? a.column[first + k] : row;
    sliced.off_diagonal[at] = k < length ? a.value[first + k] : 0;
  }
}

} // namespace

void ScaledMatrix::build(const SparseMatrix &a) {
  const int n = a.rows();
  sliced_.pattern.lay_out(n, [&](int i) { return a.row_start[i + 1] - a.row_start[i] - 1; });
  sliced_.off_diagonal.resize(sliced_.pattern.stored());
  sliced_.diagonal.resize(n);
  for_each_index(n, [&](int i) { sliced_.diagonal[i] = a.diagonal(i); });
  for_each_index(sliced_.pattern.slices() * SlicedPattern::lanes,
                 [&](int i) { fill_row(a, i, sliced_); });
  build(sliced_);
}

void ScaledMatrix::build(const SlicedMatrix &a) {
  constexpr int lanes = SlicedPattern::lanes;
  matrix_ = &a;
  const int n = a.rows();
  inverse_diagonal_.resize(static_cast<std::size_t>(a.pattern.slices()) * lanes, 1.0);
  value_float_.resize(a.pattern.stored());
  const auto build_slice = [&](int s) {
    const int count = std::min(lanes, n - s * lanes);
    double *scale = &inverse_diagonal_[static_cast<std::size_t>(s) * lanes];
    for (int lane = 0; lane < count; ++lane)
      scale[lane] = 1 / a.diagonal[s * lanes + lane];
    const std::size_t first = static_cast<std::size_t>(a.pattern.slice_start[s]) * lanes;
    const std::size_t last = static_cast<std::size_t>(a.pattern.slice_start[s + 1]) * lanes;
    int used = count;
    for (std::size_t at = first; at < last; at += lanes)
      for (int lane = 0; lane < lanes; ++lane) {
        const double value = a.off_diagonal[at + lane];
        value_float_[at + lane] = static_cast<float>(value * scale[lane]);
        used += value != 0;
      }
    return used;
  };
  const double entries = block_sums<1>(
      n,
      [&](IndexRange range) {
        double used = 0;
        for (int i = range.begin; i < range.end; i += lanes)
          used += build_slice(i / lanes);
        return std::array<double, 1>{used};
      },
      Work::heavy)[0];
  entries_ = static_cast<std::size_t>(entries);
}

} // namespace sluice::fluid
