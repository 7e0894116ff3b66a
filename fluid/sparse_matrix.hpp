// SPDX-License-Identifier: MIT
// Sparse matrices. `SparseMatrix` is the form the caller fills: compressed rows, any row scaling.
// `SlicedMatrix` is the form the solver multiplies with: sixteen rows side by side (the SELL format
// of Kreutzer, Hager, Wellein, Fehske and Bishop, SIAM J. Sci. Comput. 36, 2014, without its
// sorting).
#pragma once

#include "fluid/lanes.hpp"
#include "fluid/parallel.hpp"

#include <iosfwd>
#include <vector>

namespace sluice::fluid {

/// Compressed sparse rows; the first entry of every row is its diagonal, which must not be zero.
/// Clearing and refilling the vectors reuses their memory.
struct SparseMatrix {
  std::vector<int> row_start{0}; ///< rows + 1 offsets into column and value
  std::vector<int> column;
  std::vector<double> value;

  int rows() const { return static_cast<int>(row_start.size()) - 1; }
  double diagonal(int i) const { return value[row_start[i]]; }
};

/// Writes `matrix` in MatrixMarket's coordinate format, for other solvers to read.
void write_matrix_market(std::ostream &out, const SparseMatrix &matrix);

/// The places of a matrix's entries in slices of sixteen rows: entry k of row i stands at
/// (slice_start[i / 16] + k) * 16 + i % 16. Short rows are filled up with zeros in column
/// min(i, columns - 1), where a product reads what it has just read.
struct SlicedPattern {
  static constexpr int lanes = 16;

  int rows = 0;
  std::vector<int> slice_start{0}; ///< in units of `lanes` entries
  std::vector<int> column;

  int slices() const { return (rows + lanes - 1) / lanes; }
  std::size_t stored() const { return column.size(); }
  std::size_t place(int i, int k) const {
    return (static_cast<std::size_t>(slice_start[i / lanes]) + k) * lanes + i % lanes;
  }
  /// Entries per row of the slice that holds row i, padding included.
  int width(int i) const { return slice_start[i / lanes + 1] - slice_start[i / lanes]; }

  /// Sets `rows` and the slices for rows of length(i) entries, and makes room for the columns.
  template <class Length> void lay_out(int n_rows, Length &&length) {
    rows = n_rows;
    slice_start.resize(slices() + 1);
    for_each_index(slices(), [&](int s) {
      int longest = 0;
      for (int i = s * lanes; i < std::min(rows, (s + 1) * lanes); ++i)
        longest = std::max(longest, length(i));
      slice_start[s + 1] = longest;
    });
    for (int s = 0; s < slices(); ++s)
      slice_start[s + 1] += slice_start[s];
    column.resize(static_cast<std::size_t>(slice_start.back()) * lanes);
  }
};

/// The same pattern, copied by all threads.
inline void copy_pattern(const SlicedPattern &from, SlicedPattern &to) {
  to.lay_out(from.rows, [&](int i) { return from.width(i); });
  for_each_index(
      static_cast<int>(from.stored()), [&](int k) { to.column[k] = from.column[k]; }, Work::light);
}

/// Products of the rows of slice `s` with x, summed in `Number`.
template <class Number, class Value, class X>
Lanes<Number> slice_product(const SlicedPattern &pattern, const Value *value, const X *x, int s) {
  const std::size_t begin = static_cast<std::size_t>(pattern.slice_start[s]) * pattern.lanes;
  const int width = pattern.slice_start[s + 1] - pattern.slice_start[s];
  return gathered_sums<Number>(value + begin, pattern.column.data() + begin, width, x);
}

/// Calls body(i, sum over j of value_ij x_j) for the rows of `range`, whose begin is a multiple
/// of 16.
template <class Number, class Value, class X, class Body>
void for_each_product(const SlicedPattern &pattern, const Value *value, const X *x,
                      IndexRange range, Body &&body) {
  constexpr int lanes = SlicedPattern::lanes;
  for (int first = range.begin; first < range.end; first += lanes) {
    const auto product = slice_product<Number>(pattern, value, x, first / lanes);
    const int count = std::min(lanes, range.end - first);
    for (int lane = 0; lane < count; ++lane)
      body(first + lane, product[lane]);
  }
}

/// A square matrix in slices, its diagonal apart. Places that fill up a slice hold zeros.
struct SlicedMatrix {
  SlicedPattern pattern;
  std::vector<double> diagonal;     ///< [rows], must not be zero
  std::vector<double> off_diagonal; ///< [pattern.stored()]

  int rows() const { return pattern.rows; }
  /// Calls body(column, value) for the entries of row i off the diagonal, zeros included.
  template <class Body> void for_each_entry(int i, Body &&body) const {
    for (int k = 0; k < pattern.width(i); ++k)
      body(pattern.column[pattern.place(i, k)], off_diagonal[pattern.place(i, k)]);
  }
};

/// The same matrix in compressed rows, without the zeros.
SparseMatrix compressed(const SlicedMatrix &matrix);

/// The matrix D^-1 A of a solve, D = diag(A): unit diagonal, which is not stored, and off-diagonal
/// entries in double for the outer iteration and in float for the preconditioner. Rows scaled this
/// way have comparable size whatever their kind, and residuals have the unit of the unknown.
class ScaledMatrix {
public:
  ScaledMatrix() = default;
  ScaledMatrix(const ScaledMatrix &) = delete;
  ScaledMatrix &operator=(const ScaledMatrix &) = delete;

  /// Keeps a reference to `a`, whose doubles the outer iteration reads.
  void build(const SlicedMatrix &a);
  /// Keeps a copy of `a` in slices.
  void build(const SparseMatrix &a);

  int rows() const { return matrix_->rows(); }
  std::size_t entries() const { return entries_; }
  const SlicedPattern &pattern() const { return matrix_->pattern; }
  const std::vector<float> &off_diagonal_float() const { return value_float_; }
  /// 1 / a_ii
  double inverse_diagonal(int i) const { return inverse_diagonal_[i]; }
  /// body(i, (D^-1 A x)_i) for the rows of `range`, whose begin is a multiple of 16.
  template <class X, class Body> void multiply(const X *x, IndexRange range, Body &&body) const {
    for_each_product<double>(
        pattern(), matrix_->off_diagonal.data(), x, range,
        [&](int i, double product) { body(i, x[i] + inverse_diagonal_[i] * product); });
  }

private:
  const SlicedMatrix *matrix_ = &sliced_;
  SlicedMatrix sliced_; // of compressed rows
  std::size_t entries_ = 0;
  std::vector<double> inverse_diagonal_; // filled up to whole slices
  std::vector<float> value_float_;
};

} // namespace sluice::fluid
