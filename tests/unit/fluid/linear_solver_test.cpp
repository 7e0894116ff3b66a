// SPDX-License-Identifier: MIT
#include "fluid/multigrid.hpp"
#include "tests/support/poisson_cloud.hpp"

#include <gtest/gtest.h>

#include <limits>

namespace sluice::fluid {
namespace {

using testing::Cloud;
using testing::CloudParams;
using testing::make_cloud;
using testing::Top;

// Matrix, preconditioner and memory of a sequence of solves.
struct Solver {
  ScaledMatrix matrix;
  Multigrid multigrid;
  KrylovMemory memory;

  void build(const SparseMatrix &a, std::span<const Cell> cells) {
    matrix.build(a);
    multigrid.build(matrix, cells);
  }
  SolveResult solve(std::span<const double> b, std::span<double> x, SolveOptions options = {}) {
    return bicgstab(matrix, b, x, multigrid, options, memory);
  }
};

std::vector<double> wavy(int n) {
  std::vector<double> b(n);
  for (int i = 0; i < n; ++i)
    b[i] = 1 + std::sin(0.37 * i);
  return b;
}

// Root mean square of D^-1 (b - A x).
double residual(const SparseMatrix &a, std::span<const double> b, std::span<const double> x) {
  double total = 0;
  for (int i = 0; i < a.rows(); ++i) {
    double r = b[i];
    for (int k = a.row_start[i]; k < a.row_start[i + 1]; ++k)
      r -= a.value[k] * x[a.column[k]];
    total += r * r / (a.diagonal(i) * a.diagonal(i));
  }
  return std::sqrt(total / a.rows());
}

TEST(LinearSolver, the_reported_residual_is_that_of_the_solution) {
  const auto cloud = make_cloud<2>({.points = {40, 56}});
  Solver solver;
  solver.build(cloud.matrix, cloud.cell);
  const auto b = wavy(cloud.matrix.rows());
  std::vector<double> x(b.size(), 0.0), zero = x;
  const auto result = solver.solve(b, x, {.relative_tolerance = 1e-8});
  EXPECT_TRUE(result.converged);
  EXPECT_LE(result.residual, 1e-8 * residual(cloud.matrix, b, zero));
  EXPECT_NEAR(result.residual, residual(cloud.matrix, b, x), 1e-4 * result.residual);
}

TEST(LinearSolver, iterations_do_not_grow_with_the_number_of_points) {
  for (const int nx : {25, 50, 100}) {
    const auto cloud = make_cloud<2>({.points = {nx, nx * 7 / 5}});
    Solver solver;
    solver.build(cloud.matrix, cloud.cell);
    const auto b = wavy(cloud.matrix.rows());
    std::vector<double> x(b.size(), 0.0);
    const auto result = solver.solve(b, x, {.relative_tolerance = 1e-8});
    EXPECT_TRUE(result.converged);
    EXPECT_LE(result.iterations, 7) << b.size() << " points";
  }
}

} // namespace
} // namespace sluice::fluid
