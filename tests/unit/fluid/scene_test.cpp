// SPDX-License-Identifier: MIT
#include "fluid/scene.hpp"
#include "fluid/wall_motion.hpp"
#include "tests/support/fluid_cases.hpp"

#include <gtest/gtest.h>

namespace sluice::fluid {
namespace {

using testing::contains;
using testing::message_of;
using testing::scene_of;

std::string replaced(std::string text, const std::string &from, const std::string &to) {
  const auto at = text.find(from);
  EXPECT_NE(at, std::string::npos) << from;
  return text.replace(at, from.size(), to);
}

TEST(Scene, FillsTheWaterWithALatticeHalfASpacingOffTheWalls) {
  const Scene<2> scene = scene_of(testing::gate_tank());
  const Points<2> &points = scene.initial.points;
  ASSERT_EQ(points.size(), 25 * 35);
  EXPECT_NEAR((points.position[0] - Vec<2>(0.002, 0.002)).norm(), 0, 1e-15);
  EXPECT_EQ(scene.walls.coupled_vertices.size(), scene.walls.coupled_faces.size() + 1);
}

TEST(Scene, ATiltedLatticeHoldsNearlyAsManyPoints) {
  const Scene<2> scene = scene_of(testing::gate_tank(), {"fluid.lattice_angle_deg=10"});
  EXPECT_NEAR(scene.initial.points.size(), 875, 30); // half a point per spacing of the outline
}

TEST(Scene, RefusesWaterThatOverlapsAWallWithNameAndPlace) {
  const std::string text = replaced(testing::gate_tank(), "[0.1, 0.14]", "[0.104, 0.14]");
  const std::string message =
      message_of([&] { scene_of(replaced(text, "[0.1, 0], [0.1", "[0.104, 0], [0.1")); });
  EXPECT_TRUE(contains(message, "overlaps wall 'gate'")) << message;
  EXPECT_TRUE(contains(message, "(0.102, 0.002) m")) << message;
  EXPECT_TRUE(contains(message, "0.002 m behind")) << message;
}

TEST(Scene, ALatticeFillsAnyConvexWaterWhereverItLiesAndHoweverItIsTurned) {
  const std::string text = replaced(testing::gate_tank(), "[0, 0]", "[0.0, 0.0]");
  for (const char *angle : {"-45", "-10", "0", "30", "45"}) {
    const Scene<2> scene = scene_of(text, {std::string("fluid.lattice_angle_deg=") + angle});
    EXPECT_NEAR(volume_error(scene), 0, 0.035) << angle; // half a point per spacing of the outline
  }
}

// A belt that starts and ends gently: linear between the shares, on the corners of cut legs too.
TEST(Scene, AWallSlidesWithTheSharesOfItsVelocity) {
  const std::string belt = "[fluid]\nspacing_m = 0.1\nopen_sides = true\n"
                           "water_m = [[0, 0], [1, 0], [1, 1], [0, 1]]\n"
                           "[[fluid.wall]]\nname = \"floor\"\n"
                           "points_m = [[0, 0], [0.2, 0], [0.8, 0], [1, 0]]\n"
                           "segment_length_m = 0.1\nvelocity_m_s = [2, 0]\n"
                           "velocity_shares = [0, 1, 0.5, 0]\n";
  const std::string rides = "displacement_m = [\"0\", \"0.3*t\"]\n";
  for (Scene<2> scene : {scene_of(belt), scene_of(belt + rides)}) {
    const bool moves = !scene.prescribed.empty();
    move_walls(scene.prescribed, 0.0, 0.1, scene.walls);
    ASSERT_EQ(scene.walls.position.size(), 11u);
    for (std::size_t k = 0; k < scene.walls.position.size(); ++k) {
      const double x = scene.walls.position[k].x();
      const double share = x < 0.2 ? 5 * x : x < 0.8 ? 1 - (x - 0.2) / 1.2 : 2.5 * (1 - x);
      EXPECT_NEAR(scene.walls.velocity[k].x(), 2 * share, 1e-14) << x;
      EXPECT_NEAR(scene.walls.velocity[k].y(), moves ? 0.3 : 0, 1e-14) << x;
    }
  }
  const std::string message =
      message_of([&] { scene_of(replaced(belt, "[0, 1, 0.5, 0]", "[0, 1, 0]")); });
  EXPECT_TRUE(contains(message, "velocity_shares")) << message;
  EXPECT_TRUE(contains(message, "3 shares for 4 points_m")) << message;
}

TEST(Scene, RefusesWaterBeyondTheOutlet) {
  const std::string message =
      message_of([] { scene_of(testing::gate_tank(), {"fluid.outlet_x_m=0.05"}); });
  EXPECT_TRUE(contains(message, "(0.1, 0) m of water_m lies beyond the outlet")) << message;
}

TEST(Scene, RefusesANumberOfPointsThatNoMachineHolds) {
  const std::string message =
      message_of([] { scene_of(testing::gate_tank(), {"fluid.spacing_m=1e-9"}); });
  EXPECT_TRUE(contains(message, "1e+08 x 1.4e+08 points")) << message;
}

TEST(Scene, RefusesTwoWallsOfOneName) {
  const std::string message =
      message_of([] { scene_of(replaced(testing::gate_tank(), "\"gate\"", "\"tank\"")); });
  EXPECT_TRUE(contains(message, "two walls are called 'tank'")) << message;
}

TEST(Scene, RefusesAHoleBelowTheWaterLineWithItsPlace) {
  const std::string text =
      replaced(testing::gate_tank(), "[[0, 0.3], [0, 0], [0.8, 0]]", "[[0, 0.3], [0, 0.05]]");
  const std::string message = message_of([&] { scene_of(text); });
  EXPECT_TRUE(contains(message, "hole in the walls")) << message;
  EXPECT_TRUE(contains(message, "0.002")) << message; // the first sample of the open floor
  EXPECT_NO_THROW(scene_of(text, {"fluid.open_sides=true"}));
}

TEST(Scene, RefusesAHoleInASideWall) {
  const std::string text = replaced(testing::gate_tank(), "[[0, 0.3], [0, 0], [0.8, 0]]",
                                    "[[0, 0.3], [0, 0.08]]\n[[fluid.wall]]\nname = \"rest\"\n"
                                    "points_m = [[0, 0.06], [0, 0], [0.8, 0]]");
  const std::string message = message_of([&] { scene_of(text); });
  EXPECT_TRUE(contains(message, "hole in the walls below the water line at (0, 0.0")) << message;
}

TEST(Scene, RefusesAMissingKeyByName) {
  const std::string message =
      message_of([] { scene_of(replaced(testing::gate_tank(), "spacing_m = 0.004", "")); });
  EXPECT_TRUE(contains(message, "spacing_m")) << message;
}

TEST(Scene, RefusesAMisspeltKeyAndNamesTheRightOne) {
  const std::string message = message_of(
      [] { scene_of(replaced(testing::gate_tank(), "spacing_m = 0.004", "spacin_m = 0.004")); });
  EXPECT_TRUE(contains(message, "unknown key 'spacin_m'")) << message;
  EXPECT_TRUE(contains(message, "did you mean 'spacing_m'")) << message;
}

TEST(Scene, RefusesASpacingThatLeavesNoWater) {
  const std::string message =
      message_of([] { scene_of(testing::dam_break, {"fluid.spacing_m=0.09"}); });
  EXPECT_TRUE(contains(message, "smaller spacing_m")) << message;
}

TEST(Scene, RefusesNegativeSpacing) {
  EXPECT_NE(message_of([] { scene_of(testing::dam_break, {"fluid.spacing_m=-0.01"}); }), "");
}

TEST(Scene, RefusesASceneWithoutWalls) {
  const std::string message = message_of([] {
    scene_of("[fluid]\nspacing_m = 0.1\nopen_sides = true\nwater_m = [[0, 0], [1, 0], [1, 1]]\n");
  });
  EXPECT_TRUE(contains(message, "[[fluid.wall]]")) << message;
}

TEST(Scene, RefusesWallPointsThatCoincide) {
  const std::string text = replaced(testing::dam_break, "[0.4, 0], [0.4, 0.4]", "[0, 0], [0.4, 0]");
  const std::string message = message_of([&] { scene_of(text); });
  EXPECT_TRUE(contains(message, "coincide")) << message;
}

TEST(Scene, AcceptsAGateThatOverlapsTheFloorByATenthOfAMillimetre) {
  std::string text = testing::gate_tank();
  text = replaced(text, "[0.112, 0], [0.1, 0], [0.1, 0.079]",
                  "[0.112, -0.0001], [0.1, -0.0001], [0.1, 0.079]");
  EXPECT_EQ(message_of([&] { scene_of(text); }), "");
}

// An L-shaped basin, 1 m wide below and 0.5 m above y = 0.5.
const std::string basin = R"(
[fluid]
spacing_m = 0.1
fill_from_m = [0.7, 0.2]
fill_level_m = 0.8
[[fluid.wall]]
name = "basin"
points_m = [[0.5, 2], [0.5, 0.5], [0, 0.5], [0, 0], [1, 0], [1, 2]]
)";

TEST(Scene, AFloodFillsWhatItReachesBelowItsLevel) {
  const Scene<2> scene = scene_of(basin);
  EXPECT_EQ(scene.initial.points.size(), 10 * 5 + 5 * 3);
  for (int i = 0; i < scene.initial.points.size(); ++i)
    EXPECT_NEAR(scene.initial.points.pressure[i],
                1000 * 9.81 * (0.8 - scene.initial.points.position[i].y()), 1e-9);
}

TEST(Scene, RefusesAFloodThatRunsOutOfTheScene) {
  const std::string message = message_of([] {
    scene_of(replaced(basin, "[0, 0], [1, 0], [1, 2]", "[0, 0], [0.6, 0], [0.6, -2], [2, -2]"));
  });
  EXPECT_TRUE(contains(message, "runs out of the scene")) << message;
}

TEST(Scene, RefusesAFloodFromAboveItsLevel) {
  const std::string message = message_of([] { scene_of(basin, {"fluid.fill_level_m=0.1"}); });
  EXPECT_TRUE(contains(message, "fill_from_m = (0.7, 0.2) m is above fill_level_m = 0.1"))
      << message;
}

TEST(Scene, StartsWithTheVelocityOfItsFormulas) {
  const Scene<2> scene = scene_of(
      basin, {R"~(fluid.start_velocity_m_s=["2*y", "-3*sin(x)"])~", "fluid.start_jitter=0.2"});
  for (int i = 0; i < scene.initial.points.size(); ++i) {
    const Vec<2> &x = scene.initial.points.position[i];
    EXPECT_EQ(scene.initial.points.velocity[i], Vec<2>(2 * x.y(), -3 * std::sin(x.x())));
  }
}

TEST(Scene, JitterKeepsPointsInFrontOfObliqueWalls) {
  const std::string text =
      replaced(basin, "[0.5, 2], [0.5, 0.5], [0, 0.5], [0, 0]", "[-1, 1], [0, 0]");
  const Scene<2> scene = scene_of(
      text, {"fluid.start_jitter=0.25", "fluid.spacing_m=0.02", R"(fluid.wall_clearance=0.01)"});
  EXPECT_GT(scene.initial.points.size(), 1000);
}

TEST(Scene, SaysWhereAFormulaCannotBeRead) {
  const std::string message =
      message_of([] { scene_of(basin, {R"(fluid.start_velocity_m_s=["2*y", "3*speed"])"}); });
  EXPECT_TRUE(contains(message, "start_velocity_m_s")) << message;
  EXPECT_TRUE(contains(message, "\"speed\"")) << message;
}

TEST(Scene, APrescribedWallStartsWhereItsLawSaysAndMovesByIt) {
  Scene<2> scene = scene_of(replaced(basin, "name = \"basin\"", R"~(name = "basin"
displacement_m = ["0.1*cos(2*t)", "0.5*t*y"])~"),
                            {"fluid.fill_from_m=[0.8, 0.2]"});
  EXPECT_EQ(scene.walls.position[4], Vec<2>(1.1, 0));
  move_walls(scene.prescribed, 1.0, 0.01, scene.walls);
  EXPECT_NEAR((scene.walls.position[5] - Vec<2>(1 + 0.1 * std::cos(2.02), 2 + 1.01)).norm(), 0,
              1e-15);
  // the mean over the step: its position is exact at both ends
  EXPECT_NEAR(scene.walls.velocity[5].x(), 10 * (std::cos(2.02) - std::cos(2.0)), 1e-12);
  EXPECT_NEAR(scene.walls.velocity[5].y(), 1, 1e-12);
}

} // namespace
} // namespace sluice::fluid
