// SPDX-License-Identifier: MIT
#include "fluid/wall_loads.hpp"
#include "tests/support/fine_walls.hpp"

#include <gtest/gtest.h>

#include <set>

namespace sluice::fluid {
namespace {

constexpr double weight_density = 9810, depth = 0.14, gate = 0.079;

struct StillWater : FluidSolver<2> {
  explicit StillWater(const std::string &spacing)
      : FluidSolver<2>(
            testing::scene_of(testing::gate_tank(),
                              {"fluid.spacing_m=" + spacing, "fluid.pressure_tolerance=1e-12"})) {
    begin_step(1e-3);
    iterate();
  }
};

class HydrostaticLoad : public ::testing::TestWithParam<std::string> {};

TEST_P(HydrostaticLoad, OnTheGateHasTheExactResultantAndMomentAboutTheClamp) {
  const StillWater solver(GetParam());
  const Resultant<2> load = integrate_resultant(solver.quadrature(), solver.tractions());
  // pressure rho g (H - y) over 0 < y < L; moment about (0.1, L): integral of p (L - y)
  const double force = weight_density * (depth * gate - 0.5 * gate * gate);
  const double moment = weight_density * (0.5 * depth * gate * gate - gate * gate * gate / 6);
  const double at_clamp = load.moment - cross(Vec<2>(0.1, gate), load.force);
  std::printf("%s m: force %.3e, moment %.3e relative error\n", GetParam().c_str(),
              load.force.x() / force - 1, at_clamp / moment - 1);
  EXPECT_NEAR(load.force.x(), force, 1e-6 * force);
  EXPECT_NEAR(load.force.y(), 0, 1e-6 * force);
  EXPECT_NEAR(at_clamp, moment, 1e-6 * moment);
}

TEST_P(HydrostaticLoad, LeavesTheLowerEdgeAndTheDryFaceOfASealedGateDry) {
  const StillWater solver(GetParam());
  EXPECT_GT(solver.quadrature().samples.size(), 30u);
  for (const auto &sample : solver.quadrature().samples)
    EXPECT_NEAR(sample.position.x(), 0.1, 1e-12) << "wet at y = " << sample.position.y();
  for (std::size_t v = 0; v < solver.walls.position.size(); ++v)
    if (solver.walls.position[v].x() > 0.1 + 1e-9) {
      EXPECT_EQ(solver.nodal_forces()[v].norm(), 0);
    }
}

INSTANTIATE_TEST_SUITE_P(Spacings, HydrostaticLoad, ::testing::Values("0.004", "0.002"));

TEST(WallLoads, NodalForcesHaveTheSumAndTheMomentOfTheTractions) {
  StillWater solver("0.004");
  for (const int v : solver.walls.coupled_vertices)
    solver.walls.velocity[v] = {0.1 * solver.walls.position[v].y(), -0.02};
  solver.iterate();
  const Resultant<2> load = integrate_resultant(solver.quadrature(), solver.tractions());
  Vec<2> force(0, 0);
  double moment = 0, size = 0;
  for (std::size_t v = 0; v < solver.walls.position.size(); ++v) {
    const Vec<2> &f = solver.nodal_forces()[v];
    force += f;
    moment += cross(solver.walls.position[v], f);
    size += f.norm();
  }
  EXPECT_GT(std::abs(load.force.y()), 0); // shear acts
  EXPECT_NEAR((force - load.force).norm(), 0, 1e-13 * size);
  EXPECT_NEAR(moment, load.moment, 1e-13 * size);
}

TEST(WallLoads, WeightsOfASampleArePositiveAndSumToOne) {
  const StillWater solver("0.004");
  const WallQuadrature<2> &quadrature = solver.quadrature();
  for (const auto &sample : quadrature.samples) {
    double total = 0;
    for (int c = sample.first; c < sample.first + sample.count; ++c) {
      EXPECT_GE(quadrature.contributions[c].weight, 0);
      total += quadrature.contributions[c].weight;
    }
    EXPECT_NEAR(total, 1, 1e-14);
  }
}

TEST(WallLoads, ASegmentAboveTheWaterCarriesNothing) {
  const StillWater solver("0.004");
  WallQuadrature<2> all;
  build_wall_quadrature(solver.state.points, solver.walls, solver.cloud(), WallPart::all, all);
  double wet_tank = 0;
  for (const auto &sample : all.samples) {
    EXPECT_LT(sample.position.y(), depth + 0.004);
    EXPECT_LT(sample.position.x(), 0.1 + 1e-9);
    wet_tank += sample.position.x() < 1e-12 ? sample.measure : 0.0;
  }
  EXPECT_NEAR(wet_tank, depth, 0.004); // its water line is smeared over a spacing
}

// A tank of segments of a tenth of a spacing.
TEST(WallLoads, OnAFineFloorFewAveragesCarryTheWeightOfTheWater) {
  FluidSolver<2> solver(testing::scene_of(R"(
[fluid]
spacing_m = 0.004
dynamic_viscosity_pa_s = 1e-3
pressure_tolerance = 1e-12
water_m = [[0, 0], [0.1, 0], [0.1, 0.14], [0, 0.14]]
[[fluid.wall]]
name = "tank"
segment_length_m = 4e-4
points_m = [[0, 0.3], [0, 0], [0.1, 0], [0.1, 0.3]]
)"));
  solver.begin_step(1e-3);
  solver.iterate();
  WallQuadrature<2> all;
  std::vector<Vec<2>> traction;
  const Points<2> &points = solver.state.points;
  build_wall_quadrature(points, solver.walls, solver.cloud(), WallPart::all, all);
  evaluate_tractions(points, solver.walls, solver.cloud(), solver.problem(), points.pressure,
                     solver.viscosity(), all, traction);
  Vec<2> on_floor(0, 0);
  std::set<int> averages;
  for (std::size_t k = 0; k < all.samples.size(); ++k)
    if (all.samples[k].normal.y() < -0.9) {
      on_floor += all.samples[k].measure * traction[k];
      averages.insert(all.samples[k].first);
    }
  const double weight = weight_density * depth * 0.1;
  std::printf("%zu averages on 250 segments, relative error %.1e\n", averages.size(),
              on_floor.y() / -weight - 1);
  EXPECT_LT(averages.size(), 60u); // a cube is half a spacing wide
  EXPECT_NEAR(on_floor.y(), -weight, 1e-6 * weight);
  EXPECT_NEAR(on_floor.x(), 0, 1e-6 * weight);
}

// Samples that share an average integrate a linear pressure as every triangle by itself does.
TEST(WallLoads, NarrowFacesOfACurvedSurfaceAreExactForLinearPressure) {
  const double h = 0.1, height = 0.06;
  std::vector<Vec<3>> position = testing::lattice({24, 24, 3}, h, 0.1, 6);
  for (Vec<3> &x : position) {
    x.head<2>().array() -= 1.2;
    x.z() += testing::hill(height, x.x(), x.y()) - 0.2 * h; // everything is wet
  }
  const testing::FrozenCloudIn<3> frozen(position, testing::hills(100, height, 0.1), h);
  WallQuadrature<3> all;
  build_wall_quadrature(frozen.points, frozen.walls, frozen.cloud, WallPart::all, all);
  const Vec<3> gradient(3, -2, 5);
  const auto pressure = [&](const Vec<3> &x) { return 7 + gradient.dot(x); };
  Vec<3> force(0, 0, 0), area(0, 0, 0), expected = force, expected_area = area;
  std::set<int> averages;
  for (const auto &s : all.samples) {
    area += s.measure * s.normal;
    for (int c = s.first; c < s.first + s.count; ++c) {
      const auto &[feeder, weight] = all.contributions[c];
      const Vec<3> &at = frozen.points.position[all.feeders[feeder]];
      const double expansion = pressure(at) + gradient.dot(s.position - at);
      force += s.measure * weight * expansion * s.normal;
    }
    averages.insert(s.first);
  }
  for (const WallFace<3> &f : frozen.walls.faces) {
    const Corners<3> c = frozen.walls.corners(f);
    const Vec<3> part = -face_measure(c) * frozen.walls.normal(f);
    expected_area += part;
    expected += pressure((c[0] + c[1] + c[2]) / 3) * part;
  }
  std::printf("%zu faces, %zu averages\n", frozen.walls.faces.size(), averages.size());
  EXPECT_LT(averages.size(), frozen.walls.faces.size() / 4);
  EXPECT_NEAR((area - expected_area).norm(), 0, 1e-12 * expected_area.norm());
  EXPECT_NEAR((force - expected).norm(), 0, 1e-12 * expected.norm());
}

// A plate that stands a fifth of a spacing in front of a wall keeps the water off it.
TEST(WallLoads, ANarrowFaceBehindAPlateIsDry) {
  const double h = 0.1;
  std::vector<Vec<2>> wall, plate;
  for (int k = 0; k <= 100; ++k) {
    wall.emplace_back(-1 + 0.02 * k, 0);
    plate.emplace_back(-0.7 + 0.014 * k, 0.02);
  }
  Walls<2> walls;
  testing::add_polyline(walls, plate);
  testing::add_polyline(walls, wall);
  for (WallFace<2> &f : walls.faces)
    f.wall = 0; // of one surface
  link_faces(walls);
  std::vector<Vec<2>> position = testing::lattice(20, 4, h, 0.2, 6);
  for (Vec<2> &x : position)
    x += Vec<2>(-1, 0.05);
  const testing::FrozenCloud frozen(position, walls, h);
  WallQuadrature<2> all;
  build_wall_quadrature(frozen.points, frozen.walls, frozen.cloud, WallPart::all, all);
  int beside = 0;
  for (const auto &s : all.samples)
    if (s.position.y() < 0.01) {
      EXPECT_GT(std::abs(s.position.x()), 0.6) << "wet below the plate";
      ++beside;
    }
  EXPECT_GT(beside, 0);
}

} // namespace
} // namespace sluice::fluid
