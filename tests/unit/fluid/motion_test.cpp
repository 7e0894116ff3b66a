// SPDX-License-Identifier: MIT
#include "fluid/motion.hpp"
#include "tests/support/fluid_cases.hpp"

#include <gtest/gtest.h>

namespace sluice::fluid {
namespace {

using testing::FrozenCloud;

constexpr double h = 0.1;

// Water in an open tank of 10 x 8 points.
FrozenCloud tank(double jitter = 0) {
  return FrozenCloud(testing::lattice(10, 8, h, jitter),
                     testing::polyline({{0, 2}, {0, 0}, {1, 0}, {1, 2}}), h);
}

TEST(VolumeRestoringDivergence, IsZeroOnALattice) {
  const FrozenCloud frozen = tank();
  EXPECT_EQ(frozen.count(PointKind::surface), 10);
  EXPECT_EQ(frozen.count(PointKind::interior), 70);
  std::vector<double> memory, divergence(frozen.size(), 7);
  volume_restoring_divergence(frozen.points, frozen.cloud, {}, 10.0, memory, divergence);
  const double rate = MotionParams().volume_rate * 10;
  for (const double d : divergence)
    EXPECT_NEAR(d, 0, 1e-13 * rate); // areas of cells are exact to round-off
}

TEST(VolumeRestoringDivergence, LetsASqueezedCloudGrowAtTheStatedRate) {
  auto x = testing::lattice(10, 10, h);
  for (Vec<2> &p : x)
    p.y() *= 0.9;
  const FrozenCloud frozen(x, testing::closed_box(1, 0.9), h);
  std::vector<double> memory, divergence(frozen.size());
  volume_restoring_divergence(frozen.points, frozen.cloud, {}, 10.0, memory, divergence);
  const double expected = 0.1 * MotionParams().volume_rate * 10;
  for (const double d : divergence)
    EXPECT_NEAR(d, expected, 1e-12);
}

// The jitter of 0.05 spacings leaves the middle of every cell within the 0.1 that are let be.
TEST(PlanShift, IsZeroInAFluidAtRestWhoseCellsAreWellKept) {
  FrozenCloud regular = tank(), irregular = tank(0.05);
  for (FrozenCloud *frozen : {&regular, &irregular}) {
    const std::vector<Mat<2>> no_gradient(frozen->size(), Mat<2>::Zero());
    plan_shift(frozen->points, frozen->cloud, {}, no_gradient, 1e-3);
    for (int i = 0; i < frozen->size(); ++i) {
      EXPECT_EQ(frozen->points.shift[i].norm(), 0);
      EXPECT_EQ(frozen->points.shift_velocity[i].norm(), 0);
    }
  }
}

TEST(PlanShift, PushesAPairApartThatIsCloserThanTheLimitToBothSidesAlike) {
  auto x = testing::lattice(10, 8, h);
  const int a = 44, b = 45;
  x[a].x() += 0.2 * h;
  x[b].x() -= 0.2 * h; // 0.6 spacings apart
  FrozenCloud frozen(x, testing::polyline({{0, 2}, {0, 0}, {1, 0}, {1, 2}}), h);
  const std::vector<Mat<2>> no_gradient(frozen.size(), Mat<2>::Zero());
  MotionParams params;
  params.widest_offset = 1; // only the pair counts
  plan_shift(frozen.points, frozen.cloud, params, no_gradient, 1e-3);
  for (int i = 0; i < frozen.size(); ++i) {
    const double expected = frozen.points.id[i] == a   ? -0.05 * h
                            : frozen.points.id[i] == b ? 0.05 * h
                                                       : 0.0;
    EXPECT_NEAR(frozen.points.shift[i].x(), expected, 1e-13); // to 0.7 spacings, half each
    EXPECT_NEAR(frozen.points.shift[i].y(), 0, 1e-13);
  }
}

// A point of a lattice is gone: the cells around the hole reach half a spacing farther on one side.
TEST(PlanShift, ClosesHolesAlsoInAFluidAtRest) {
  auto x = testing::lattice(10, 8, h);
  const Vec<2> hole = x[44];
  x.erase(x.begin() + 44);
  FrozenCloud frozen(x, testing::polyline({{0, 2}, {0, 0}, {1, 0}, {1, 2}}), h);
  const std::vector<Mat<2>> no_gradient(frozen.size(), Mat<2>::Zero());
  const MotionParams params;
  plan_shift(frozen.points, frozen.cloud, params, no_gradient, 1e-3);
  for (int i = 0; i < frozen.size(); ++i) {
    const Vec<2> shift = frozen.points.shift[i], offset = frozen.cloud.centroid_offset[i];
    const double excess = std::max(offset.norm() - params.widest_offset * h, 0.0);
    EXPECT_NEAR(shift.norm(), 0.5 * excess, 1e-13);
    if ((frozen.points.position[i] - hole).norm() < 1.1 * h) {
      EXPECT_GT(shift.norm(), 0);
      EXPECT_NEAR(shift.normalized().dot((hole - frozen.points.position[i]).normalized()), 1,
                  1e-12);
    }
  }
}

// One point among walls, moved by contact.
struct Contact {
  FrozenCloud frozen;
  int put_back = 0;

  Contact(const Vec<2> &x, const Vec<2> &u, Walls<2> walls) : frozen({x}, std::move(walls), h) {
    frozen.points.velocity[0] = u;
    put_back = keep_clear_of_walls(frozen.points, frozen.walls, {}, frozen.cloud).put_back;
  }
  const Vec<2> &position() const { return frozen.points.position[0]; }
  const Vec<2> &velocity() const { return frozen.points.velocity[0]; }
};

TEST(WallContact, PutsAPointBackFromBehindAWallAndTakesItsApproachVelocity) {
  const Contact contact({0.5, -0.3 * h}, {2, -3}, testing::polyline({{0, 0}, {1, 0}}));
  EXPECT_EQ(contact.put_back, 1);
  EXPECT_NEAR((contact.position() - Vec<2>(0.5, 0.25 * h)).norm(), 0, 1e-14);
  EXPECT_NEAR((contact.velocity() - Vec<2>(2, 0)).norm(), 0, 1e-14);
}

// Pressure holds an enclosed point already; to take its velocity in every step would cost energy
// per step. A point next to air meets the wall.
TEST(WallContact, TakesTheApproachVelocityOfAPointNextToAirOnly) {
  for (const SurfaceMemory memory : {SurfaceMemory::enclosed, SurfaceMemory::open}) {
    FrozenCloud frozen({{0.5, 0.1 * h}}, testing::polyline({{0, 0}, {1, 0}}), h);
    frozen.points.velocity[0] = {2, -3};
    frozen.points.at_surface[0] = memory;
    keep_clear_of_walls(frozen.points, frozen.walls, {}, frozen.cloud);
    EXPECT_NEAR(frozen.points.position[0].y(), MotionParams().wall_clearance * h, 1e-15);
    EXPECT_EQ(frozen.points.velocity[0], Vec<2>(2, memory == SurfaceMemory::open ? 0 : -3));
  }
}

TEST(WallContact, LeavesAPointThatIsClearOrMovesAway) {
  const Walls<2> floor = testing::polyline({{0, 0}, {1, 0}});
  const Contact clear({0.5, 0.26 * h}, {2, -3}, floor);
  EXPECT_EQ(clear.position(), Vec<2>(0.5, 0.26 * h));
  EXPECT_EQ(clear.velocity(), Vec<2>(2, -3));
  const Contact leaving({0.5, 0.1 * h}, {2, 3}, floor);
  EXPECT_EQ(leaving.put_back, 0);
  EXPECT_NEAR((leaving.velocity() - Vec<2>(2, 3)).norm(), 0, 1e-14);
}

TEST(WallContact, MeasuresTheApproachAgainstAMovingWall) {
  Walls<2> floor = testing::polyline({{0, 0}, {1, 0}});
  floor.velocity = {{0, 0.5}, {0, 0.5}};
  const Contact contact({0.5, 0.1 * h}, {0, 0}, floor);
  EXPECT_NEAR((contact.velocity() - Vec<2>(0, 0.5)).norm(), 0, 1e-14);
}

TEST(WallContact, PutsAPointBetweenTwoWallsToTheMiddle) {
  Walls<2> slit; // 0.3 spacings wide, less than two clearances
  testing::add_polyline(slit, {{0, 0}, {1, 0}}, "floor");
  testing::add_polyline(slit, {{1, 0.3 * h}, {0, 0.3 * h}}, "lid");
  for (const double y : {0.05, 0.29, -0.02, 0.15}) {
    const Contact contact({0.5, y * h}, {1, -1}, slit);
    // clearance 0.45 of the gap to either side: within 0.05 of the gap of the middle
    EXPECT_NEAR(contact.position().y(), 0.15 * h, 0.05001 * 0.3 * h) << y;
    EXPECT_NEAR(contact.velocity().x(), 1, 1e-14);
  }
}

TEST(WallContact, HoldsAPointInACornerClearOfBothWalls) {
  const Contact contact({-0.1 * h, 0.1 * h}, {-1, -1}, testing::polyline({{0, 1}, {0, 0}, {1, 0}}));
  EXPECT_NEAR((contact.position() - Vec<2>(0.25 * h, 0.25 * h)).norm(), 0, 1e-13);
  EXPECT_NEAR(contact.velocity().norm(), 0, 1e-13);
}

TEST(Motion, IsExactForConstantAccelerationOnceTwoVelocitiesAreKnown) {
  const Vec<2> a(0.3, -9.81), u0(1, 2);
  const double dt[] = {0.01, 0.02, 0.003}; // in turn: the step may change
  Points<2> points = testing::points_at({{0, 0}});
  points.previous_velocity[0] = u0;
  points.velocity[0] = u0 + dt[0] * a;
  // Velocity is linear in time, so its mean over a step is the one extrapolated to the middle.
  const auto exact = [&](double t) { return Vec<2>(u0 * t + 0.5 * t * t * a); };
  double time = dt[0];
  points.position[0] = exact(time);
  for (int n = 1; n < 50; ++n) {
    const double step = dt[n % 3];
    move_points(points, step, 0.5 * step / dt[(n - 1) % 3]);
    time += step;
    ASSERT_NEAR((points.position[0] - exact(time)).norm(), 0, 1e-13);
    points.previous_velocity[0] = points.velocity[0];
    points.velocity[0] += step * a;
  }
}

// A point on a spring towards the origin: x x u is kept to round-off by every step of any length.
TEST(Motion, OfFirstOrderKeepsAngularMomentumUnderACentralForce) {
  const double dt[] = {0.1, 0.2, 0.05};
  Points<2> points = testing::points_at({{1, 0}});
  points.velocity[0] = {0.2, 1};
  const double start = cross(points.position[0], points.velocity[0]);
  for (int n = 0; n < 200; ++n) {
    points.previous_velocity[0] = points.velocity[0];
    move_points(points, dt[n % 3], 0);
    points.velocity[0] -= dt[n % 3] * points.position[0];
  }
  EXPECT_NEAR(cross(points.position[0], points.velocity[0]), start, 1e-13);
}

TEST(Motion, AppliesAPlannedShiftOnceAndCorrectsTheVelocityForIt) {
  Points<2> points = testing::points_at({{0, 0}});
  points.shift[0] = {0.01, 0};
  points.shift_velocity[0] = {0, 0.5};
  move_points(points, 0.1, 0.5);
  EXPECT_EQ(points.position[0], Vec<2>(0.01, 0));
  EXPECT_EQ(points.velocity[0], Vec<2>(0, 0.5));
  EXPECT_EQ(points.previous_velocity[0], Vec<2>(0, 0.5));
  move_points(points, 0, 0.5);
  EXPECT_EQ(points.position[0], Vec<2>(0.01, 0));
}

} // namespace
} // namespace sluice::fluid
