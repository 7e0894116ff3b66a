// SPDX-License-Identifier: MIT
#include "fluid/multigrid.hpp"

#include <cmath>

namespace sluice::fluid {
namespace {

constexpr int most_levels = 32; // 32-bit cell coordinates have come down to one cell by then
constexpr float singular =
    1e-5f; // diagonals and pivots below this (of order one otherwise) are zero

// Rows of `rows` from entry `skip` on, scaled by scale(i), into slices.
template <class Scale>
void slice_rows(const CompressedRows &rows, int skip, SlicedPattern &pattern,
                std::vector<float> &value, Scale &&scale, int n_columns) {
  const auto length = [&](int i) { return rows.row_start[i + 1] - rows.row_start[i] - skip; };
  pattern.lay_out(rows.rows(), [&](int i) { return std::max(0, length(i)); });
  value.resize(pattern.stored());
  for_each_index(pattern.slices() * SlicedPattern::lanes, [&](int i) {
    const bool inside = i < rows.rows();
    const int n = inside ? length(i) : 0, first = inside ? rows.row_start[i] + skip : 0;
    for (int k = 0; k < pattern.width(i); ++k) {
      const std::size_t at = pattern.place(i, k);
      pattern.column[at] = k < n ? rows.column[first + k] : std::min(i, n_columns - 1);
      value[at] = k < n ? rows.value[first + k] * scale(i) : 0;
    }
  });
}

int floor_divided(int a, int b) { return a >= 0 ? a / b : -((-a + b - 1) / b); }

} // namespace

int Multigrid::rows(int level) const { return level_[level].rows; }

double Multigrid::operator_complexity() const {
  double total = 0;
  for (int l = 0; l < n_levels_; ++l)
    total += static_cast<double>(level_[l].entries);
  return total / static_cast<double>(std::max<std::size_t>(1, level_[0].entries));
}

UnitDiagonalView Multigrid::view(int level) const {
  if (level == 0)
    return {matrix_->pattern(), matrix_->off_diagonal_float()};
  return {level_[level].pattern, level_[level].off_diagonal};
}

void Multigrid::build(const ScaledMatrix &matrix, std::span<const Cell> cells) {
  level_.resize(most_levels);
  matrix_ = &matrix;
  level_[0].rows = matrix.rows();
  level_[0].cell.assign(cells.begin(), cells.end());
  level_[0].entries = matrix.pattern().stored() + matrix.rows();
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

// Weights and vectors; a row without neighbours is solved by its diagonal.
void Multigrid::start_level(int level) {
  Level &l = level_[level];
  const auto matrix = view(level);
  const auto weight = static_cast<float>(params_.smoothing_weight);
  l.weight.resize(l.rows);
  for_each_index(l.rows, [&](int i) { l.weight[i] = matrix.is_isolated(i) ? 1 : weight; });
  for (auto *vector : {&l.b, &l.x, &l.r})
    vector->resize(l.rows);
}

void Multigrid::coarsen(int level) {
  Level &fine = level_[level], &coarse = level_[level + 1];
  const auto matrix = view(level);
  finder_.find(matrix, fine.cell, aggregates_);
  const int n_coarse = aggregates_.count();
  coarse.rows = n_coarse;
  build_prolongation(matrix, aggregates_, static_cast<float>(params_.prolongation_weight),
                     collector_, prolongation_);
  transpose(prolongation_, n_coarse, fine.restriction);
  product_.build(matrix, prolongation_, fine.restriction,
                 static_cast<float>(params_.drop_tolerance), collector_, coarse_);
  slice_rows(
      prolongation_, 0, fine.prolongation, fine.prolongation_value, [](int) { return 1.0f; },
      n_coarse);
  set_coarse_matrix(fine, coarse);
  coarse.cell.resize(n_coarse);
  for_each_index(n_coarse, [&](int c) {
    for (int d = 0; d < 3; ++d)
      coarse.cell[c][d] = floor_divided(aggregates_.cell[c][d], params_.coarsening);
  });
  start_level(level + 1);
}

void Multigrid::set_coarse_matrix(Level &fine, Level &coarse) {
  fine.coarse_scale.resize(coarse.rows);
  for_each_index(coarse.rows, [&](int c) {
    const float diagonal = coarse_.value[coarse_.row_start[c]];
    float size = 0;
    for (int k = fine.restriction.row_start[c]; k < fine.restriction.row_start[c + 1]; ++k)
      size += std::abs(fine.restriction.value[k]);
    fine.coarse_scale[c] = diagonal > singular * size ? 1 / diagonal : 0;
  });
  slice_rows(
      coarse_, 1, coarse.pattern, coarse.off_diagonal, [&](int c) { return fine.coarse_scale[c]; },
      coarse.rows);
  coarse.entries = coarse_.column.size();
}

// Gauss-Jordan without pivoting of the coarsest matrix, which is close to an M-matrix; unknowns
// with a vanishing pivot (the constant of an enclosed piece) are held at zero.
void Multigrid::invert_coarsest() {
  const Level &l = level_[n_levels_ - 1];
  const int n = l.rows;
  inverse_.clear();
  if (n > params_.coarsest_size)
    return;
  work_.assign(static_cast<std::size_t>(n) * n, 0);
  const auto matrix = view(n_levels_ - 1);
  for (int i = 0; i < n; ++i) {
    work_[i * n + i] = 1;
    matrix.for_each_entry(i, [&](int j, float value) { work_[i * n + j] += value; });
  }
  for (int p = 0; p < n; ++p) {
    double *pivot_row = &work_[p * n];
    const double pivot = pivot_row[p];
    if (std::abs(pivot) < singular) {
      for (int i = 0; i < n; ++i)
        pivot_row[i] = work_[i * n + p] = 0;
      continue;
    }
    pivot_row[p] = 1;
    for (int j = 0; j < n; ++j)
      pivot_row[j] /= pivot;
    for (int i = 0; i < n; ++i) {
      double *row = &work_[i * n];
      const double factor = row[p];
      if (i == p || factor == 0)
        continue;
      row[p] = 0;
      for (int j = 0; j < n; ++j)
        row[j] -= factor * pivot_row[j];
    }
  }
  inverse_.assign(work_.begin(), work_.end());
}

void Multigrid::apply(std::span<const double> r, std::span<float> z) {
  Level &fine = level_[0];
  for_each_index(fine.rows, [&](int i) { fine.b[i] = static_cast<float>(r[i]); });
  cycle(0);
  std::copy(fine.r.begin(), fine.r.end(), z.begin());
}

// Solves level's matrix x = b approximately; the result is in r.
void Multigrid::cycle(int level) {
  Level &l = level_[level];
  if (level == n_levels_ - 1 && !inverse_.empty())
    return solve_coarsest();
  for_each_index(l.rows, [&](int i) { l.x[i] = l.weight[i] * l.b[i]; });
  if (level + 1 < n_levels_) {
    smooth_residual(level);
    cycle(level + 1);
    correct(level);
  }
  smooth(level, [&](int i, float value) { l.r[i] = value; });
}

void Multigrid::solve_coarsest() {
  Level &l = level_[n_levels_ - 1];
  const int n = l.rows;
  for (int i = 0; i < n; ++i) {
    float total = 0;
    for (int j = 0; j < n; ++j)
      total += inverse_[i * n + j] * l.b[j];
    l.r[i] = total;
  }
}

// Residual of x, restricted and scaled to the next level's right-hand side.
void Multigrid::smooth_residual(int level) {
  Level &l = level_[level], &coarse = level_[level + 1];
  const auto matrix = view(level);
  for_each_block(l.rows, [&](IndexRange range, int) {
    for_each_product<float>(matrix.pattern, matrix.off_diagonal.data(), l.x.data(), range,
                            [&](int i, float product) { l.r[i] = l.b[i] - l.x[i] - product; });
  });
  for_each_index(coarse.rows, [&](int c) {
    float total = 0;
    for (int k = l.restriction.row_start[c]; k < l.restriction.row_start[c + 1]; ++k)
      total += l.restriction.value[k] * l.r[l.restriction.column[k]];
    coarse.b[c] = total * l.coarse_scale[c];
  });
}

void Multigrid::correct(int level) {
  Level &l = level_[level], &coarse = level_[level + 1];
  for_each_block(l.rows, [&](IndexRange range, int) {
    for_each_product<float>(l.prolongation, l.prolongation_value.data(), coarse.r.data(), range,
                            [&](int i, float product) { l.x[i] += product; });
  });
}

template <class Store> void Multigrid::smooth(int level, Store &&store) {
  Level &l = level_[level];
  const auto matrix = view(level);
  for_each_block(l.rows, [&](IndexRange range, int) {
    for_each_product<float>(matrix.pattern, matrix.off_diagonal.data(), l.x.data(), range,
                            [&](int i, float product) {
                              store(i, l.x[i] + l.weight[i] * (l.b[i] - l.x[i] - product));
                            });
  });
}

} // namespace sluice::fluid
