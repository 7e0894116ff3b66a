// SPDX-License-Identifier: MIT
#include "fluid/multigrid.hpp"
#include "tests/support/poisson_cloud.hpp"

#include <gtest/gtest.h>

namespace sluice::fluid {
namespace {

using testing::cells_of;
using testing::Cloud;
using testing::make_cloud;

using Dense = Eigen::MatrixXd;

// One step of coarsening of a cloud, everything kept.
template <int dim> struct Step {
  ScaledMatrix matrix;
  std::vector<float> off_diagonal_sum;
  Aggregates aggregates;
  CoarseLevel level;

  Step(const Cloud<dim> &cloud, double cell_size, const CoarseningParams &params) {
    matrix.build(cloud.matrix);
    sum_magnitudes(matrix.pattern(), matrix.off_diagonal_float(), off_diagonal_sum);
    const auto cells = cells_of<dim>(cloud.position, cell_size);
    AggregateFinder finder;
    finder.find(view(), cells, aggregates);
    GalerkinProduct().build(dim, view(), aggregates, finder, params, level);
  }
  UnitDiagonalView view() const {
    return {matrix.pattern(), matrix.off_diagonal_float(), off_diagonal_sum};
  }
};

Dense dense(const UnitDiagonalView &matrix) {
  Dense a = Dense::Identity(matrix.rows(), matrix.rows());
  for (int i = 0; i < matrix.rows(); ++i)
    matrix.for_each_entry(i, [&](int j, float value) { a(i, j) += value; });
  return a;
}

Dense piecewise_constant(const Aggregates &aggregates) {
  Dense p = Dense::Zero(static_cast<int>(aggregates.of_row.size()), aggregates.count());
  for (int i = 0; i < p.rows(); ++i)
    if (aggregates.of_row[i] >= 0)
      p(i, aggregates.of_row[i]) = 1;
  return p;
}

Dense columns_of_prolongation(const Transfer &transfer, int rows) {
  Dense p(rows, transfer.aggregates());
  for (int a = 0; a < p.cols(); ++a) {
    std::vector<float> unit(p.cols(), 0.0f), column(rows, 0.0f);
    unit[a] = 1;
    transfer.prolong(unit, column);
    for (int i = 0; i < rows; ++i)
      p(i, a) = column[i];
  }
  return p;
}

Dense coarse_matrix(const CoarseLevel &level) {
  const int n = level.transfer.aggregates();
  const std::vector<float> off_diagonal_sum;
  Dense a = dense({level.off_diagonal.pattern, level.off_diagonal.value, off_diagonal_sum});
  for (int i = 0; i < n; ++i)
    a.row(i) /= level.scale[i];
  return a;
}

// Cells as large as the stencils' radius: nothing reaches beyond the next cell.
template <int dim> void expect_transfers_and_product(const Cloud<dim> &cloud) {
  Step<dim> step(cloud, 2.1, {.prolongation_weight = 0.7f, .drop_tolerance = 0});
  const int n = step.matrix.rows(), n_coarse = step.aggregates.count();
  const Dense a = dense(step.view());
  Dense weight = Dense::Zero(n, n);
  for (int i = 0; i < n; ++i)
    weight(i, i) = 1.4 / std::max(2.0, a.row(i).cwiseAbs().sum());
  const Dense p = (Dense::Identity(n, n) - weight * a) * piecewise_constant(step.aggregates);
  EXPECT_LT((columns_of_prolongation(step.level.transfer, n) - p).cwiseAbs().maxCoeff(), 1e-6);
  EXPECT_LT((coarse_matrix(step.level) - p.transpose() * a * p).cwiseAbs().maxCoeff(), 2e-6);

  std::vector<float> coarse(n_coarse), ones(n_coarse, 1.0f), r(n);
  for (int i = 0; i < n; ++i)
    r[i] = std::sin(0.7f * i);
  step.level.transfer.restrict(r, ones, coarse);
  const Eigen::VectorXd expected =
      p.transpose() * Eigen::Map<const Eigen::VectorXf>(r.data(), n).cast<double>();
  for (int c = 0; c < n_coarse; ++c)
    EXPECT_NEAR(coarse[c], expected[c], 1e-5);
}

TEST(Multigrid, transfers_are_transposes_and_the_coarse_matrix_is_r_a_p_in_the_plane) {
  expect_transfers_and_product<2>(make_cloud<2>({.points = {17, 15}}));
}

TEST(Multigrid, transfers_are_transposes_and_the_coarse_matrix_is_r_a_p_in_space) {
  expect_transfers_and_product<3>(make_cloud<3>({.points = {8, 7, 9}}));
}

TEST(Multigrid, identity_rows_are_in_no_aggregate_and_stay_out_of_the_coarse_matrix) {
  const auto cloud = make_cloud<2>({.points = {17, 15}, .top = testing::Top::identity});
  Step<2> step(cloud, 2.1, {});
  for (int i = 0; i < step.matrix.rows(); ++i) {
    const bool is_surface = cloud.matrix.row_start[i + 1] - cloud.matrix.row_start[i] == 1;
    EXPECT_EQ(step.aggregates.of_row[i] < 0, is_surface);
  }
}

TEST(Multigrid, lumping_small_entries_keeps_row_sums) {
  const auto cloud = make_cloud<2>({.points = {17, 15}});
  const Dense all = coarse_matrix(Step<2>(cloud, 2.1, {.drop_tolerance = 0}).level);
  const Dense lumped = coarse_matrix(Step<2>(cloud, 2.1, {.drop_tolerance = 0.05f}).level);
  EXPECT_LT((lumped.array() != 0).count(), (all.array() != 0).count());
  EXPECT_LT((lumped.rowwise().sum() - all.rowwise().sum()).cwiseAbs().maxCoeff(), 1e-5);
}

TEST(Multigrid, entries_beyond_the_next_cell_keep_the_row_sums_of_the_coarse_matrix) {
  const auto cloud = make_cloud<2>({.points = {17, 15}});
  Step<2> step(cloud, 1.6, {.drop_tolerance = 0});
  const Eigen::VectorXd ones = Eigen::VectorXd::Ones(step.aggregates.count());
  const Dense p = columns_of_prolongation(step.level.transfer, step.matrix.rows());
  const Eigen::VectorXd fine_sums = dense(step.view()) * p * ones;
  EXPECT_NEAR((coarse_matrix(step.level) * ones).sum(), (p.transpose() * fine_sums).sum(), 1e-3);
}

TEST(Multigrid, rows_without_neighbours_are_solved_by_one_cycle) {
  SparseMatrix a;
  for (int i = 0; i < 200; ++i) {
    a.column.push_back(i);
    a.value.push_back(3);
    a.row_start.push_back(i + 1);
  }
  ScaledMatrix matrix;
  matrix.build(a);
  Multigrid multigrid;
  multigrid.build(matrix, std::vector<Cell>(200, Cell{}));
  const std::vector<double> r(200, 0.5);
  std::vector<float> z(200);
  multigrid.apply(r, z);
  EXPECT_EQ(z, std::vector<float>(200, 0.5f));
}

// A chain of rows, each coupled to the next; `cut` removes one link.
SparseMatrix chain(int n, int cut) {
  SparseMatrix a;
  for (int i = 0; i < n; ++i) {
    a.column.push_back(i);
    a.value.push_back(2);
    for (const int j : {i - 1, i + 1})
      if (j >= 0 && j < n && std::max(i, j) != cut) {
        a.column.push_back(j);
        a.value.push_back(-1);
      }
    a.row_start.push_back(static_cast<int>(a.column.size()));
  }
  return a;
}

TEST(Aggregates, a_cell_cut_by_a_wall_gives_its_smaller_part_to_the_cell_it_is_connected_to) {
  ScaledMatrix matrix;
  matrix.build(chain(8, 5)); // 0 1 2 3 4 | 5 6 7, the wall in the cell of 3 4 5
  const std::vector<Cell> cells{{0, 0, 0}, {0, 0, 0}, {0, 0, 0}, {1, 0, 0},
                                {1, 0, 0}, {1, 0, 0}, {2, 0, 0}, {2, 0, 0}};
  Aggregates aggregates;
  const std::vector<float> off_diagonal_sum(8, 1);
  AggregateFinder().find({matrix.pattern(), matrix.off_diagonal_float(), off_diagonal_sum}, cells,
                         aggregates);
  EXPECT_EQ(aggregates.of_row, (std::vector<int>{0, 0, 0, 1, 1, 2, 2, 2}));
}

TEST(Aggregates, beyond_the_box_of_all_cells_there_are_none) {
  ScaledMatrix matrix;
  matrix.build(chain(4, 2));
  const std::vector<Cell> cells{{-2, 3, 0}, {-1, 3, 0}, {-2, 4, 0}, {-1, 4, 0}};
  Aggregates aggregates;
  AggregateFinder finder;
  const std::vector<float> off_diagonal_sum(4, 1);
  finder.find({matrix.pattern(), matrix.off_diagonal_float(), off_diagonal_sum}, cells, aggregates);
  for (int a = 0; a < 4; ++a)
    EXPECT_EQ(finder.aggregate_in(cells[a]), a);
  for (const Cell &outside : {Cell{0, 3, 0}, Cell{-3, 4, 0}, Cell{-1, 5, 0}, Cell{-1, 4, 1}})
    EXPECT_EQ(finder.aggregate_in(outside), -1);
}

TEST(Aggregates, negative_cells_and_far_away_ones_are_cells_like_others) {
  ScaledMatrix matrix;
  matrix.build(chain(4, 2));
  const std::vector<Cell> cells{{-1, -1, 0}, {-2, -1, 0}, {900'000, -5, 0}, {900'000, -4, 0}};
  Aggregates aggregates;
  AggregateFinder finder;
  const std::vector<float> off_diagonal_sum(4, 1);
  finder.find({matrix.pattern(), matrix.off_diagonal_float(), off_diagonal_sum}, cells, aggregates);
  EXPECT_EQ(aggregates.of_row, (std::vector<int>{0, 1, 2, 3}));
  EXPECT_EQ(finder.aggregate_in(moved({900'000, -5, 0}, {0, 1, 0})), 3);
  EXPECT_EQ(finder.aggregate_in({0, 0, 0}), -1);
}

} // namespace
} // namespace sluice::fluid
