// SPDX-License-Identifier: MIT
#include "fluid/point_noise.hpp"
#include "tests/support/fluid_cases.hpp"

#include <gtest/gtest.h>

namespace sluice::fluid {
namespace {

using testing::FrozenCloud;

constexpr double h = 0.1, rate = 5, dt = 0.01;

FrozenCloud box(double jitter) {
  return FrozenCloud(testing::lattice(12, 12, h, jitter), testing::closed_box(1.2, 1.2), h);
}

TEST(PointNoise, LeavesQuadraticVelocityFieldsAlone) {
  const FrozenCloud frozen = box(0.25);
  const auto u = frozen.values([](const Vec<2> &x) {
    return Vec<2>(1 + x.x() - 2 * x.y() + x.x() * x.x() - 3 * x.x() * x.y(), x.y() * x.y() - x.x());
  });
  const auto gradient = frozen.values([](const Vec<2> &x) {
    Mat<2> g;
    g << 1 + 2 * x.x() - 3 * x.y(), -2 - 3 * x.x(), -1, 2 * x.y();
    return g;
  });
  std::vector<Vec<2>> damped = u;
  damp_point_noise(frozen.points, frozen.cloud, u, gradient, rate, dt, damped);
  for (int i = 0; i < frozen.size(); ++i)
    EXPECT_NEAR((damped[i] - u[i]).norm(), 0, 1e-14); // round-off of values of order one
}

TEST(PointNoise, DampsAVelocityThatAlternatesFromPointToPoint) {
  const FrozenCloud frozen = box(0);
  const auto sign = frozen.values([](const Vec<2> &x) {
    const int parity = static_cast<int>(x.x() / h) + static_cast<int>(x.y() / h);
    return Vec<2>(0, parity % 2 == 0 ? 1 : -1);
  });
  const std::vector<Mat<2>> gradient(frozen.size(), Mat<2>::Zero()); // what the operators see of it
  std::vector<Vec<2>> damped = sign;
  damp_point_noise(frozen.points, frozen.cloud, sign, gradient, rate, dt, damped);
  double smallest = 1, largest = 0;
  for (int i = 0; i < frozen.size(); ++i) {
    smallest = std::min(smallest, damped[i].dot(sign[i]));
    largest = std::max(largest, damped[i].dot(sign[i]));
  }
  std::printf("alternating mode: factor %.4f to %.4f per step\n", smallest, largest);
  // A full lattice neighbourhood has about as much weight in either colour: the decay per step is
  // between half and twice rate dt; points at walls have at least a third of the neighbours.
  EXPECT_GT(smallest, 1 - 2 * rate * dt);
  EXPECT_LT(largest, 1 - rate * dt / 3);
}

TEST(PointNoise, KeepsLinearMomentumForAnyVelocityAndGradient) {
  const FrozenCloud frozen = box(0.3);
  std::mt19937 engine(9);
  std::uniform_real_distribution<double> uniform(-1, 1);
  std::vector<Vec<2>> u;
  std::vector<Mat<2>> gradient;
  for (int i = 0; i < frozen.size(); ++i) {
    u.emplace_back(uniform(engine), uniform(engine));
    Mat<2> g;
    g << uniform(engine), uniform(engine), uniform(engine), uniform(engine);
    gradient.push_back(10 * g);
  }
  std::vector<Vec<2>> change(frozen.size(), Vec<2>::Zero());
  damp_point_noise(frozen.points, frozen.cloud, u, gradient, rate, dt, change);
  Vec<2> total(0, 0);
  double magnitude = 0;
  for (const Vec<2> &c : change) {
    total += c;
    magnitude += c.norm();
  }
  EXPECT_GT(magnitude, 0.1);
  EXPECT_LT(total.norm(), 1e-13 * magnitude);
}

TEST(PointNoise, NeverTakesMoreThanHalfAStepHoweverLong) {
  const FrozenCloud frozen = box(0);
  std::vector<Vec<2>> u(frozen.size(), Vec<2>::Zero());
  int middle = 0; // a point with a full neighbourhood
  for (int i = 0; i < frozen.size(); ++i)
    if ((frozen.points.position[i] - Vec<2>(0.55, 0.55)).norm() < 0.1 * h)
      middle = i;
  u[middle] = {1, 0};
  const std::vector<Mat<2>> gradient(frozen.size(), Mat<2>::Zero());
  std::vector<Vec<2>> damped = u;
  damp_point_noise(frozen.points, frozen.cloud, u, gradient, 1e6, 1, damped);
  EXPECT_NEAR(damped[middle].x(), 0.5, 1e-12);
}

} // namespace
} // namespace sluice::fluid
