// SPDX-License-Identifier: MIT
#include "fluid/walls.hpp"
#include "tests/support/fluid_cases.hpp"

#include <gtest/gtest.h>

namespace sluice::fluid {
namespace {

using testing::every_face;
using testing::polyline;
using testing::project;

constexpr double round_off = 1e-14;

TEST(Walls, InsideASegmentThereIsOneProjectionAtThePerpendicularFoot) {
  const Walls<2> floor = polyline({{0, 0}, {4, 0}});
  const PointWalls<2> found = project(floor, {1, 0.5}, 2);
  ASSERT_EQ(found.count, 1);
  const Projection<2> &p = found.projection[0];
  EXPECT_NEAR((p.point - Vec<2>(1, 0)).norm(), 0, round_off);
  EXPECT_NEAR((p.normal - Vec<2>(0, -1)).norm(), 0, round_off);
  EXPECT_NEAR(p.distance, 0.5, round_off);
  EXPECT_NEAR(p.shape[1], 0.25, round_off);
  EXPECT_FALSE(p.at_edge);
  EXPECT_EQ(project(floor, {1, 2.5}, 2).count, 0);
}

TEST(Walls, DistanceIsNegativeBehindTheWallAndTheNormalStaysOutOfTheFluid) {
  const Walls<2> floor = polyline({{0, 0}, {2, 0}, {4, 0}});
  for (const double x : {1.0, 2.0, 3.0}) { // over a shared vertex as well
    const PointWalls<2> found = project(floor, {x, -0.3}, 2);
    ASSERT_EQ(found.count, 1);
    EXPECT_NEAR(found.projection[0].distance, -0.3, round_off);
    EXPECT_NEAR((found.projection[0].normal - Vec<2>(0, -1)).norm(), 0, round_off);
  }
}

TEST(Walls, AConcaveCornerGivesTwoProjectionsNearestFirst) {
  const Walls<2> corner = polyline({{0, 4}, {0, 0}, {4, 0}});
  const PointWalls<2> found = project(corner, {0.5, 0.3}, 1);
  ASSERT_EQ(found.count, 2);
  EXPECT_NEAR(found.projection[0].distance, 0.3, round_off);
  EXPECT_NEAR(found.projection[1].distance, 0.5, round_off);
  EXPECT_NEAR((found.projection[1].normal - Vec<2>(-1, 0)).norm(), 0, round_off);
  EXPECT_FALSE(found.projection[0].at_edge || found.projection[1].at_edge);
}

TEST(Walls, ASharpEdgeGivesOneProjectionMarkedAsEdge) {
  // The lower right corner of a plate: down its right face and along its lower edge to the left.
  const Walls<2> edge = polyline({{0, 4}, {0, 0}, {-4, 0}});
  const PointWalls<2> found = project(edge, {0.3, -0.4}, 1);
  ASSERT_EQ(found.count, 1);
  EXPECT_TRUE(found.projection[0].at_edge);
  EXPECT_NEAR(found.projection[0].distance, 0.5, round_off);
  EXPECT_NEAR((found.projection[0].normal - Vec<2>(-0.6, 0.8)).norm(), 0, 1e-12);
}

TEST(Walls, TheOpenEndOfAWallIsAnEdge) {
  const Walls<2> step = polyline({{0, 0}, {4, 0}});
  for (const Vec<2> &x : {Vec<2>(-0.3, 0.4), Vec<2>(4.3, 0.4)}) {
    const PointWalls<2> found = project(step, x, 1);
    ASSERT_EQ(found.count, 1);
    EXPECT_TRUE(found.projection[0].at_edge);
    EXPECT_NEAR(found.projection[0].distance, 0.5, round_off);
  }
}

TEST(Walls, AMildlyConvexPolylineGivesOneProjectionEverywhere) {
  // A bent gate: 10 degrees per vertex, fluid outside of the arc.
  std::vector<Vec<2>> arc;
  for (int k = 0; k <= 9; ++k)
    arc.emplace_back(-std::cos(k * 0.1745), std::sin(k * 0.1745)); // clockwise, fluid on the left
  const Walls<2> gate = polyline(arc);
  for (int k = 1; k < 80; ++k) {
    const double angle = 0.05 + k * 0.0175;
    const Vec<2> x = 1.2 * Vec<2>(-std::cos(angle), std::sin(angle));
    const PointWalls<2> found = project(gate, x, 0.5);
    ASSERT_EQ(found.count, 1) << "at " << angle;
    EXPECT_FALSE(found.projection[0].at_edge);
    EXPECT_NEAR(found.projection[0].distance, 0.2, 0.004); // sagitta 1 - cos(5 degrees)
  }
}

// Four walls around a point, three places: the nearest three, whatever the order of the segments.
TEST(Walls, TheNearestThreeDirectionsDoNotDependOnTheOrderOfTheSegments) {
  Walls<2> walls;
  testing::add_polyline(walls, {{0.4, 2}, {0.4, -2}}, "left");            // 0.1 away
  testing::add_polyline(walls, {{-2, 0.3}, {2, 0.3}}, "below");           // 0.2
  testing::add_polyline(walls, {{0.8, -2}, {0.8, 2}}, "right");           // 0.3
  testing::add_polyline(walls, {{2, 0.9}, {-2, 0.9}}, "above");           // 0.4
  testing::add_polyline(walls, {{0.35, 2}, {0.35, -2}}, "left, farther"); // 0.15
  const Vec<2> x(0.5, 0.5);
  std::vector<int> order = every_face(walls);
  do {
    const PointWalls<2> found = project_on_walls(walls, order, x, 1);
    ASSERT_EQ(found.count, 3);
    for (int k = 0; k < 3; ++k)
      ASSERT_NEAR(found.projection[k].distance, 0.1 * (k + 1), round_off);
  } while (std::next_permutation(order.begin(), order.end()));
}

// Seen through the plate, the point would count as lying outside of the fluid.
TEST(Walls, TheFarFaceOfAThinPlateHasNoProjection) {
  const Walls<2> plate = polyline({{0.1, 2}, {0.1, 0}, {0, 0}, {0, 2}});
  const PointWalls<2> found = project(plate, {-0.05, 1}, 0.3);
  ASSERT_EQ(found.count, 1);
  EXPECT_NEAR(found.projection[0].distance, 0.05, round_off);
}

TEST(Walls, VelocityAtAProjectionIsInterpolatedAlongTheSegment) {
  Walls<2> floor = polyline({{0, 0}, {4, 0}});
  floor.velocity = {{1, 2}, {5, -2}};
  const PointWalls<2> found = project(floor, {1, 0.5}, 2);
  EXPECT_NEAR((wall_velocity(floor, found.projection[0]) - Vec<2>(2, 1)).norm(), 0, round_off);
}

TEST(Walls, AThinPlateHidesWhatIsBehindItAndNotWhatIsRoundItsFreeEnd) {
  const Walls<2> plate = polyline({{0.01, 1}, {0.01, 0}, {-0.01, 0}, {-0.01, 1}});
  const auto all = every_face(plate);
  EXPECT_TRUE(is_hidden(plate, all, {-0.2, 0.5}, {0.2, 0.5}));
  EXPECT_TRUE(is_hidden(plate, all, {0.2, 0.5}, {-0.2, 0.5}));
  EXPECT_TRUE(is_hidden(plate, all, {-0.2, 0.1}, {0.2, -0.05}));
  EXPECT_FALSE(is_hidden(plate, all, {-0.2, 0.05}, {0.2, -0.2}));
  EXPECT_FALSE(is_hidden(plate, all, {-0.2, -0.1}, {0.2, -0.1}));
  EXPECT_FALSE(is_hidden(plate, all, {-0.2, 0.5}, {-0.1, 0.9}));
}

TEST(Walls, ALineThroughASharedVertexIsHidden) {
  const Walls<2> wall = polyline({{0, -1}, {0, 0}, {0, 1}});
  EXPECT_TRUE(is_hidden(wall, every_face(wall), {-1, 0}, {1, 0}));
  EXPECT_TRUE(is_hidden(wall, every_face(wall), {1, 0}, {-1, 0}));
}

TEST(Walls, LinkingJoinsWallsThatShareAnEnd) {
  Walls<2> walls;
  testing::add_polyline(walls, {{0, 1}, {0, 0}}, "left");
  testing::add_polyline(walls, {{0, 0}, {1, 0}}, "floor");
  link_faces(walls);
  EXPECT_EQ(walls.faces[0].beyond[1], 1);
  EXPECT_EQ(walls.faces[1].beyond[0], 0);
  EXPECT_EQ(walls.faces[0].beyond[0], -1);
  EXPECT_EQ(walls.faces[1].beyond[1], -1);
}

TEST(Walls, LinkingRefusesABranchingVertexAndSaysWhere) {
  Walls<2> walls;
  testing::add_polyline(walls, {{0, 1}, {0.25, 0.5}, {1, 0}}, "left");
  testing::add_polyline(walls, {{0.25, 0.5}, {2, 2}}, "branch");
  const std::string message = testing::message_of([&] { link_faces(walls); });
  EXPECT_TRUE(testing::contains(message, "branch")) << message;
  EXPECT_TRUE(testing::contains(message, "(0.25, 0.5)")) << message;
}

TEST(Walls, LinkingRefusesTwoWallsThatRunAgainstEachOther) {
  Walls<2> walls;
  testing::add_polyline(walls, {{0, 1}, {0, 0}}, "left");
  testing::add_polyline(walls, {{1, 0}, {0, 0}}, "floor");
  EXPECT_NE(testing::message_of([&] { link_faces(walls); }), "");
}

// --- in space -----------------------------------------------------------------------------------

TEST(WallsInSpace, ACornerOfABoxGivesThreeProjectionsNearestFirstAndTheDiagonalsNone) {
  const Walls<3> box = testing::box_of_triangles({4, 3, 2});
  const PointWalls<3> found = project_on_walls<3>(box, every_face(box), {0.3, 0.5, 0.2}, 1);
  ASSERT_EQ(found.count, 3);
  const double distance[] = {0.2, 0.3, 0.5};
  const Vec<3> normal[] = {{0, 0, -1}, {-1, 0, 0}, {0, -1, 0}};
  for (int k = 0; k < 3; ++k) {
    EXPECT_NEAR(found.projection[k].distance, distance[k], round_off);
    EXPECT_NEAR((found.projection[k].normal - normal[k]).norm(), 0, round_off);
    EXPECT_FALSE(found.projection[k].at_edge);
  }
}

TEST(WallsInSpace, OnTheDiagonalOfAWallThereIsOneProjectionAndNoEdge) {
  const Walls<3> box = testing::box_of_triangles({1, 1, 1});
  for (const double t : {0.5, 0.3, 0.7}) // the floor z = 0 is split from (0, 0) to (1, 1)
    for (const double z : {0.1, -0.1}) {
      const PointWalls<3> found = project_on_walls<3>(box, every_face(box), {t, t, z}, 0.15);
      ASSERT_EQ(found.count, 1);
      EXPECT_NEAR(found.projection[0].distance, z, round_off);
      EXPECT_FALSE(found.projection[0].at_edge);
    }
}

// Outside of a box the nearest point is known: the box is where the coordinates are clamped to.
TEST(WallsInSpace, AroundABoxThereIsOneProjectionEverywhereAndEdgesAndCornersAreSharp) {
  const Vec<3> size(1, 2, 3);
  const Walls<3> box = testing::box_of_triangles(size, testing::Box::obstacle);
  std::mt19937 engine(5);
  std::uniform_real_distribution<double> uniform(-0.4, 1.4);
  int sharp = 0;
  for (int n = 0; n < 2000; ++n) {
    const double a = uniform(engine), b = uniform(engine), c = uniform(engine);
    const Vec<3> x = Vec<3>(a, b, c).cwiseProduct(size);
    const Vec<3> foot = x.cwiseMax(0).cwiseMin(size);
    if ((x - foot).norm() < 1e-3)
      continue;
    const PointWalls<3> found = project_on_walls<3>(box, every_face(box), x, 3);
    ASSERT_GE(found.count, 1);
    EXPECT_NEAR((found.projection[0].point - foot).norm(), 0, 1e-12);
    EXPECT_NEAR(found.projection[0].distance, (x - foot).norm(), 1e-12);
    const int outside = ((x - foot).array() != 0).count();
    EXPECT_EQ(found.projection[0].at_edge, outside > 1);
    sharp += outside > 1;
  }
  EXPECT_GT(sharp, 100);
}

TEST(WallsInSpace, LinkingRefusesAFaceThatIsTurnedRoundAndNamesIt) {
  Walls<3> box = testing::box_of_triangles({1, 1, 1});
  std::swap(box.faces[7].vertex[1], box.faces[7].vertex[2]);
  const std::string message = testing::message_of([&] { link_faces(box); });
  EXPECT_TRUE(testing::contains(message, "face 7 of wall 'box'")) << message;
  EXPECT_TRUE(testing::contains(message, "turned against")) << message;
}

TEST(WallsInSpace, LinkingRefusesAThirdFaceAtAnEdge) {
  Walls<3> box = testing::box_of_triangles({1, 1, 1});
  box.position.emplace_back(0.5, 0.5, 3);
  box.velocity.emplace_back(0, 0, 0);
  box.faces.push_back({{0, 1, 8}, 0, 12});
  const std::string message = testing::message_of([&] { link_faces(box); });
  EXPECT_TRUE(testing::contains(message, "more than two faces meet")) << message;
  EXPECT_TRUE(testing::contains(message, "face 12")) << message;
}

} // namespace
} // namespace sluice::fluid
