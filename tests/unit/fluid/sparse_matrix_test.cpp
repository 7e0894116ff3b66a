// SPDX-License-Identifier: MIT
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
