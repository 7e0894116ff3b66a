// SPDX-License-Identifier: MIT
#include "fluid/parallel.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

namespace sluice::fluid {
namespace {

TEST(Parallel, blocks_cover_every_index_once) {
  for (const int n : {0, 1, 15, 512, 513, 5000, 100'003}) {
    std::vector<int> visits(n, 0);
    for_each_index(n, [&](int i) { ++visits[i]; });
    EXPECT_EQ(std::count(visits.begin(), visits.end(), 1), n);
    EXPECT_LE(Blocks(n).count(), Blocks::max_count);
    for (int b = 0; b < Blocks(n).count(); ++b)
      EXPECT_EQ(Blocks(n)[b].begin % Blocks::granularity, 0);
  }
}

TEST(Parallel, a_sum_has_the_same_bits_with_one_and_two_threads) {
  const int before = number_of_threads();
  const auto term = [](int i) { return std::sin(i) / (1 + i); };
  set_number_of_threads(1);
  const double one = sum(50'000, term);
  set_number_of_threads(2);
  EXPECT_EQ(sum(50'000, term), one);
  set_number_of_threads(before);
}

TEST(Parallel, several_sums_go_through_the_data_once) {
  const auto [count, total] = block_sums<2>(3000, [](IndexRange range) {
    std::array<double, 2> part{};
    for (int i = range.begin; i < range.end; ++i) {
      part[0] += 1;
      part[1] += i;
    }
    return part;
  });
  EXPECT_EQ(count, 3000);
  EXPECT_EQ(total, 3000.0 * 2999 / 2);
}

} // namespace
} // namespace sluice::fluid
