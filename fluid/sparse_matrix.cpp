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

void ScaledMatrix::build(const SparseMatrix &a) {
  const int n = a.rows();
  entries_ = a.column.size();
  pattern_.lay_out(n, [&](int i) { return a.row_start[i + 1] - a.row_start[i] - 1; });
  value_.resize(pattern_.stored());
  value_float_.resize(pattern_.stored());
  inverse_diagonal_.resize(n);
  const int lanes = SlicedPattern::lanes;
  for_each_block(pattern_.slices() * lanes, [&](IndexRange range, int) {
    for (int i = range.begin; i < range.end; ++i)
      fill_row(a, i);
  });
}

// Rows beyond the last one complete the last slice with zeros.
void ScaledMatrix::fill_row(const SparseMatrix &a, int i) {
  const int row = std::min(i, rows() - 1);
  const int first = a.row_start[row] + 1;
  const int length = i < rows() ? a.row_start[row + 1] - first : 0;
  const double scale = 1 / a.diagonal(row);
  inverse_diagonal_[row] = scale;
  const std::size_t at = pattern_.place(i, 0);
  int *column = &pattern_.column[at];
  double *value = &value_[at];
  float *value_float = &value_float_[at];
  for (int k = 0; k < pattern_.width(i); ++k) {
    const bool inside = k < length;
    column[k * SlicedPattern::lanes] = inside ? a.column[first + k] : row;
    value[k * SlicedPattern::lanes] = inside ? a.value[first + k] * scale : 0;
    value_float[k * SlicedPattern::lanes] = static_cast<float>(value[k * SlicedPattern::lanes]);
  }
}

} // namespace sluice::fluid
