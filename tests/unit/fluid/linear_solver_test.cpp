// SPDX-License-Identifier: MIT
#include "fluid/multigrid.hpp"
#include "tests/support/allocation_counter.hpp"
#include "tests/support/poisson_cloud.hpp"

#include <gtest/gtest.h>

#include <limits>
#include <random>

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

  Solver() = default;
  Solver(const SparseMatrix &a, std::span<const Cell> cells) { build(a, cells); }
  void build(const SparseMatrix &a, std::span<const Cell> cells) {
    matrix.build(a);
    multigrid.build(matrix, cells);
  }
  SolveResult solve(std::span<const double> b, std::span<double> x, SolveOptions options = {}) {
    return bicgstab(matrix, b, x, multigrid, options, memory);
  }
};

constexpr SolveOptions tight{.relative_tolerance = 1e-8};

std::vector<double> wavy(int n) {
  std::vector<double> b(n);
  for (int i = 0; i < n; ++i)
    b[i] = 1 + std::sin(0.37 * i);
  return b;
}

// Root mean square of D^-1 (b - A x - multiplier).
double residual(const SparseMatrix &a, std::span<const double> b, std::span<const double> x,
                double multiplier = 0) {
  double total = 0;
  for (int i = 0; i < a.rows(); ++i) {
    double r = b[i] - multiplier;
    for (int k = a.row_start[i]; k < a.row_start[i + 1]; ++k)
      r -= a.value[k] * x[a.column[k]];
    total += r * r / (a.diagonal(i) * a.diagonal(i));
  }
  return std::sqrt(total / std::max(1, a.rows()));
}

// Solves for a wavy right-hand side from zero, expects success and returns the iterations.
int iterations(const SparseMatrix &a, std::span<const Cell> cells) {
  Solver solver(a, cells);
  const auto b = wavy(a.rows());
  std::vector<double> x(b.size(), 0.0);
  const auto result = solver.solve(b, x, tight);
  EXPECT_TRUE(result.converged);
  EXPECT_LE(residual(a, b, x), 1.001e-8 * residual(a, b, std::vector<double>(b.size(), 0.0)));
  return result.iterations;
}

TEST(LinearSolver, the_reported_residual_is_that_of_the_solution) {
  const auto cloud = make_cloud<2>({.points = {40, 56}});
  Solver solver(cloud.matrix, cloud.cell);
  const auto b = wavy(cloud.matrix.rows());
  std::vector<double> x(b.size(), 0.0);
  const auto result = solver.solve(b, x, tight);
  EXPECT_TRUE(result.converged);
  EXPECT_NEAR(result.residual, residual(cloud.matrix, b, x), 1e-4 * result.residual);
}

TEST(LinearSolver, iterations_do_not_grow_with_the_number_of_points) {
  for (const double jitter : {0.1, 0.25})
    for (const double radius : {2.1, 2.6})
      for (const int nx : {25, 50, 100}) {
        const auto cloud =
            make_cloud<2>({.points = {nx, nx * 7 / 5}, .jitter = jitter, .radius = radius});
        EXPECT_LE(iterations(cloud.matrix, cloud.cell), 6)
            << nx << " points wide, jitter " << jitter << ", radius " << radius;
      }
}

TEST(LinearSolver, iterations_stay_few_in_space) {
  for (const int n : {8, 16}) {
    const auto cloud = make_cloud<3>({.points = {n, n, n}});
    EXPECT_LE(iterations(cloud.matrix, cloud.cell), 6) << n;
  }
}

TEST(LinearSolver, algebraic_and_identity_rows_at_the_surface_cost_no_iterations) {
  for (const Top top : {Top::identity, Top::algebraic}) {
    const auto cloud = make_cloud<2>({.points = {50, 70}, .top = top});
    EXPECT_LE(iterations(cloud.matrix, cloud.cell), 6);
  }
}

// A box with a wavy surface, 4 to 12 spacings below its top: points of the outermost layer follow
// one neighbour below them, those above are given.
SparseMatrix wavy_surface(const Cloud<2> &cloud, double top, unsigned seed) {
  std::mt19937 engine(seed);
  std::uniform_real_distribution<double> uniform(0, 1);
  SparseMatrix a = cloud.matrix;
  const double phase = 6.28 * uniform(engine);
  for (int i = 0; i < a.rows(); ++i) {
    const int first = a.row_start[i], last = a.row_start[i + 1];
    const double above =
        cloud.position[i].y() - top + 8 + 4 * std::sin(phase + 0.2 * cloud.position[i].x());
    if (last - first < 3 || above < 0)
      continue;
    std::fill(a.value.begin() + first, a.value.begin() + last, 0.0);
    a.value[first] = 1;
    const int k = first + 1 + static_cast<int>(uniform(engine) * (last - first - 1));
    if (above < 1 && cloud.position[a.column[k]].y() < cloud.position[i].y())
      a.value[k] = -uniform(engine);
  }
  return a;
}

// Where a cell holds a single row of the surface, smoothing may cancel its basis function; then the
// coarse rows around it had diagonals of rounding error and the cycle amplified a hundredfold.
TEST(LinearSolver, it_does_not_matter_where_the_surface_cuts_the_cells) {
  const auto cloud =
      make_cloud<2>({.points = {50, 60}, .jitter = 0.4, .radius = 2.6, .top = Top::algebraic});
  const auto cells = testing::cells_of<2>(cloud.position, 2.0);
  for (unsigned seed = 1; seed <= 400; ++seed)
    EXPECT_LE(iterations(wavy_surface(cloud, 60, seed), cells), 8) << "seed " << seed;
}

TEST(LinearSolver, the_scaling_of_single_rows_does_not_matter) {
  const auto cloud = make_cloud<2>({.points = {30, 40}, .top = Top::algebraic});
  SparseMatrix scaled = cloud.matrix;
  auto b = wavy(scaled.rows()), b_scaled = b;
  for (int i = 0; i < scaled.rows(); ++i) {
    const double factor = std::ldexp(1.0, i % 40 - 20);
    b_scaled[i] *= factor;
    for (int k = scaled.row_start[i]; k < scaled.row_start[i + 1]; ++k)
      scaled.value[k] *= factor;
  }
  std::vector<double> x(b.size(), 0.0), x_scaled = x;
  Solver(cloud.matrix, cloud.cell).solve(b, x, tight);
  Solver(scaled, cloud.cell).solve(b_scaled, x_scaled, tight);
  EXPECT_EQ(x, x_scaled);
}

TEST(LinearSolver, one_and_two_threads_give_the_same_bits) {
  const int before = number_of_threads();
  const auto cloud = make_cloud<2>({.points = {100, 120}}); // enough for every loop to be shared
  const auto b = wavy(cloud.matrix.rows());
  std::array<std::vector<double>, 2> x;
  for (const int threads : {1, 2}) {
    set_number_of_threads(threads);
    x[threads - 1].assign(b.size(), 0.0);
    Solver(cloud.matrix, cloud.cell).solve(b, x[threads - 1], tight);
  }
  set_number_of_threads(before);
  EXPECT_EQ(x[0], x[1]);
}

// The matrix of two clouds side by side, which do not touch.
SparseMatrix block_diagonal(const SparseMatrix &a, const SparseMatrix &b) {
  SparseMatrix both = a;
  for (const int column : b.column)
    both.column.push_back(column + a.rows());
  both.value.insert(both.value.end(), b.value.begin(), b.value.end());
  for (int i = 1; i <= b.rows(); ++i)
    both.row_start.push_back(a.row_start.back() + b.row_start[i]);
  return both;
}

TEST(LinearSolver, pieces_that_do_not_touch_are_solved_together) {
  const auto pool = make_cloud<2>({.points = {40, 40}});
  const auto drop = make_cloud<2>({.points = {5, 4}, .top = Top::algebraic});
  auto cells = pool.cell;
  // One drop in cells that the pool fills, where only the smoother reaches it, and one far away.
  for (const int offset : {0, 100'000})
    for (Cell cell : drop.cell) {
      cell[0] += offset;
      cells.push_back(cell);
    }
  const auto matrix = block_diagonal(block_diagonal(pool.matrix, drop.matrix), drop.matrix);
  EXPECT_LE(iterations(matrix, cells), 10);
}

TEST(LinearSolver, isolated_rows_are_solved_exactly_and_slow_nothing_down) {
  SparseMatrix single;
  single.row_start = {0, 1};
  single.column = {0};
  single.value = {1e9};
  const auto pool = make_cloud<2>({.points = {40, 40}});
  auto cells = pool.cell;
  auto matrix = pool.matrix;
  for (int k = 0; k < 100; ++k) {
    matrix = block_diagonal(matrix, single);
    cells.push_back({k / 10, k % 10, 0});
  }
  EXPECT_LE(iterations(matrix, cells), 6);
}

TEST(LinearSolver, the_smallest_systems_are_solved) {
  for (const int n : {0, 1, 2, 17}) {
    SparseMatrix diagonal;
    std::vector<Cell> cells(n, Cell{});
    for (int i = 0; i < n; ++i) {
      diagonal.column.push_back(i);
      diagonal.value.push_back(i + 2.0);
      diagonal.row_start.push_back(i + 1);
    }
    EXPECT_LE(iterations(diagonal, cells), 1) << n;
  }
}

TEST(LinearSolver, many_rows_that_are_all_given_need_one_iteration) {
  const int n = 2000;
  SparseMatrix identity;
  for (int i = 0; i < n; ++i) {
    identity.column.push_back(i);
    identity.value.push_back(1);
    identity.row_start.push_back(i + 1);
  }
  EXPECT_LE(iterations(identity, std::vector<Cell>(n, Cell{})), 1);
}

TEST(LinearSolver, an_enclosed_fluid_is_solved_up_to_its_mean) {
  const auto cloud = make_cloud<2>({.points = {50, 60}, .top = Top::wall});
  Solver solver(cloud.matrix, cloud.cell);
  const auto b = wavy(cloud.matrix.rows());
  std::vector<double> x(b.size(), 0.0);
  const auto result =
      solver.solve(b, x, {.relative_tolerance = 1e-8, .null_space = NullSpace::constants});
  EXPECT_TRUE(result.converged);
  EXPECT_LE(result.iterations, 8);
  EXPECT_NEAR(residual(cloud.matrix, b, x, result.multiplier), result.residual,
              1e-3 * result.residual);
  double mean = 0, largest = 0;
  for (const double value : x) {
    mean += value / static_cast<double>(x.size());
    largest = std::max(largest, std::abs(value));
  }
  EXPECT_LT(std::abs(mean), 1e-6 * largest);
}

TEST(LinearSolver, nothing_to_solve_takes_no_iteration) {
  const auto cloud = make_cloud<2>({.points = {20, 20}});
  Solver solver(cloud.matrix, cloud.cell);
  std::vector<double> b(cloud.matrix.rows(), 0.0), x = b;
  const auto result = solver.solve(b, x, tight);
  EXPECT_TRUE(result.converged);
  EXPECT_EQ(result.iterations, 0);
}

TEST(LinearSolver, a_right_hand_side_that_is_not_finite_is_refused) {
  const auto cloud = make_cloud<2>({.points = {20, 20}});
  Solver solver(cloud.matrix, cloud.cell);
  for (const double bad :
       {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity()}) {
    auto b = wavy(cloud.matrix.rows());
    b[7] = bad;
    std::vector<double> x(b.size(), 1.0);
    const auto result = solver.solve(b, x, tight);
    EXPECT_FALSE(result.converged);
    EXPECT_EQ(result.iterations, 0);
    EXPECT_EQ(x, std::vector<double>(b.size(), 1.0));
  }
}

TEST(LinearSolver, the_size_of_the_right_hand_side_does_not_matter) {
  const auto cloud = make_cloud<2>({.points = {20, 20}});
  for (const double size : {1e-200, 1e200}) {
    Solver solver(cloud.matrix, cloud.cell);
    auto b = wavy(cloud.matrix.rows());
    for (double &value : b)
      value *= std::sqrt(size);
    std::vector<double> x(b.size(), 0.0);
    EXPECT_TRUE(solver.solve(b, x, tight).converged) << size;
  }
}

TEST(LinearSolver, a_good_guess_saves_iterations) {
  const auto cloud = make_cloud<2>({.points = {50, 70}});
  Solver solver(cloud.matrix, cloud.cell);
  auto b = wavy(cloud.matrix.rows());
  std::vector<double> x(b.size(), 0.0);
  const int cold = solver.solve(b, x, tight).iterations;
  EXPECT_EQ(solver.solve(b, x, tight).iterations, 0);
  for (double &value : b)
    value *= 1 + 1e-4;
  EXPECT_LE(solver.solve(b, x, tight).iterations, cold / 2 + 1);
}

TEST(LinearSolver, a_kept_hierarchy_still_serves_a_matrix_that_has_changed_a_little) {
  const auto before = make_cloud<2>({.points = {50, 70}, .jitter = 0.1});
  Solver solver(before.matrix, before.cell);
  SparseMatrix after = before.matrix;
  for (std::size_t k = 0; k < after.value.size(); ++k)
    after.value[k] *= 1 + 0.02 * std::sin(static_cast<double>(k));
  for (int i = 0; i < after.rows(); ++i) { // keep the row sums of a Laplacian
    double change = 0;
    for (int k = after.row_start[i]; k < after.row_start[i + 1]; ++k)
      change += after.value[k] - before.matrix.value[k];
    after.value[after.row_start[i]] -= change;
  }
  solver.matrix.build(after);
  solver.multigrid.update(solver.matrix);
  const auto b = wavy(after.rows());
  std::vector<double> x(b.size(), 0.0);
  const auto result = solver.solve(b, x, tight);
  EXPECT_TRUE(result.converged);
  EXPECT_LE(result.iterations, 7);
}

TEST(LinearSolver, a_second_step_allocates_nothing) {
  const auto cloud = make_cloud<2>({.points = {50, 70}});
  Solver solver;
  const auto b = wavy(cloud.matrix.rows());
  std::vector<double> x(b.size(), 0.0);
  const auto step = [&] {
    std::fill(x.begin(), x.end(), 0.0);
    solver.build(cloud.matrix, cloud.cell);
    solver.solve(b, x, tight);
    solver.multigrid.update(solver.matrix);
  };
  step();
  const long before = sluice::testing::allocations();
  step();
  EXPECT_EQ(sluice::testing::allocations(), before);
}

} // namespace
} // namespace sluice::fluid
