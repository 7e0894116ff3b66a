// SPDX-License-Identifier: MIT
// A matrix for smoothing with: four bytes an entry instead of eight, as sweeps over it are bound by
// memory. Values are 16-bit integers in units of 1/32767 of the largest of their row; columns are
// counted from the first row of the slice, since points sorted by cell have their neighbours near.
//
// The rounding of a row's entries is made good on its diagonal, so that row sums stay those of the
// matrix: rounding then acts on differences between neighbours, which are small where the unknown
// is smooth, and costs no iterations up to a million points.
#pragma once

#include "fluid/aggregates.hpp"

#include <cstdint>
#include <vector>

namespace sluice::fluid {

class CompactMatrix {
public:
  /// Of I + O; `matrix.off_diagonal_sum` need not be set. False, and not usable, where a column is
  /// too far from its row.
  bool build(const UnitDiagonalView &matrix);

  /// Calls body(i, sum over j of a_ij x_j) for the rows of `range`, whose begin is a multiple of
  /// 16. `pattern` is that of the matrix.
  template <class Body>
  void for_each_product(const SlicedPattern &pattern, const float *x, IndexRange range,
                        Body &&body) const {
    constexpr int lanes = SlicedPattern::lanes;
    for (int first = range.begin; first < range.end; first += lanes) {
      const std::size_t begin = pattern.place(first, 0);
      const Floats sum =
          near_sums(&value_[begin], &column_[begin], pattern.width(first), x + first);
      const int count = std::min(lanes, range.end - first);
      for (int lane = 0; lane < count; ++lane) {
        const int i = first + lane;
        body(i, diagonal_[i] * x[i] + unit_[i] * sum[lane]);
      }
    }
  }

private:
  bool build_slice(const UnitDiagonalView &matrix, int slice);

  std::vector<std::int16_t> value_, column_; // [stored entries]
  std::vector<float> unit_, diagonal_;       // [rows], filled up to whole slices
};

} // namespace sluice::fluid
