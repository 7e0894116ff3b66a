// SPDX-License-Identifier: MIT
#include "fluid/neighbours.hpp"

#include "bridge/base/check.hpp"
#include "fluid/coordinates.hpp"
#include "fluid/packs.hpp"
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

template <int dim> double Grid<dim>::half_diagonal() const {
  return 0.5 * std::sqrt(double{dim}) * cell_size;
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

template <int dim>
void sort_by_cell(Points<dim> &points, const Grid<dim> &grid, CellRanges &ranges,
                  SortMemory<dim> &memory) {
  const int n = points.size();
  auto &[cell, order, next, sorted] = memory;
  cell.resize(n);
  order.resize(n);
  for_each_point(n, [&](int i) { cell[i] = grid.cell(points.position[i]); });
  ranges.start.assign(grid.n_cells() + 1, 0);
  for (int i = 0; i < n; ++i)
    ++ranges.start[cell[i] + 1];
  for (int c = 0; c < grid.n_cells(); ++c)
    ranges.start[c + 1] += ranges.start[c];
  next.assign(ranges.start.begin(), ranges.start.end() - 1);
  bool in_order = true;
  for (int i = 0; i < n; ++i) {
    const int k = next[cell[i]]++;
    in_order = in_order && k == i;
    order[k] = i;
  }
  if (in_order)
    return;
  for_each_pair_of_arrays(points, sorted, [&](const char *, auto &values, auto &in_new_order) {
    in_new_order.resize(n);
    for_each_index(n, [&](int k) { in_new_order[k] = values[order[k]]; });
    values.swap(in_new_order);
  });
}

namespace {

// Calls visit(begin, end) for the ranges of points in the 3^dim cells around x_i: a few, since the
// cells of a row are contiguous.
template <int dim, class Visit>
void for_each_near(const Vec<dim> &x, const Grid<dim> &grid, const CellRanges &ranges,
                   Visit &&visit) {
  auto low = grid.place(x), high = low;
  for (int d = 0; d < dim; ++d) {
    low[d] = std::max(low[d] - 1, 0);
    high[d] = std::min(high[d] + 1, grid.size[d] - 1);
  }
  grid.for_each_run(
      low, high, [&](int first, int last) { visit(ranges.start[first], ranges.start[last + 1]); });
}

/// Fills the lists, eight candidates at a time.
template <int dim> class ListFiller {
public:
  ListFiller(const Points<dim> &points, const Grid<dim> &grid, const CellRanges &ranges,
             double radius, NeighbourLists &lists)
      : points_(points), grid_(grid), ranges_(ranges), radius2_(radius * radius), lists_(lists),
        stride_(points.size() + pack_size) {
    lists.count.resize(points.size());
    lists.index.resize(static_cast<std::size_t>(points.size()) * lists.capacity);
    lists.coordinate.resize(dim * stride_);
    for_each_index(
        points.size(),
        [&](int i) {
          for (int d = 0; d < dim; ++d)
            lists.coordinate[d * stride_ + i] = points.position[i][d];
        },
        Work::light);
  }

  /// Length that the list would have.
  int fill(int i) const {
    int *const list = lists_.first(i);
    int count = 0;
    for_each_near<dim>(points_.position[i], grid_, ranges_, [&](int begin, int end) {
      for (int j = begin; j < end; j += pack_size) {
        const unsigned near = near_lanes(i, j, end);
        if (count + pack_size <= lists_.capacity)
          count += append_lanes(near, j, list + count);
        else
          count = append_within_capacity(near, j, list, count);
      }
    });
    return count;
  }

private:
  // Which of the points j .. j + 7 before `end` are near, i itself excluded.
  unsigned near_lanes(int i, int j, int end) const {
    Pack distance2{};
    for (int d = 0; d < dim; ++d) {
      const Pack r = load(&lists_.coordinate[d * stride_ + j]) - points_.position[i][d];
      distance2 += r * r;
    }
    unsigned near = bits_of(distance2 < radius2_) & ((1u << std::min(end - j, pack_size)) - 1);
    if (i >= j && i < j + pack_size)
      near &= ~(1u << (i - j));
    return near;
  }

  int append_within_capacity(unsigned near, int j, int *list, int count) const {
    for (; near != 0; near &= near - 1)
      list[std::min(count++, lists_.capacity - 1)] = j + std::countr_zero(near);
    return count;
  }

  const Points<dim> &points_;
  const Grid<dim> &grid_;
  const CellRanges &ranges_;
  double radius2_;
  NeighbourLists &lists_;
  std::size_t stride_;
};

// Fills all lists; returns the length that the longest would have.
template <int dim>
int fill_lists(const Points<dim> &points, const Grid<dim> &grid, const CellRanges &ranges,
               double radius, NeighbourLists &lists) {
  const ListFiller<dim> filler(points, grid, ranges, radius, lists);
  for_each_point(points.size(), [&](int i) { lists.count[i] = filler.fill(i); });
  return points.size() > 0 ? *std::max_element(lists.count.begin(), lists.count.end()) : 0;
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

void slice_lists(const NeighbourLists &lists, SlicedPattern &slices) {
  const int n = static_cast<int>(lists.count.size());
  constexpr int lanes = SlicedPattern::lanes;
  slices.lay_out(n, [&](int i) { return lists.count[i]; });
  const auto fill_slice = [&](int s) {
    int *column = slices.column.data() + slices.place(s * lanes, 0);
    for (int lane = 0; lane < lanes; ++lane) {
      const int i = std::min(s * lanes + lane, n - 1);
      const int count = s * lanes + lane < n ? lists.count[i] : 0;
      for (int k = 0; k < slices.width(s * lanes); ++k)
        column[k * lanes + lane] = k < count ? lists.first(i)[k] : i;
    }
  };
  for_each_block(n, [&](IndexRange range, int) {
    for (int first = range.begin; first < range.end; first += lanes)
      fill_slice(first / lanes);
  });
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
template void sort_by_cell(Points<2> &, const Grid<2> &, CellRanges &, SortMemory<2> &);
template void sort_by_cell(Points<3> &, const Grid<3> &, CellRanges &, SortMemory<3> &);
template void find_neighbours(const Points<2> &, const Grid<2> &, const CellRanges &, double,
                              NeighbourLists &);
template void find_neighbours(const Points<3> &, const Grid<3> &, const CellRanges &, double,
                              NeighbourLists &);

} // namespace sluice::fluid
