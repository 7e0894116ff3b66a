// SPDX-License-Identifier: MIT
#include "fluid/multigrid.hpp"

#include <cmath>
#include <numeric>

namespace sluice::fluid {
namespace {

constexpr int most_levels = 32; // 32-bit cell coordinates have come down to one cell by then

// Rows have a unit diagonal; a smaller pivot is that of a piece that is enclosed by walls.
constexpr double vanishing_pivot = 1e-5;
// Row sums, in units of the diagonal, that are zero but for the rounding of single precision.
constexpr double vanishing_row_sum = 1e-4;

int floor_divided(int a, int b) { return a >= 0 ? a / b : -((-a + b - 1) / b); }

int dimension_of(std::span<const Cell> cells) {
  const bool is_plane = std::all_of(cells.begin(), cells.end(),
                                    [&](const Cell &cell) { return cell[2] == cells[0][2]; });
  return is_plane ? 2 : 3;
}

} // namespace

double Multigrid::operator_complexity() const {
  const auto finest = static_cast<double>(matrix_->entries());
  double total = finest;
  for (int l = 0; l + 1 < n_levels_; ++l)
    total += static_cast<double>(level_[l].coarser.entries);
  return total / std::max(finest, 1.0);
}

UnitDiagonalView Multigrid::view(int level) const {
  if (level == 0)
    return {matrix_->pattern(), matrix_->off_diagonal_float(), level_[0].off_diagonal_sum};
  const SlicedFloats &matrix = level_[level - 1].coarser.off_diagonal;
  return {matrix.pattern, matrix.value, level_[level].off_diagonal_sum};
}

void Multigrid::build(const ScaledMatrix &matrix, std::span<const Cell> cells) {
  level_.resize(most_levels);
  matrix_ = &matrix;
  dim_ = dimension_of(cells);
  level_[0].cell.assign(cells.begin(), cells.end());
  start_level(0);
  n_levels_ = 1;
  while (level_[n_levels_ - 1].rows > params_.coarsest_size && n_levels_ < most_levels) {
    coarsen(n_levels_ - 1);
    if (level_[n_levels_].rows == 0)
      break;
    ++n_levels_;
  }
  invert_coarsest();
}

void Multigrid::update(const ScaledMatrix &matrix) {
  matrix_ = &matrix;
  start_level(0);
}

// Vectors and weights; a row without off-diagonal entries is solved by its diagonal.
void Multigrid::start_level(int level) {
  Level &l = level_[level];
  const auto matrix = view(level);
  const auto weight = static_cast<float>(params_.smoothing_weight);
  l.rows = matrix.rows();
  sum_magnitudes(matrix.pattern, matrix.off_diagonal, l.off_diagonal_sum);
  l.weight.resize(l.rows);
  for_each_index(l.rows, [&](int i) {
    l.weight[i] = matrix.is_isolated(i) ? 1 : bounded_weight(weight, l.off_diagonal_sum[i]);
  });
  for (auto *vector : {&l.b, &l.x, &l.r})
    vector->resize(l.rows);
  l.is_compact = l.compact.build(matrix);
}

void Multigrid::coarsen(int level) {
  Level &fine = level_[level], &coarse = level_[level + 1];
  finder_.find(view(level), fine.cell, aggregates_);
  const CoarseningParams params{.prolongation_weight =
                                    static_cast<float>(params_.prolongation_weight),
                                .drop_tolerance = static_cast<float>(params_.drop_tolerance)};
  product_.build(dim_, view(level), aggregates_, finder_, params, fine.coarser);
  coarse.cell.resize(aggregates_.count());
  for_each_index(aggregates_.count(), [&](int a) {
    for (int d = 0; d < 3; ++d)
      coarse.cell[a][d] = floor_divided(aggregates_.cell[a][d], params_.coarsening);
  });
  start_level(level + 1);
}

// Gauss-Jordan without exchange of rows: the coarsest matrix is close to an M-matrix.
void Multigrid::invert_coarsest() {
  const int n = level_[n_levels_ - 1].rows;
  inverse_.clear();
  if (n > params_.coarsest_size)
    return;
  work_.assign(static_cast<std::size_t>(n) * n, 0);
  const auto matrix = view(n_levels_ - 1);
  for (int i = 0; i < n; ++i) {
    work_[i * n + i] = 1;
    matrix.for_each_entry(i, [&](int j, float value) { work_[i * n + j] += value; });
  }
  shift_constants(n);
  for (int pivot = 0; pivot < n; ++pivot)
    eliminate(pivot, n);
  inverse_.assign(work_.begin(), work_.end());
}

// Where all rows sum to zero a constant has no residual: A + 1 1^T / n is regular, has the same
// inverse for everything else, and its answer to a constant is small.
void Multigrid::shift_constants(int n) {
  for (int i = 0; i < n; ++i) {
    const auto row = work_.begin() + static_cast<std::ptrdiff_t>(i) * n;
    if (std::abs(std::accumulate(row, row + n, 0.0)) > vanishing_row_sum)
      return;
  }
  for (double &value : work_)
    value += 1.0 / n;
}

// An unknown whose pivot vanishes, the constant of an enclosed piece, is held at zero.
void Multigrid::eliminate(int pivot, int n) {
  double *pivot_row = &work_[pivot * n];
  const double value = pivot_row[pivot];
  const bool vanishes = std::abs(value) < vanishing_pivot;
  pivot_row[pivot] = 1;
  for (int j = 0; j < n; ++j)
    pivot_row[j] = vanishes ? 0 : pivot_row[j] / value;
  for (int i = 0; i < n; ++i) {
    double *row = &work_[i * n];
    const double factor = row[pivot];
    if (i == pivot || factor == 0)
      continue;
    row[pivot] = 0;
    for (int j = 0; j < n; ++j)
      row[j] -= factor * pivot_row[j];
  }
}

void Multigrid::apply(std::span<const double> r, std::span<float> z) {
  Level &fine = level_[0];
  for_each_index(
      fine.rows, [&](int i) { fine.b[i] = static_cast<float>(r[i]); }, Work::light);
  cycle(0, z);
}

// x = approximate solution of the level's equations for its b.
void Multigrid::cycle(int level, std::span<float> x) {
  Level &l = level_[level];
  if (level == n_levels_ - 1 && !inverse_.empty())
    return solve_coarsest(x);
  for_each_index(
      l.rows, [&](int i) { l.x[i] = l.weight[i] * l.b[i]; }, Work::light);
  if (level + 1 < n_levels_) {
    restrict_residual(level);
    std::vector<float> &correction = level_[level + 1].r;
    cycle(level + 1, correction);
    l.coarser.transfer.prolong(correction, l.x);
  }
  smooth(level, x);
}

void Multigrid::solve_coarsest(std::span<float> x) const {
  const Level &l = level_[n_levels_ - 1];
  const int n = l.rows;
  for (int i = 0; i < n; ++i) {
    float total = 0;
    for (int j = 0; j < n; ++j)
      total += inverse_[i * n + j] * l.b[j];
    x[i] = total;
  }
}

// body(i, (A x)_i)
template <class Body>
void Multigrid::for_each_product(int level, const std::vector<float> &x, Body &&body) const {
  const Level &l = level_[level];
  const auto matrix = view(level);
  for_each_block(
      l.rows,
      [&](IndexRange range, int) {
        if (l.is_compact)
          l.compact.for_each_product(matrix.pattern, x.data(), range, body);
        else
          fluid::for_each_product<float>(matrix.pattern, matrix.off_diagonal.data(), x.data(),
                                         range, [&](int i, float rest) { body(i, x[i] + rest); });
      },
      Work::light);
}

// The residual of x is the next level's right-hand side, whose rows are divided by their diagonal.
void Multigrid::restrict_residual(int level) {
  Level &l = level_[level];
  for_each_product(level, l.x, [&](int i, float product) { l.r[i] = l.b[i] - product; });
  l.coarser.transfer.restrict(l.r, l.coarser.scale, level_[level + 1].b);
}

void Multigrid::smooth(int level, std::span<float> x) const {
  const Level &l = level_[level];
  for_each_product(level, l.x,
                   [&](int i, float product) { x[i] = l.x[i] + l.weight[i] * (l.b[i] - product); });
}

} // namespace sluice::fluid
