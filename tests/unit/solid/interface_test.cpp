// SPDX-License-Identifier: MIT
#include "gate.hpp"

#include "solid-dealii/interface.hpp"

#include <Eigen/Geometry>
#include <gtest/gtest.h>

#include <set>

namespace sluice::solid {
namespace {

Vec<2> at(const bridge::InterfaceMesh &mesh, int node) {
  return {mesh.positions[static_cast<std::size_t>(2 * node)],
          mesh.positions[static_cast<std::size_t>(2 * node + 1)]};
}

// Wetted are front, lower edge and back: 79 + 5 + 79 mm, and every segment has the fluid on its
// left.
TEST(Interface, gate_is_wetted_on_all_sides_but_the_clamped_one) {
  for (const auto *element : {"incompatible-modes", "q2"}) {
    auto params = gate_params();
    params.element = element;
    const SolidSolver<2> solver(params);
    const auto surface = wetted_interface(solver.discretisation(), Side::upper);
    bridge::check_mesh(surface.mesh, "solid");
    double length = 0;
    for (std::size_t f = 0; f < surface.mesh.n_faces(); ++f) {
      const Vec<2> a = at(surface.mesh, surface.mesh.faces[2 * f]);
      const Vec<2> b = at(surface.mesh, surface.mesh.faces[2 * f + 1]);
      length += (b - a).norm();
      const Vec<2> outward = 0.5 * (a + b) - Vec<2>(0.1025, 0.001);
      EXPECT_GT(rotated_left(b - a).dot(outward), 0);
    }
    EXPECT_NEAR(length, 0.163, 1e-15);
    EXPECT_EQ(surface.mesh.n_nodes(), surface.mesh.n_faces() + 1) << "one open line";
  }
}

TEST(Interface, nodes_are_numbered_along_the_line) {
  const SolidSolver<2> solver(gate_params());
  const auto surface = wetted_interface(solver.discretisation(), Side::upper);
  for (std::size_t f = 0; f < surface.mesh.n_faces(); ++f) {
    EXPECT_EQ(surface.mesh.faces[2 * f], static_cast<int>(f));
    EXPECT_EQ(surface.mesh.faces[2 * f + 1], static_cast<int>(f) + 1);
  }
}

TEST(Interface, quadrilaterals_of_the_column_look_outwards_and_cover_it) {
  for (const auto *element : {"incompatible-modes", "q2"}) {
    auto params = gate_params();
    params.dimension = 3;
    params.elements_along = 4;
    params.elements_deep = 2;
    params.depth = 0.01;
    params.element = element;
    const SolidSolver<3> solver(params);
    const auto surface = wetted_interface(solver.discretisation(), Side::upper);
    bridge::check_mesh(surface.mesh, "solid");
    double area = 0;
    for (std::size_t f = 0; f < surface.mesh.n_faces(); ++f) {
      Vec<3> x[4];
      for (std::size_t k = 0; k < 4; ++k)
        for (int c = 0; c < 3; ++c)
          x[k][c] = surface.mesh.position(
              static_cast<std::size_t>(surface.mesh.faces[4 * f + k]))[static_cast<std::size_t>(c)];
      const Vec<3> normal = 0.5 * (x[2] - x[0]).cross(x[3] - x[1]);
      area += normal.norm();
      EXPECT_GT(normal.dot(x[0] + x[2] - 2 * Vec<3>(0.1025, 0.001, 0.005)), 0);
    }
    EXPECT_NEAR(area, 0.163 * 0.01, 1e-15);
  }
}

TEST(Interface, gather_is_the_transpose_of_scatter) {
  const SolidSolver<2> solver(gate_params());
  const auto surface = wetted_interface(solver.discretisation(), Side::upper);
  const int n = solver.discretisation().n_dofs();
  std::vector<double> forces(2 * surface.nodes.size());
  for (std::size_t k = 0; k < forces.size(); ++k)
    forces[k] = std::sin(1.0 + static_cast<double>(k));
  const Eigen::VectorXd field =
      Eigen::VectorXd::NullaryExpr(n, [](Eigen::Index k) { return std::cos(double(k)); });
  const auto gathered = surface.gather(field);
  double on_interface = 0;
  for (std::size_t k = 0; k < forces.size(); ++k)
    on_interface += forces[k] * gathered[k];
  EXPECT_NEAR(surface.scatter(forces, n).dot(field), on_interface, 1e-13);
  EXPECT_THROW(surface.scatter(std::vector<double>(3), n), UserError);
}

TEST(FreeEnd, middle_lies_half_way_between_the_corners) {
  for (const int across : {1, 2, 3}) {
    auto params = gate_params();
    params.elements_across = across;
    const SolidSolver<2> solver(params);
    const auto &d = solver.discretisation();
    const auto end = free_end(d, Side::upper);
    Eigen::VectorXd positions(d.n_dofs());
    for (int a = 0; a < d.n_nodes(); ++a)
      positions.segment<2>(2 * a) = d.nodes[static_cast<std::size_t>(a)];
    EXPECT_LT((end.middle(positions) - Vec<2>(0.1025, 0)).norm(), 1e-16);
    EXPECT_LT((end.at(positions, end.front) - Vec<2>(0.1, 0)).norm(), 1e-16);
    EXPECT_LT((end.at(positions, end.back) - Vec<2>(0.105, 0)).norm(), 1e-16);
  }
}

// Still water on the front: rho g (H y - y^2/2) from 0 to L, and its moment about the origin.
TEST(Loads, resultant_and_moment_of_the_hydrostatic_load_are_the_integrals) {
  for (const auto *element : {"incompatible-modes", "q2"}) {
    auto params = gate_params();
    params.element = element;
    const SolidSolver<2> solver(params);
    const Eigen::VectorXd zero = solver.initial_state().displacement;
    const auto sums = sum_loads(solver.discretisation(), dead_load(solver), zero, zero);
    const double g = 9810, H = 0.14, L = 0.079;
    EXPECT_NEAR(sums.force.x(), g * (H * L - L * L / 2), 1e-11);
    EXPECT_NEAR(sums.force.y(), 0, 1e-13);
    EXPECT_NEAR(sums.moment.z(), -g * (H * L * L / 2 - L * L * L / 3), 1e-12);
    EXPECT_EQ(sums.work, 0);
  }
}

// A pressure that is the same everywhere has no resultant on a closed surface, however deformed.
TEST(Loads, follower_pressure_round_the_whole_body_has_no_resultant) {
  const SolidSolver<2> solver(gate_params());
  const auto &d = solver.discretisation();
  const Eigen::VectorXd u = Eigen::VectorXd::NullaryExpr(
      d.n_dofs(), [](Eigen::Index k) { return 5e-4 * std::sin(3.7 * double(k)); });
  // A level far above makes the pressure uniform to 1e-10: 1e9 m against 0.08 m.
  const Hydrostatic uniform{1, 1e-9, 1e9};
  Vec<2> resultant = Vec<2>::Zero();
  double magnitude = 0;
  for (const Side side : {Side::left, Side::right, Side::lower, Side::upper}) {
    const Eigen::VectorXd f = pressure_forces(d, side, uniform, u);
    for (int a = 0; a < d.n_nodes(); ++a)
      resultant += f.segment<2>(2 * a);
    magnitude += f.cwiseAbs().sum();
  }
  EXPECT_LT(resultant.norm(), 1e-9 * magnitude);
}

TEST(Loads, sums_take_the_end_position_for_the_moment_and_the_increment_for_the_work) {
  const SolidSolver<2> solver(gate_params());
  const auto &d = solver.discretisation();
  Eigen::VectorXd load = Eigen::VectorXd::Zero(d.n_dofs()), start = load, end = load;
  const int node = free_end(d, Side::upper).front; // at (0.1, 0)
  load.segment<2>(2 * node) << 3, 4;
  start.segment<2>(2 * node) << 0.01, 0.02;
  end.segment<2>(2 * node) << 0.02, 0.05;
  const auto sums = sum_loads(d, load, start, end);
  EXPECT_NEAR(sums.moment.z(), 0.12 * 4 - 0.05 * 3, 1e-15);
  EXPECT_NEAR(sums.work, 3 * 0.01 + 4 * 0.03, 1e-15);
  EXPECT_NEAR(sums.force_magnitude, 5, 1e-15);
  EXPECT_NEAR(sums.moment_magnitude, 5 * std::hypot(0.12, 0.05), 1e-15);
}

} // namespace
} // namespace sluice::solid
