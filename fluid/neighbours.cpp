// SPDX-License-Identifier: MIT
#include "fluid/neighbours.hpp"

#include "bridge/base/check.hpp"
#include "fluid/coordinates.hpp"
#include "fluid/parallel.hpp"

#include <algorithm>
#include <cmath>

namespace sluice::fluid {

template <int dim> int Grid<dim>::n_cells() const {
  int n = 1;
  for (const int along : size)
    n *= along;
  return n;
}

template <int dim> Vec<dim> Grid<dim>::top() const {
  Vec<dim> cells;
  for (int d = 0; d < dim; ++d)
    cells[d] = size[d];
  return origin + cell_size * cells;
}

template <int dim> int Grid<dim>::number(double coordinate, int d) const {
  return static_cast<int>(std::clamp((coordinate - origin[d]) / cell_size, 0.0, size[d] - 1.0));
}

template <int dim> typename Grid<dim>::Place Grid<dim>::place(const Vec<dim> &x) const {
  Place at;
  for (int d = 0; d < dim; ++d)
    at[d] = number(x[d], d);
  return at;
}

template <int dim> Grid<dim> grid_over(const Points<dim> &points, double cell_size) {
  Vec<dim> low = Vec<dim>::Constant(1e300), high = -low;
  for (int i = 0; i < points.size(); ++i) {
    const Vec<dim> &x = points.position[i];
    if (!x.allFinite()) // no text is made of the others
      fail("point {} has no finite position: {} m; reduce the time step", points.id[i], text_of(x));
    low = low.cwiseMin(x);
    high = high.cwiseMax(x);
  }
  if (points.size() == 0)
    low = high = Vec<dim>::Zero();
  Grid<dim> grid{low, cell_size, {}};
  const Vec<dim> cells = (high - low) / cell_size;
  check(cells.prod() < 2e7,
        "the points spread over {} m, too far for cells of {:.3g} m; "
        "add an outlet or reduce the time step",
        text_of_size<dim>(high - low), cell_size);
  for (int d = 0; d < dim; ++d)
    grid.size[d] = static_cast<int>(cells[d]) + 1;
  return grid;
}

namespace {

template <class T> void reorder(std::vector<T> &values, const std::vector<int> &order) {
  std::vector<T> sorted(values.size());
  for_each_index(static_cast<int>(order.size()), [&](int k) { sorted[k] = values[order[k]]; });
  values.swap(sorted);
}

} // namespace

template <int dim>
void sort_by_cell(Points<dim> &points, const Grid<dim> &grid, CellRanges &ranges) {
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

// Calls visit(j) for every point j in the 3^dim cells around x_i: a few ranges, since the cells of
// a row are contiguous.
template <int dim, class Visit>
void for_each_near(const Vec<dim> &x, const Grid<dim> &grid, const CellRanges &ranges,
                   Visit &&visit) {
  auto low = grid.place(x), high = low;
  for (int d = 0; d < dim; ++d) {
    low[d] = std::max(low[d] - 1, 0);
    high[d] = std::min(high[d] + 1, grid.size[d] - 1);
  }
  grid.for_each_run(low, high, [&](int first, int last) {
    for (int j = ranges.start[first]; j < ranges.start[last + 1]; ++j)
      visit(j);
  });
}

// Fills all lists; returns the length that the longest would have.
template <int dim>
int fill_lists(const Points<dim> &points, const Grid<dim> &grid, const CellRanges &ranges,
               double radius, NeighbourLists &lists) {
  const int n = points.size();
  const double radius2 = radius * radius;
  lists.count.resize(n);
  lists.index.resize(static_cast<std::size_t>(n) * lists.capacity);
  for_each_point(n, [&](int i) {
    const Vec<dim> x = points.position[i];
    int *const list = lists.first(i);
    int count = 0;
    for_each_near<dim>(x, grid, ranges, [&](int j) {
      const bool is_near = (points.position[j] - x).squaredNorm() < radius2 && j != i;
      list[std::min(count, lists.capacity - 1)] = j;
      count += is_near;
    });
    lists.count[i] = count;
  });
  return n > 0 ? *std::max_element(lists.count.begin(), lists.count.end()) : 0;
}

} // namespace

template <int dim>
void find_neighbours(const Points<dim> &points, const Grid<dim> &grid, const CellRanges &ranges,
                     double radius, NeighbourLists &lists) {
  if (dim == 3)
    lists.capacity = std::max(lists.capacity, 104);
  int longest = fill_lists(points, grid, ranges, radius, lists);
  if (longest >= lists.capacity && lists.capacity < most_neighbours<dim>) {
    lists.capacity = most_neighbours<dim>;
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

template struct Grid<2>;
template struct Grid<3>;
template Grid<2> grid_over(const Points<2> &, double);
template Grid<3> grid_over(const Points<3> &, double);
template void sort_by_cell(Points<2> &, const Grid<2> &, CellRanges &);
template void sort_by_cell(Points<3> &, const Grid<3> &, CellRanges &);
template void find_neighbours(const Points<2> &, const Grid<2> &, const CellRanges &, double,
                              NeighbourLists &);
template void find_neighbours(const Points<3> &, const Grid<3> &, const CellRanges &, double,
                              NeighbourLists &);

} // namespace sluice::fluid
