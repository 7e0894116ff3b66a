// SPDX-License-Identifier: MIT
#include "fluid/wall_face.hpp"

#include <gtest/gtest.h>

#include <cstdio>
#include <random>

namespace sluice::fluid {
namespace {

Vec<3> random_point(std::mt19937 &engine) {
  std::uniform_real_distribution<double> uniform(-1, 1);
  const double x = uniform(engine), y = uniform(engine), z = uniform(engine);
  return {x, y, z};
}

Corners<3> random_triangle(std::mt19937 &engine) {
  const Vec<3> a = random_point(engine), b = random_point(engine), c = random_point(engine);
  return {a, b, c};
}

// The foot of a point on a convex set is the one from which no corner lies towards the point.
TEST(WallFace, TheNearestPointOfATriangleHasNoCornerCloserToThePoint) {
  std::mt19937 engine(1);
  std::array<int, 3> found{}; // inside, side, corner
  for (int n = 0; n < 3000; ++n) {
    const Corners<3> c = random_triangle(engine);
    const Vec<3> x = 2 * random_point(engine);
    const Foot<3> foot = nearest_on_face(c, x);
    for (const Vec<3> &corner : c)
      ASSERT_LE((x - foot.point).dot(corner - foot.point), 1e-12);
    const Vec<3> again = interpolated<Vec<3>>(foot.shape, c[0], c[1], c[2]);
    ASSERT_NEAR((again - foot.point).norm(), 0, 1e-12);
    ASSERT_NEAR(foot.shape[0] + foot.shape[1] + foot.shape[2], 1, 1e-14);
    for (const double s : foot.shape)
      ASSERT_GE(s, 0);
    ++found[foot.part.is_inside() ? 0 : foot.part.is_side() ? 1 : 2];
  }
  std::printf("feet inside %d, on a side %d, on a corner %d\n", found[0], found[1], found[2]);
  for (const int count : found)
    EXPECT_GT(count, 100); // every kind was asked for
}

TEST(WallFace, TheNormalOfATrianglePointsToWhereItsCornersRunCounterClockwise) {
  const Corners<3> floor{Vec<3>(0, 0, 0), Vec<3>(0, 0, 1), Vec<3>(1, 0, 0)};
  EXPECT_NEAR((face_normal(floor) - Vec<3>(0, 1, 0)).norm(), 0, 1e-15);
  EXPECT_NEAR(face_measure(floor), 0.5, 1e-15);
}

// Integral of N_a N_b over a triangle: area (1 + delta_ab) / 12.
TEST(WallFace, TheQuadratureIsExactForProductsOfShapeFunctionsAndAsFineAsAsked) {
  std::mt19937 engine(2);
  for (const double longest : {10.0, 0.3, 0.05}) {
    const Corners<3> c = random_triangle(engine);
    Mat<3> sum = Mat<3>::Zero();
    int points = 0;
    for_each_quadrature_point(c, longest, [&](const Shape<3> &shape, double weight) {
      const Vec<3> n(shape[0], shape[1], shape[2]);
      sum += weight * n * n.transpose();
      ++points;
    });
    const Mat<3> exact = face_measure(c) / 12 * (Mat<3>::Identity() + Mat<3>::Ones());
    EXPECT_NEAR((sum - exact).norm(), 0, 1e-14 * points);
    EXPECT_GE(points, 3 * face_measure(c) / (longest * longest));
  }
}

// What is not of concern is left out in large parts; the rest comes in the same order.
TEST(WallFace, AQuadratureOfPartOfATriangleIsThatOfTheWholeWithoutTheRest) {
  std::mt19937 engine(5);
  const Corners<3> c = random_triangle(engine);
  const Vec<3> centre = (c[0] + c[1] + c[2]) / 3;
  const double radius = 0.1 * (c[1] - c[0]).norm(), longest = 0.02 * (c[1] - c[0]).norm();
  const auto is_inside = [&](const Shape<3> &s) {
    return (interpolated<Vec<3>>(s, c[0], c[1], c[2]) - centre).norm() < radius;
  };
  std::vector<Shape<3>> whole, part;
  int visited = 0, all = 0, asked = 0;
  for_each_quadrature_point(c, longest, [&](const Shape<3> &s, double) {
    ++all;
    if (is_inside(s))
      whole.push_back(s);
  });
  const auto may_reach = [&](const Corners<3> &p) { // the circle around a part meets the ball
    ++asked;
    const Vec<3> middle = (p[0] + p[1] + p[2]) / 3;
    double size = 0;
    for (const Vec<3> &x : p)
      size = std::max(size, (x - middle).norm());
    return (middle - centre).norm() < size + radius;
  };
  for_each_quadrature_point(
      c, longest,
      [&](const Shape<3> &s, double) {
        ++visited;
        if (is_inside(s))
          part.push_back(s);
      },
      may_reach);
  EXPECT_EQ(part, whole);
  EXPECT_GT(part.size(), 100u);
  EXPECT_LT(visited, all / 4);
  EXPECT_LT(asked, all / 4);
}

TEST(WallFace, ALineThroughACommonSideCrossesOneOfTheTwoTriangles) {
  std::mt19937 engine(3);
  std::uniform_real_distribution<double> uniform(0, 1);
  for (int n = 0; n < 1000; ++n) {
    const Vec<3> a = random_point(engine), b = random_point(engine);
    const Vec<3> c = random_point(engine), d = a + b - c; // a parallelogram: flat
    const Vec<3> on_side = a + uniform(engine) * (b - a);
    const Vec<3> step = 0.25 * face_normal(Corners<3>{a, b, c});
    const int crossed = is_crossed(Corners<3>{a, b, c}, on_side - step, on_side + step) +
                        is_crossed(Corners<3>{b, a, d}, on_side - step, on_side + step);
    ASSERT_EQ(crossed, 1);
  }
}

TEST(WallFace, ALineBesideATriangleOrInFrontOfItDoesNotCrossIt) {
  const Corners<3> c{Vec<3>(0, 0, 0), Vec<3>(1, 0, 0), Vec<3>(0, 1, 0)};
  EXPECT_TRUE(is_crossed(c, {0.3, 0.3, 1}, {0.3, 0.3, -1}));
  EXPECT_TRUE(is_crossed(c, {0.3, 0.3, -1}, {0.3, 0.3, 1}));
  EXPECT_FALSE(is_crossed(c, {0.6, 0.6, 1}, {0.6, 0.6, -1}));
  EXPECT_FALSE(is_crossed(c, {0.3, 0.3, 1}, {0.3, 0.3, 0.1}));
}

} // namespace
} // namespace sluice::fluid
