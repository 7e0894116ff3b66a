// SPDX-License-Identifier: MIT
#include "fluid/neighbours.hpp"
#include "tests/support/fine_walls.hpp"
#include "tests/support/fluid_cases.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <set>

namespace sluice::fluid {
namespace {

using testing::FrozenCloud;

std::vector<int> sorted(std::span<const int> list) {
  std::vector<int> copy(list.begin(), list.end());
  std::sort(copy.begin(), copy.end());
  return copy;
}

TEST(Neighbours, OfARandomCloudAreThoseOfBruteForce) {
  Points<2> points = testing::points_at(testing::random_points(500, {1.3, 0.7}, 11));
  const double radius = 0.09;
  const Grid<2> grid = grid_over(points, radius);
  CellRanges ranges;
  NeighbourLists lists;
  SortMemory<2> memory;
  sort_by_cell(points, grid, ranges, memory);
  find_neighbours(points, grid, ranges, radius, lists);
  for (int i = 0; i < points.size(); ++i) {
    std::vector<int> expected;
    for (int j = 0; j < points.size(); ++j)
      if (j != i && (points.position[j] - points.position[i]).norm() < radius)
        expected.push_back(j);
    ASSERT_EQ(sorted(lists.of(i)), expected) << "point " << i;
  }
}

TEST(Neighbours, HiddenOnesAreRemovedOnBothSidesOfAPlate) {
  const double h = 0.1;
  const FrozenCloud frozen(testing::random_points(400, {2, 2}, 3),
                           testing::polyline({{1.01, 2.2}, {1.01, 0.6}, {0.99, 0.6}, {0.99, 2.2}}),
                           h);
  const auto all = testing::every_face(frozen.walls);
  std::set<std::pair<int, int>> pairs;
  int hidden = 0;
  for (int i = 0; i < frozen.size(); ++i)
    for (const int j : frozen.cloud.neighbours.of(i))
      pairs.insert({i, j});
  for (int i = 0; i < frozen.size(); ++i)
    for (int j = 0; j < frozen.size(); ++j) {
      const Vec<2> &a = frozen.points.position[i], &b = frozen.points.position[j];
      if (i == j || (a - b).norm() >= frozen.cloud.radius)
        continue;
      const bool is_behind = is_hidden(frozen.walls, all, a, b);
      hidden += is_behind;
      ASSERT_EQ(pairs.count({i, j}), is_behind ? 0u : 1u) << i << ' ' << j;
      ASSERT_EQ(pairs.count({i, j}), pairs.count({j, i}));
    }
  EXPECT_GT(hidden, 100); // the plate does stand between points
}

// A wavy sheet of triangles that are finer than the spacing, with points on both sides of it.
Walls<3> wavy_sheet(int n) {
  return testing::sheet_of(n, [&](int i, int j) {
    const double x = double(i) / n, y = double(j) / n;
    return Vec<3>(x, y, 0.3 + testing::hill(0.05, x, y));
  });
}

TEST(Neighbours, ThoseInSightOfAFineSurfaceAreThoseOfATestOfEveryPair) {
  const double h = 0.1;
  std::vector<Vec<3>> position = testing::lattice({12, 12, 6}, h, 0.3, 7);
  for (Vec<3> &x : position)
    x -= Vec<3>(h, h, 0); // beyond the sheet's border too
  const testing::FrozenCloudIn<3> frozen(position, wavy_sheet(24), h);
  const auto all = testing::every_face(frozen.walls);
  int hidden = 0;
  for (int i = 0; i < frozen.size(); ++i) {
    const Vec<3> &x = frozen.points.position[i];
    std::vector<int> expected;
    for (int j = 0; j < frozen.size(); ++j) {
      const Vec<3> &y = frozen.points.position[j];
      if (i == j || (x - y).norm() >= frozen.cloud.radius)
        continue;
      if (is_hidden(frozen.walls, all, x, y))
        ++hidden;
      else
        expected.push_back(j);
    }
    ASSERT_EQ(sorted(frozen.cloud.neighbours.of(i)), expected) << "point " << i;
  }
  EXPECT_GT(hidden, 1000);
}

TEST(Neighbours, SortingKeepsEveryPointsDataTogether) {
  Points<2> points = testing::points_at(testing::random_points(300, {1, 1}, 2));
  const Points<2> before = points;
  for (int i = 0; i < points.size(); ++i) {
    points.velocity[i] = {i, 1};
    points.previous_velocity[i] = {i, 2};
    points.pressure[i] = i;
    points.at_surface[i] = static_cast<SurfaceMemory>(i % 3);
  }
  CellRanges ranges;
  const Grid<2> grid = grid_over(points, 0.1);
  SortMemory<2> memory;
  sort_by_cell(points, grid, ranges, memory);
  int moved = 0;
  for (int k = 0; k < points.size(); ++k) {
    const int i = points.id[k];
    moved += i != k;
    ASSERT_EQ(points.position[k], before.position[i]);
    ASSERT_EQ(points.velocity[k], Vec<2>(i, 1));
    ASSERT_EQ(points.previous_velocity[k], Vec<2>(i, 2));
    ASSERT_EQ(points.pressure[k], i);
    ASSERT_EQ(points.at_surface[k], static_cast<SurfaceMemory>(i % 3));
  }
  EXPECT_GT(moved, 200);
  for (int c = 0; c < grid.n_cells(); ++c)
    for (int k = ranges.start[c]; k < ranges.start[c + 1]; ++k)
      ASSERT_EQ(grid.cell(points.position[k]), c);
}

TEST(Neighbours, OnePointHasNone) {
  const FrozenCloud frozen({{0.3, 0.4}}, testing::polyline({{5, 5}, {6, 5}}), 0.1);
  EXPECT_EQ(frozen.cloud.neighbours.of(0).size(), 0u);
}

TEST(Neighbours, APositionThatIsNoNumberIsRefusedWithItsId) {
  Points<2> points = testing::points_at({{0, 0}, {1, 0}, {std::nan(""), 0}});
  const std::string message = testing::message_of([&] { grid_over(points, 0.1); });
  EXPECT_TRUE(testing::contains(message, "point 2")) << message;
}

} // namespace
} // namespace sluice::fluid
