// SPDX-License-Identifier: MIT
#include "fluid/scene.hpp"
#include "fluid/surface_mesh.hpp"
#include "tests/support/fluid_cases.hpp"

#include <gtest/gtest.h>

namespace sluice::fluid {
namespace {

using testing::contains;
using testing::message_of;

// A box of quadrilaterals, each cut in two, seen from inside; the unit cube unless stretched.
SurfaceMesh box(const Vec<3> &size = Vec<3>::Ones()) {
  SurfaceMesh mesh;
  for (int k = 0; k < 8; ++k)
    mesh.position.push_back(size.cwiseProduct(Vec<3>(k & 1, k >> 1 & 1, k >> 2 & 1)));
  const std::vector<std::array<int, 4>> quadrilaterals{{0, 1, 3, 2}, {4, 6, 7, 5}, {0, 4, 5, 1},
                                                       {2, 3, 7, 6}, {0, 2, 6, 4}, {1, 5, 7, 3}};
  for (int f = 0; f < 6; ++f) {
    const auto &q = quadrilaterals[f];
    mesh.triangles.push_back({q[0], q[1], q[2]});
    mesh.triangles.push_back({q[0], q[2], q[3]});
    mesh.face.insert(mesh.face.end(), 2, f);
  }
  return mesh;
}

Scene<3> scene_in(const SurfaceMesh &mesh, const std::string &more = "") {
  const std::string text = R"(
[fluid]
dimension = 3
spacing_m = 0.1
side_walls = "none"
fill_from_m = [0.3, 0.3, 0.3]
fill_level_m = 0.6
[[fluid.wall]]
name = "vessel"
file = "vessel.stl"
)";
  const Config config = Config::parse(text + more, "vessel.toml");
  return read_scene<3>(config, [&](const std::filesystem::path &) { return mesh; });
}

TEST(SurfaceMesh, AVesselIsFilledToItsLevel) {
  EXPECT_EQ(scene_in(box()).initial.points.size(), 10 * 6 * 10);
}

TEST(SurfaceMesh, AnOpenVesselNamesTheFaceAtItsBorder) {
  SurfaceMesh mesh = box();
  mesh.triangles.erase(mesh.triangles.begin() + 6); // half of face 3, the lid
  mesh.face.erase(mesh.face.begin() + 6);
  const std::string message = message_of([&] { scene_in(mesh); });
  EXPECT_TRUE(contains(message, "wall 'vessel' is open: face ")) << message;
  EXPECT_TRUE(contains(message, "(3 such edges in all)")) << message;
}

TEST(SurfaceMesh, AFlippedFaceIsNamed) {
  SurfaceMesh mesh = box();
  std::swap(mesh.triangles[5][1], mesh.triangles[5][2]);
  const std::string message = message_of([&] { scene_in(mesh); });
  EXPECT_TRUE(contains(message, "face 2")) << message;
}

TEST(SurfaceMesh, FacesThatCrossAreNamed) {
  SurfaceMesh mesh = box();
  const SurfaceMesh other = box(Vec<3>(0.5, 2, 0.5)); // its sides come out of the first one's lid
  const int n = static_cast<int>(mesh.position.size());
  for (const Vec<3> &x : other.position)
    mesh.position.push_back(x + Vec<3>(0.25, 0.25, 0.25));
  for (std::size_t k = 0; k < other.triangles.size(); ++k) {
    const auto &[a, b, c] = other.triangles[k];
    mesh.triangles.push_back({n + a, n + b, n + c});
    mesh.face.push_back(6 + other.face[k]);
  }
  const std::string message = message_of([&] { scene_in(mesh); });
  EXPECT_TRUE(contains(message, "goes through itself: faces 3 and ")) << message;
}

TEST(SurfaceMesh, AReversedSurfaceHasTheFluidBehindItsFaces) {
  SurfaceMesh mesh = box();
  for (auto &triangle : mesh.triangles)
    std::swap(triangle[1], triangle[2]);
  const std::string message = message_of([&] { scene_in(mesh); });
  EXPECT_TRUE(contains(message, "lies behind wall 'vessel'")) << message;
  EXPECT_EQ(scene_in(mesh, "reversed = true").initial.points.size(), 600);
}

} // namespace
} // namespace sluice::fluid
