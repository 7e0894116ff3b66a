// SPDX-License-Identifier: MIT
#include "fluid/face_tree.hpp"
#include "tests/support/fine_walls.hpp"

#include <gtest/gtest.h>

namespace sluice::fluid {
namespace {

using testing::every_face;
using testing::hills;
using testing::Noise;
using testing::star;

struct Findings {
  int projections = 0, edges = 0, hidden = 0;
};

// From places all around, those on the surface and close to it among them.
template <int dim>
Findings expect_as_by_every_face(const Walls<dim> &walls, const FaceTree<dim> &tree, double reach) {
  Noise noise(3);
  const std::vector<int> all = every_face(walls);
  Findings findings;
  for (int n = 0; n < 600; ++n) {
    const WallFace<dim> &face = walls.faces[n % walls.faces.size()];
    Vec<dim> x = noise.vector<dim>();
    if (n % 3 > 0)
      x = walls.position[face.vertex[0]] + (n % 3 == 1 ? 0.05 : 1e-4) * x;
    const PointWalls<dim> found = project_on_walls(walls, tree, x, reach);
    const PointWalls<dim> expected = project_on_walls(walls, all, x, reach);
    EXPECT_EQ(found.count, expected.count) << "from " << x.transpose();
    for (int k = 0; k < std::min(found.count, expected.count); ++k) {
      const Projection<dim> &p = found.projection[k], &q = expected.projection[k];
      EXPECT_EQ(p.face, q.face);
      EXPECT_EQ(p.point, q.point);
      EXPECT_EQ(p.normal, q.normal);
      EXPECT_EQ(p.distance, q.distance);
      EXPECT_EQ(p.at_edge, q.at_edge);
      findings.edges += p.at_edge;
    }
    findings.projections += found.count;
    EXPECT_EQ(is_near_walls(walls, tree, x, 0.3 * reach),
              distance_to_walls(walls, x) <= 0.3 * reach);
    const Vec<dim> y = x + reach * noise.vector<dim>();
    EXPECT_EQ(is_hidden(walls, tree, x, y), is_hidden(walls, all, x, y));
    findings.hidden += is_hidden(walls, tree, x, y);
  }
  return findings;
}

TEST(FaceTree, FindsWhatATestOfEveryFaceFindsInThePlane) {
  for (const double jitter : {0.0, 0.3}) {
    const Walls<2> walls = star(500, jitter);
    FaceTree<2> tree;
    tree.update(walls);
    const Findings findings = expect_as_by_every_face(walls, tree, 0.4);
    EXPECT_GT(findings.projections, 600);
    EXPECT_GT(findings.hidden, 100);
  }
}

TEST(FaceTree, FindsWhatATestOfEveryFaceFindsInSpace) {
  for (const double height : {0.0, 0.05, 0.3})
    for (const double jitter : {0.0, 0.3}) {
      const Walls<3> walls = hills(24, height, jitter);
      FaceTree<3> tree;
      tree.update(walls);
      const Findings findings = expect_as_by_every_face(walls, tree, 0.4);
      EXPECT_GT(findings.projections, 400);
      EXPECT_GT(findings.edges, 10);
      EXPECT_GT(findings.hidden, 100);
    }
}

TEST(FaceTree, FollowsWallsThatMove) {
  Walls<3> walls = hills(16, 0.1, 0.2);
  FaceTree<3> tree;
  tree.update(walls);
  for (Vec<3> &x : walls.position)
    x = {x.x() + 0.3 * x.y(), x.z(), -x.y()}; // sheared and laid on its side
  tree.update(walls);
  expect_as_by_every_face(walls, tree, 0.4);
}

// Of a surface that is cut into 64 times as many faces, hardly more are looked at.
TEST(FaceTree, AsksFewOfManyFaces) {
  const auto asked = [](int n) {
    const Walls<3> walls = hills(n, 0.03, 0);
    FaceTree<3> tree;
    tree.update(walls);
    Noise noise(4);
    std::array<double, 2> count{};
    constexpr int trials = 200;
    for (int k = 0; k < trials; ++k) {
      Vec<3> x = 0.7 * noise.vector<3>(), y = 0.7 * noise.vector<3>();
      x.z() = 0.1;
      y.z() = -0.1;
      tree.for_each_facing(x, 0.3, [&](int) { count[0] += 1.0 / trials; });
      tree.any_along(x, y, [&](int) {
        count[1] += 1.0 / trials;
        return false;
      });
    }
    std::printf("%zu faces: %.0f asked for the nearest, %.0f along a line\n", walls.faces.size(),
                count[0], count[1]);
    return count;
  };
  const auto coarse = asked(16), fine = asked(128);
  EXPECT_LT(fine[0], 3 * coarse[0]);
  EXPECT_LT(fine[1], 3 * coarse[1]);
}

} // namespace
} // namespace sluice::fluid
