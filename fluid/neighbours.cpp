// SPDX-License-Identifier: MIT
#include "fluid/neighbours.hpp"

#include "bridge/base/check.hpp"
#include "fluid/parallel.hpp"

#include <algorithm>
#include <cmath>

namespace sluice::fluid {

int Grid::column(double x) const {
  return static_cast<int>(std::clamp((x - origin.x()) / cell_size, 0.0, nx - 1.0));
}
int Grid::row(double y) const {
  return static_cast<int>(std::clamp((y - origin.y()) / cell_size, 0.0, ny - 1.0));
}

Grid grid_over(const Points &points, double cell_size) {
  Vec<2> low = Vec<2>::Constant(1e300), high = -low;
  for (int i = 0; i < points.size(); ++i) {
    const Vec<2> &x = points.position[i];
    check(x.allFinite(), "point {} has no finite position: ({}, {}) m; reduce the time step",
          points.id[i], x.x(), x.y());
    low = low.cwiseMin(x);
    high = high.cwiseMax(x);
  }
  if (points.size() == 0)
    low = high = Vec<2>::Zero();
  Grid grid{low, cell_size, 0, 0};
  const Vec<2> cells = (high - low) / cell_size;
  check(cells.x() * cells.y() < 2e7,
        "the points spread over {:.3g} x {:.3g} m, too far for cells of {:.3g} m; "
        "add an outlet or reduce the time step",
        high.x() - low.x(), high.y() - low.y(), cell_size);
  grid.nx = static_cast<int>(cells.x()) + 1;
  grid.ny = static_cast<int>(cells.y()) + 1;
  return grid;
}

namespace {

template <class T> void reorder(std::vector<T> &values, const std::vector<int> &order) {
  std::vector<T> sorted(values.size());
  for_each_index(static_cast<int>(order.size()), [&](int k) { sorted[k] = values[order[k]]; });
  values.swap(sorted);
}

} // namespace

void sort_by_cell(Points &points, const Grid &grid, CellRanges &ranges) {
  const int n = points.size();
  std::vector<int> cell(n), order(n);
  ranges.start.assign(grid.n_cells() + 1, 0);
  for (int i = 0; i < n; ++i) {
    cell[i] = grid.cell(points.position[i]);
    ++ranges.start[cell[i] + 1];
  }
  for (int c = 0; c < grid.n_cells(); ++c)
    ranges.start[c + 1] += ranges.start[c];
  std::vector<int> next(ranges.start.begin(), ranges.start.end() - 1);
  bool in_order = true;
  for (int i = 0; i < n; ++i) {
    const int k = next[cell[i]]++;
    in_order = in_order && k == i;
    order[k] = i;
  }
  if (in_order)
    return;
  for_each_array(points, [&](const char *, auto &values) { reorder(values, order); });
}

namespace {

// Calls visit(j) for every point j in the 3 x 3 cells around x_i: three ranges, since the cells of
// a row are contiguous.
template <class Visit>
void for_each_near(const Vec<2> &x, const Grid &grid, const CellRanges &ranges, Visit &&visit) {
  const int cx = grid.column(x.x()), cy = grid.row(x.y());
  const int x0 = std::max(cx - 1, 0), x1 = std::min(cx + 1, grid.nx - 1);
  for (int y = std::max(cy - 1, 0); y <= std::min(cy + 1, grid.ny - 1); ++y)
    for (int j = ranges.start[y * grid.nx + x0]; j < ranges.start[y * grid.nx + x1 + 1]; ++j)
      visit(j);
}

} // namespace

namespace {

// Fills all lists; returns the length that the longest would have.
int fill_lists(const Points &points, const Grid &grid, const CellRanges &ranges, double radius,
               NeighbourLists &lists) {
  const int n = points.size();
  const double radius2 = radius * radius;
  lists.count.resize(n);
  lists.index.resize(static_cast<std::size_t>(n) * lists.capacity);
  for_each_point(n, [&](int i) {
    const Vec<2> x = points.position[i];
    int *const list = lists.first(i);
    int count = 0;
    for_each_near(x, grid, ranges, [&](int j) {
      const bool is_near = (points.position[j] - x).squaredNorm() < radius2 && j != i;
      list[std::min(count, lists.capacity - 1)] = j;
      count += is_near;
    });
    lists.count[i] = count;
  });
  return n > 0 ? *std::max_element(lists.count.begin(), lists.count.end()) : 0;
}

} // namespace

void find_neighbours(const Points &points, const Grid &grid, const CellRanges &ranges,
                     double radius, NeighbourLists &lists) {
  int longest = fill_lists(points, grid, ranges, radius, lists);
  if (longest >= lists.capacity && lists.capacity < most_neighbours) {
    lists.capacity = most_neighbours;
    longest = fill_lists(points, grid, ranges, radius, lists);
  }
  if (longest >= lists.capacity)
    for (int &count : lists.count)
      count = std::min(count, lists.capacity - 1);
}

void lay_out_rows(const NeighbourLists &lists, SparseMatrix &matrix) {
  const int n = static_cast<int>(lists.count.size());
  matrix.row_start.resize(n + 1);
  matrix.row_start[0] = 0;
  for (int i = 0; i < n; ++i)
    matrix.row_start[i + 1] = matrix.row_start[i] + 1 + lists.count[i];
  matrix.column.resize(matrix.row_start[n]);
  matrix.value.resize(matrix.row_start[n]);
  for_each_point(n, [&](int i) {
    int *column = &matrix.column[matrix.row_start[i]];
    const auto neighbours = lists.of(i);
    *column = i;
    std::copy(neighbours.begin(), neighbours.end(), column + 1);
  });
}

} // namespace sluice::fluid
