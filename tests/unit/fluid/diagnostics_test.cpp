// SPDX-License-Identifier: MIT
#include "fluid/diagnostics.hpp"
#include "tests/support/fluid_cases.hpp"

#include <gtest/gtest.h>

namespace sluice::fluid {
namespace {

TEST(CentreLine, OfTheGateRunsFromTheClampToTheTip) {
  const CentreLine line(testing::scene_of(testing::gate_tank(0.005)).walls);
  ASSERT_TRUE(line.exists());
  EXPECT_NEAR((line.tip() - Vec<2>(0.1025, 0)).norm(), 0, 1e-12);
}

TEST(CentreLine, DoesNotExistWithoutACoupledWall) {
  EXPECT_FALSE(CentreLine(testing::scene_of(testing::dam_break).walls).exists());
}

TEST(CentreLine, OfABentGateTellsTheTankFromTheOutside) {
  Walls<2> walls = testing::scene_of(testing::gate_tank(0.005)).walls;
  for (const int v :
       walls.coupled_vertices) { // sheared: 40 mm to the right and 10 mm up at the tip
    Vec<2> &x = walls.position[v];
    const double s = (0.079 - x.y()) / 0.079;
    x += s * Vec<2>(0.04, 0.01);
  }
  const CentreLine line(walls);
  EXPECT_NEAR((line.tip() - Vec<2>(0.1425, 0.01)).norm(), 0, 1e-12);
  const double middle = 0.1025 + 0.04 * 0.5; // at half height of the gate
  const double y = 0.5 * (0.079 + 0.01);
  EXPECT_FALSE(line.is_past(Vec<2>(middle - 1e-4, y)));
  EXPECT_TRUE(line.is_past(Vec<2>(middle + 1e-4, y)));
  EXPECT_FALSE(line.is_past(Vec<2>(0.1424, 0.005))); // below the tip
  EXPECT_TRUE(line.is_past(Vec<2>(0.1426, 0.005)));
  EXPECT_FALSE(line.is_past(Vec<2>(0.09, 0.12))); // above the clamp
  EXPECT_TRUE(line.is_past(Vec<2>(0.11, 0.12)));
}

TEST(WaterLevel, IsTheTopOfTheConnectedColumnAndIgnoresDropsAboveIt) {
  const double h = 0.1;
  auto x = testing::lattice(10, 20, h);
  EXPECT_NEAR(water_level<2>(testing::points_at(x), VerticalLine<2>(0.5), h, 0.0), 2.0, 1e-12);
  x.emplace_back(0.5, 3.0);
  EXPECT_NEAR(water_level<2>(testing::points_at(x), VerticalLine<2>(0.5), h, 0.0), 2.0, 1e-12);
  EXPECT_EQ(water_level<2>(testing::points_at(x), VerticalLine<2>(1.3), h, 0.0), 0);
}

TEST(WaterLevel, DoesNotCareHowHighTheFloorIs) {
  const double h = 0.1;
  for (const double floor : {-7.0, 0.0, 3.0}) {
    auto x = testing::lattice(10, 20, h);
    for (Vec<2> &p : x)
      p.y() += floor;
    EXPECT_NEAR(water_level<2>(testing::points_at(x), VerticalLine<2>(0.5), h, floor), floor + 2,
                1e-12);
    EXPECT_EQ(water_level<2>(testing::points_at(x), VerticalLine<2>(1.3), h, floor), floor); // dry
    EXPECT_NEAR(water_level<2>(testing::points_at(x), VerticalLine<2>(0.5), h, std::nullopt),
                floor + 2, 1e-12);
    EXPECT_TRUE(
        std::isnan(water_level<2>(testing::points_at(x), VerticalLine<2>(1.3), h, std::nullopt)));
  }
}

TEST(WaterLevel, ADropHighAboveADryFloorIsNoColumn) {
  EXPECT_EQ(water_level<2>(testing::points_at({{0.5, 2}}), VerticalLine<2>(0.5), 0.1, 0.0), 0);
}

TEST(WaterLevel, TheFloorIsTheLowestWallWithTheFluidAboveIt) {
  Walls<2> walls;
  testing::add_polyline(walls, {{0, 5}, {0, -2}, {4, -1}, {4, 5}}); // a tank whose floor rises
  testing::add_polyline(walls, {{3, 1}, {2, 1}});                   // a plate's lower face
  testing::add_polyline(walls, {{2, 1.2}, {3, 1.2}});               // and its upper one
  EXPECT_NEAR(floor_at<2>(walls, VerticalLine<2>(2.5)).value(), -1.375, 1e-12);
  EXPECT_FALSE(floor_at<2>(walls, VerticalLine<2>(6)));
}

TEST(CentreLine, DoesNotExistForAFloorThatMoves) {
  Walls<2> walls = testing::polyline({{0, 1}, {0, 0}, {1, 0}, {2, 0}, {3, 0}, {3, 1}});
  walls.coupled_vertices = {1, 2, 3, 4};
  EXPECT_FALSE(CentreLine(walls).exists());
}

TEST(Integrals, OfStillWaterAreItsVolumeAndItsWeightsPotential) {
  FluidSolver<2> solver(testing::scene_of(testing::gate_tank()));
  solver.begin_step(1e-4);
  solver.iterate();
  solver.end_step();
  const Integrals<2> total = integrate(solver);
  EXPECT_NEAR(total.volume, 0.014, 1e-12);
  EXPECT_NEAR(total.point_volume, 0.014, 1e-12);
  EXPECT_NEAR(total.tank_volume, 0.014, 1e-12);
  EXPECT_NEAR(total.potential, 1000 * 9.81 * 0.014 * 0.07, 1e-9);
  EXPECT_NEAR(total.max_pressure, 1000 * 9.81 * 0.138,
              1e-3); // lowest row: 2 mm above the floor;
                     // solved to 1e-8 of 1 kPa, with margin
}

} // namespace
} // namespace sluice::fluid
