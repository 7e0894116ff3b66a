// SPDX-License-Identifier: MIT
#include "fluid/compact_matrix.hpp"

#include <limits>

namespace sluice::fluid {
namespace {

constexpr int largest_value = std::numeric_limits<std::int16_t>::max();

} // namespace

bool CompactMatrix::build(const UnitDiagonalView &matrix) {
  constexpr int lanes = SlicedPattern::lanes;
  const SlicedPattern &pattern = matrix.pattern;
  // Never smaller than before: growing again would clear them.
  const auto make_room = [](auto &values, std::size_t n) {
    if (values.size() < n)
      values.resize(n);
  };
  make_room(value_, pattern.stored());
  make_room(column_, pattern.stored());
  make_room(unit_, static_cast<std::size_t>(pattern.slices()) * lanes);
  make_room(diagonal_, static_cast<std::size_t>(pattern.slices()) * lanes);
  const double too_far = block_sums<1>(
      pattern.rows,
      [&](IndexRange range) {
        double failed = 0;
        for (int first = range.begin; first < range.end; first += lanes)
          failed += !build_slice(matrix, first / lanes);
        return std::array<double, 1>{failed};
      },
      Work::heavy)[0];
  return too_far == 0;
}

bool CompactMatrix::build_slice(const UnitDiagonalView &matrix, int slice) {
  constexpr int lanes = SlicedPattern::lanes;
  const int first = slice * lanes;
  const std::size_t begin = matrix.pattern.place(first, 0);
  const std::size_t end = begin + static_cast<std::size_t>(matrix.pattern.width(first)) * lanes;
  Floats largest{}, row_sum{};
  Ints farthest{};
  for (std::size_t at = begin; at < end; at += lanes) {
    const Floats v = load(&matrix.off_diagonal[at]), magnitude = v < 0 ? -v : v;
    largest = magnitude > largest ? magnitude : largest;
    row_sum += v;
    const Ints column = load(&matrix.pattern.column[at]) - first;
    const Ints distance = column < 0 ? -column : column;
    farthest = distance > farthest ? distance : farthest;
    store_shorts(column, &column_[at]);
  }
  const Floats unit = largest / static_cast<float>(largest_value);
  const Floats scale = largest > 0 ? 1 / unit : Floats{};
  Ints sum{};
  for (std::size_t at = begin; at < end; at += lanes) {
    const Floats v = load(&matrix.off_diagonal[at]) * scale;
    const Ints rounded =
        __builtin_convertvector(v + (v < 0 ? Floats{} - 0.5f : Floats{} + 0.5f), Ints);
    sum += rounded;
    store_shorts(rounded, &value_[at]);
  }
  store(unit, &unit_[first]);
  store(1 + row_sum - unit * __builtin_convertvector(sum, Floats), &diagonal_[first]);
  int distance = 0;
  for (int lane = 0; lane < lanes; ++lane)
    distance = std::max(distance, farthest[lane]);
  return distance <= largest_value;
}

} // namespace sluice::fluid
