// SPDX-License-Identifier: MIT
#include "tests/support/fluid_cases.hpp"

#include <gtest/gtest.h>

namespace sluice::fluid {
namespace {

using testing::FrozenCloud;

constexpr double h = 0.1;
constexpr int wide = 10, high = 8;

// Points of a lattice are `wider` spacings apart along the surface.
FrozenCloud stretched(double wider) {
  auto x = testing::lattice(wide, high, h);
  for (Vec<2> &p : x)
    p.x() *= wider;
  return FrozenCloud(
      x, testing::polyline({{0, 2}, {0, 0}, {wide * h * wider, 0}, {wide * h * wider, 2}}), h);
}

// Cells are rectangles, so that the layer of one point's area above the lower side, half a spacing
// below the point, is exactly 1 / wider spacings thick.
TEST(SurfaceDepth, IsWhereTheCellHoldsTheVolumeOfAPoint) {
  for (const double wider : {1.0, 1.15, 0.9}) {
    const FrozenCloud frozen = stretched(wider);
    ASSERT_EQ(frozen.count(PointKind::surface), wide);
    for (int i = 0; i < frozen.size(); ++i)
      if (frozen.cloud.kind[i] == PointKind::surface) {
        EXPECT_NEAR(frozen.cloud.surface_depth[i], (1 / wider - 0.5) * h, 1e-13);
        EXPECT_NEAR(frozen.cloud.cell_volume[i], h * h, 1e-13);
        EXPECT_NEAR(frozen.cloud.surface_normal[i].y(), 1, 1e-12);
      }
  }
}

TEST(SurfaceDepth, InSpaceIsHalfASpacingOnALattice) {
  constexpr int n = 5;
  std::vector<Vec<3>> x;
  for (int k = 0; k < n; ++k)
    for (int j = 0; j < n; ++j)
      for (int i = 0; i < n; ++i)
        x.push_back(h * Vec<3>(i + 0.5, j + 0.5, k + 0.5));
  const testing::FrozenCloudIn<3> frozen(x, testing::box_of_triangles({n * h, 2 * n * h, n * h}),
                                         h);
  ASSERT_EQ(frozen.count(PointKind::surface), n * n);
  for (int i = 0; i < frozen.size(); ++i) {
    EXPECT_EQ(frozen.cloud.openness[i], frozen.cloud.kind[i] == PointKind::surface ? 1 : 0);
    if (frozen.cloud.kind[i] == PointKind::surface) {
      EXPECT_NEAR(frozen.cloud.surface_depth[i], 0.5 * h, 1e-12);
    }
  }
}

// Openness by point; those of the surface to the right of the middle are moved aside by `gap`
// spacings.
std::vector<double> openness_with(double gap) {
  auto x = testing::lattice(wide, high, h);
  for (int i = wide * (high - 1) + wide / 2; i < wide * high; ++i)
    x[i].x() += gap * h;
  const FrozenCloud frozen(x, testing::polyline({{0, 2}, {0, 0}, {3, 0}, {3, 2}}), h);
  std::vector<double> openness(frozen.size());
  for (int i = 0; i < frozen.size(); ++i)
    openness[frozen.points.id[i]] = frozen.cloud.openness[i];
  return openness;
}

// The far corner of a cell moves by less than the gap widens; the smoothstep over 0.3 spacings
// rises by at most 1.5 / 0.3 per spacing.
TEST(Emergence, GoesFromInteriorToSurfaceWithoutAJump) {
  constexpr double step = 0.01, steepest = 1.5 / 0.3;
  constexpr int below = wide * (high - 2) + wide / 2; // under the gap
  std::vector<double> last = openness_with(0);
  EXPECT_EQ(last[below], 0);
  for (double gap = step; gap < 2; gap += step) {
    const std::vector<double> now = openness_with(gap);
    for (int i = wide * (high - 2); i < wide * (high - 1) - 1; ++i)
      EXPECT_LE(std::abs(now[i] - last[i]), steepest * step) << "point " << i << ", gap " << gap;
    last = now;
  }
  EXPECT_EQ(last[below], 1);
}

} // namespace
} // namespace sluice::fluid
