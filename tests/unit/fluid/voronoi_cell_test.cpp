// SPDX-License-Identifier: MIT
#include "fluid/voronoi_cell.hpp"
#include "tests/support/fluid_cases.hpp"

#include <gtest/gtest.h>

namespace sluice::fluid {
namespace {

constexpr double round_off = 1e-13; // of a few dozen additions of numbers of order one

TEST(VoronoiCell, OnALatticeIsTheSquareOfTheSpacingAroundThePoint) {
  VoronoiCell<2> cell(1.5);
  for (int x = -2; x <= 2; ++x)
    for (int y = -2; y <= 2; ++y)
      cut_towards<2>(cell, {x, y});
  EXPECT_NEAR(cell.volume(), 1, round_off);
  EXPECT_NEAR(cell.centroid().norm(), 0, round_off);
  EXPECT_NEAR(cell.reach(), std::sqrt(0.5), round_off);
}

TEST(VoronoiCell, CellsOfARandomCloudTileTheBox) {
  const Vec<2> size(3, 2);
  const auto x = testing::random_points(300, size, 7);
  double total = 0;
  Vec<2> moment(0, 0);
  for (const Vec<2> &xi : x) {
    VoronoiCell<2> cell(4);
    cell.cut({1, 0}, size.x() - xi.x());
    cell.cut({-1, 0}, xi.x());
    cell.cut({0, 1}, size.y() - xi.y());
    cell.cut({0, -1}, xi.y());
    for (const Vec<2> &xj : x)
      cut_towards<2>(cell, xj - xi);
    EXPECT_GT(cell.volume(), 0);
    total += cell.volume();
    moment += cell.volume() * (xi + cell.centroid());
  }
  EXPECT_NEAR(total, 6, 300 * round_off);
  EXPECT_NEAR((moment - 6 * 0.5 * size).norm(), 0, 300 * round_off);
}

TEST(VoronoiCell, NeverGrowsByACutAndStaysOnItsSideOfIt) {
  std::mt19937 engine(3);
  std::uniform_real_distribution<double> uniform(0, 1);
  for (int cloud = 0; cloud < 20; ++cloud) {
    VoronoiCell<2> cell(1);
    for (int k = 0; k < 30; ++k) {
      const double area = cell.volume(), reach = cell.reach();
      const double angle = 6.2831853 * uniform(engine), offset = 0.1 + uniform(engine);
      const Vec<2> n(std::cos(angle), std::sin(angle));
      cell.cut(n, offset);
      EXPECT_LE(cell.volume(), area + round_off);
      EXPECT_LE(cell.reach(), reach + round_off);
      for (int c = 0; c < cell.size(); ++c)
        EXPECT_LE(n.dot(cell.corner(c)), offset + round_off);
    }
    EXPECT_GT(cell.volume(), 0.03); // the circle of radius 0.1 is never cut into
  }
}

} // namespace
} // namespace sluice::fluid
