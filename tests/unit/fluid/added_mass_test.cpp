// SPDX-License-Identifier: MIT
// The added mass that the water puts on the gate must be positive however far the gate has opened:
// a single pressure row with weights of the wrong sign next to the gap makes it negative, and then
// no coupling scheme converges. Formed column by column from the loads of a frozen cloud.
#include "tests/support/fluid_cases.hpp"

#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>

namespace sluice::fluid {
namespace {

constexpr double spacing = 0.004, length = 0.079, half_thickness = 0.006, clamp_x = 0.106;

// The gate bent to a circular arc of the given curvature [1/m]: x of the plate's left face, height
// of its lower edge. `s` runs down from the clamp, `offset` from the centre line to the right.
Vec<2> bent(double s, double offset, double curvature) {
  const double angle = curvature * s;
  const Vec<2> centre =
      curvature < 1e-9 ? Vec<2>(0, -s)
                       : Vec<2>((1 - std::cos(angle)) / curvature, -std::sin(angle) / curvature);
  return Vec<2>(clamp_x, length) + centre + offset * Vec<2>(std::cos(angle), std::sin(angle));
}

double gap_of(double curvature) {
  return std::min(bent(length, -half_thickness, curvature).y(),
                  bent(length, half_thickness, curvature).y());
}

double curvature_for(double gap) {
  double low = 0, high = 20;
  for (int k = 0; k < 60; ++k) {
    const double middle = 0.5 * (low + high);
    (gap_of(middle) < gap ? low : high) = middle;
  }
  return low;
}

// The tank with the gate open by `gap` and water up to its face and under its lower edge.
Scene<2> opened_tank(double gap, unsigned seed) {
  Scene<2> scene =
      testing::scene_of(testing::gate_tank(2 * half_thickness), {"fluid.pressure_tolerance=1e-12"});
  const double curvature = curvature_for(gap);
  for (const int v : scene.walls.coupled_vertices) {
    const Vec<2> x = scene.walls.position[v];
    scene.walls.position[v] = bent(length - x.y(), x.x() - clamp_x, curvature);
  }
  std::vector<Vec<2>> water;
  const auto all = testing::every_face(scene.walls);
  for (const Vec<2> &x : testing::lattice(50, 35, spacing, seed == 0 ? 0 : 0.15, seed)) {
    if (x.y() > length ? x.x() > 0.1 : x.x() > bent(length, 0, curvature).x())
      continue;
    const PointWalls<2> near = project_on_walls(scene.walls, all, x, 2 * half_thickness);
    bool is_clear = true;
    for (const Projection<2> &p : near)
      is_clear = is_clear && p.distance > 0.2 * spacing;
    // the gate's own inside: not in sight of the middle of the tank at the same height
    if (is_clear && !is_hidden(scene.walls, all, x, Vec<2>(0.5 * spacing, x.y())))
      water.push_back(x);
  }
  scene.initial.points = testing::points_at(water);
  return scene;
}

/// M_a of force = -M_a dv/dt on the coupled vertices, x and y of each.
Eigen::MatrixXd added_mass(FluidSolver<2> &solver) {
  constexpr double dt = 1e-3, speed = 1e-2;
  solver.begin_step(dt);
  const auto &nodes = solver.walls.coupled_vertices;
  const int n = 2 * static_cast<int>(nodes.size());
  solver.iterate();
  const std::vector<Vec<2>> at_rest = solver.nodal_forces();
  Eigen::MatrixXd mass(n, n);
  for (int c = 0; c < n; ++c) {
    Vec<2> &v = solver.walls.velocity[nodes[c / 2]];
    v[c % 2] = speed;
    solver.iterate();
    v.setZero();
    for (int r = 0; r < n; ++r)
      mass(r, c) =
          -(solver.nodal_forces()[nodes[r / 2]] - at_rest[nodes[r / 2]])[r % 2] * dt / speed;
  }
  return mass;
}

class AddedMass : public ::testing::TestWithParam<double> {};

TEST_P(AddedMass, OfTheWaterOnTheGateIsPositiveAtThisOpening) {
  for (const unsigned seed : {0u, 1u, 2u}) { // lattice, and two jittered clouds
    FluidSolver<2> solver(opened_tank(GetParam() * spacing, seed));
    const Eigen::MatrixXd mass = added_mass(solver);
    const Eigen::VectorXcd eigen = mass.eigenvalues();
    const double largest = eigen.real().maxCoeff(), smallest = eigen.real().minCoeff();
    const Eigen::VectorXd ones = Eigen::VectorXd::Constant(mass.rows(), 1)
                                     .cwiseProduct(Eigen::VectorXd::NullaryExpr(
                                         mass.rows(), [](Eigen::Index k) { return k % 2 == 0; }));
    const double rigid = ones.dot(mass * ones);
    std::printf("gap %.1f spacings, cloud %u: %d points, eigenvalues %.3e to %.3e kg/m, largest "
                "imaginary part %.1e, rigid %.2f kg/m, rows guarded %d\n",
                GetParam(), seed, solver.state.points.size(), smallest, largest,
                eigen.imag().cwiseAbs().maxCoeff(), rigid,
                solver.report().rows.guarded());
    EXPECT_GT(largest, 0);
    EXPECT_GE(smallest, -0.05 * largest);
    // Between a tenth of the water behind the gate and all of it that is in the tank (11 to 15 kg).
    EXPECT_GT(rigid, 0.1 * 1000 * 0.1 * length);
    EXPECT_LT(rigid, 15);
  }
}

INSTANTIATE_TEST_SUITE_P(Openings, AddedMass, ::testing::Values(0.0, 0.5, 1.0, 1.5));

} // namespace
} // namespace sluice::fluid
