// SPDX-License-Identifier: MIT
#include "fluid/compact_matrix.hpp"
#include "fluid/sparse_matrix.hpp"
#include "tests/support/poisson_cloud.hpp"

#include <gtest/gtest.h>

#include <sstream>

namespace sluice::fluid {
namespace {

TEST(SparseMatrix, matrix_market_lists_rows_columns_and_values_from_one) {
  SparseMatrix a;
  a.row_start = {0, 2, 3};
  a.column = {0, 1, 1};
  a.value = {2, -1, 0.5};
  std::ostringstream out;
  write_matrix_market(out, a);
  EXPECT_EQ(out.str(),
            "%%MatrixMarket matrix coordinate real general\n2 2 3\n1 1 2\n1 2 -1\n2 2 0.5\n");
}

TEST(CompactMatrix, keeps_row_sums_and_errs_by_the_rounding_of_differences) {
  const auto cloud = testing::make_cloud<2>({.points = {13, 11}});
  ScaledMatrix scaled;
  scaled.build(cloud.matrix);
  const std::vector<float> unused;
  CompactMatrix compact;
  ASSERT_TRUE(compact.build({scaled.pattern(), scaled.off_diagonal_float(), unused}));
  const int n = scaled.rows();
  std::vector<float> constant(n, 1), wavy(n);
  for (int i = 0; i < n; ++i)
    wavy[i] = std::cos(static_cast<float>(i));
  const auto error = [&](const std::vector<float> &x) {
    double largest = 0;
    scaled.multiply(x.data(), {0, n}, [&](int i, double exact) {
      compact.for_each_product(scaled.pattern(), x.data(), {i / 16 * 16, n}, [&](int k, float y) {
        if (k == i)
          largest = std::max(largest, std::abs(y - exact));
      });
    });
    return largest;
  };
  const double of_constant = error(constant), of_waves = error(wavy);
  std::printf("compact rows: %.1e for a constant, %.1e for waves of order one\n", of_constant,
              of_waves);
  EXPECT_LT(of_constant, 2e-6);       // sums of some 15 floats of order one
  EXPECT_LT(of_waves, 15 * 2 * 1e-5); // that many differences up to two, rounded to 1 / 65534
}

TEST(CompactMatrix, refuses_columns_that_are_too_far) {
  SparseMatrix a;
  constexpr int n = 40000;
  for (int i = 0; i < n; ++i) {
    a.column.insert(a.column.end(), {i, n - 1 - i});
    a.value.insert(a.value.end(), {1, -0.5});
    a.row_start.push_back(2 * (i + 1));
  }
  ScaledMatrix scaled;
  scaled.build(a);
  const std::vector<float> unused;
  EXPECT_FALSE(CompactMatrix().build({scaled.pattern(), scaled.off_diagonal_float(), unused}));
}

TEST(ScaledMatrix, a_product_is_that_of_the_rows_divided_by_their_diagonal) {
  const auto cloud = testing::make_cloud<2>({.points = {13, 11}});
  const SparseMatrix &a = cloud.matrix;
  ScaledMatrix scaled;
  scaled.build(a);
  std::vector<double> x(a.rows());
  for (int i = 0; i < a.rows(); ++i)
    x[i] = std::cos(i);
  const std::vector<float> x_float(x.begin(), x.end());
  scaled.multiply(x.data(), {0, a.rows()}, [&](int i, double product) {
    double expected = 0;
    for (int k = a.row_start[i]; k < a.row_start[i + 1]; ++k)
      expected += a.value[k] * x[a.column[k]];
    EXPECT_NEAR(product, expected / a.diagonal(i), 1e-14);
  });
  scaled.multiply(x_float.data(), {16, 32}, [&](int i, double product) {
    double expected = 0;
    for (int k = a.row_start[i]; k < a.row_start[i + 1]; ++k)
      expected += a.value[k] * x_float[a.column[k]];
    EXPECT_NEAR(product, expected / a.diagonal(i), 1e-14);
  });
}

} // namespace
} // namespace sluice::fluid
