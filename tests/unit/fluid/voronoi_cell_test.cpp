// SPDX-License-Identifier: MIT
#include "fluid/voronoi_cell.hpp"
#include "tests/support/fluid_cases.hpp"

#include <gtest/gtest.h>

#include <algorithm>

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

// --- in space -----------------------------------------------------------------------------------

TEST(VoronoiCellInSpace, OnALatticeIsTheCubeOfTheSpacingAroundThePoint) {
  VoronoiCell<3> cell(1.5);
  for (int x = -2; x <= 2; ++x)
    for (int y = -2; y <= 2; ++y)
      for (int z = -2; z <= 2; ++z)
        cut_towards<3>(cell, Vec<3>(x, y, z));
  EXPECT_NEAR(cell.volume(), 1, round_off);
  EXPECT_NEAR(cell.centroid().norm(), 0, round_off);
  EXPECT_NEAR(cell.reach(), std::sqrt(0.75), round_off);
}

// Random points, and points next to a lattice: there four and more faces nearly meet in a corner.
TEST(VoronoiCellInSpace, CellsOfACloudTileTheBox) {
  for (const double jitter : {0.5, 0.25, 1e-3, 1e-13, 0.0}) {
    const auto x = testing::lattice({7, 6, 5}, 1, jitter, 7);
    const Vec<3> size(7, 6, 5);
    double total = 0;
    Vec<3> moment(0, 0, 0);
    for (const Vec<3> &xi : x) {
      VoronoiCell<3> cell(8);
      for (int d = 0; d < 3; ++d) {
        cell.cut(Vec<3>::Unit(d), size[d] - xi[d]);
        cell.cut(-Vec<3>::Unit(d), xi[d]);
      }
      std::vector<Vec<3>> others; // nearest first, as the cloud's lists nearly are
      for (const Vec<3> &xj : x)
        others.push_back(xj - xi);
      std::sort(others.begin(), others.end(),
                [](const Vec<3> &a, const Vec<3> &b) { return a.squaredNorm() < b.squaredNorm(); });
      for (const Vec<3> &r : others)
        cut_towards(cell, r);
      EXPECT_GT(cell.volume(), 0);
      total += cell.volume();
      moment += cell.volume() * (xi + cell.centroid());
    }
    std::printf("jitter %g: volume off by %.1e of 210\n", jitter, total - 210);
    // a cut may leave a sliver of 1e-12 of the reach
    EXPECT_NEAR(total, 210, 210 * 1e-11);
    EXPECT_NEAR((moment - 105 * size).norm(), 0, 210 * 1e-10);
  }
}

TEST(VoronoiCellInSpace, NeverGrowsByACutAndStaysOnItsSideOfIt) {
  std::mt19937 engine(3);
  std::normal_distribution<double> normal;
  std::uniform_real_distribution<double> uniform(0.1, 1.1);
  for (int cloud = 0; cloud < 20; ++cloud) {
    VoronoiCell<3> cell(1);
    for (int k = 0; k < 40; ++k) {
      const double volume = cell.volume(), reach = cell.reach(), offset = uniform(engine);
      const double x = normal(engine), y = normal(engine), z = normal(engine);
      const Vec<3> n = Vec<3>(x, y, z).normalized();
      cell.cut(n, offset);
      EXPECT_LE(cell.volume(), volume + round_off);
      EXPECT_LE(cell.reach(), reach + round_off);
      for (int c = 0; c < cell.size(); ++c)
        EXPECT_LE(n.dot(cell.corner(c)), offset + 1e-11);
    }
    EXPECT_GT(cell.volume(), 4.0 / 3 * 3.14 * 1e-3); // the ball of radius 0.1 is never cut into
  }
}

} // namespace
} // namespace sluice::fluid
