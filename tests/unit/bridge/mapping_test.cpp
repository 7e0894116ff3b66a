// SPDX-License-Identifier: MIT
#include "bridge/face_tree.hpp"
#include "bridge/mapping_projection.hpp"
#include "bridge/participant.hpp"
#include "bridge/projection.hpp"

#include "support.hpp"

#include <cmath>

namespace sluice::bridge {
namespace {

// A gate: down the wet face, along the lower edge, up the dry one.
InterfaceMesh gate(int along, int across, double unevenness) {
  const Vec<2> a(0.1, 0.079), b(0.1, 0), c(0.105, 0), d(0.105, 0.079);
  auto points = uneven_line(a, b, along, unevenness);
  const auto edge = uneven_line(b, c, across, unevenness),
             dry = uneven_line(c, d, along, unevenness);
  points.insert(points.end(), edge.begin() + 1, edge.end());
  points.insert(points.end(), dry.begin() + 1, dry.end());
  return polyline(points);
}

// A flat plate of n x m cells over [0,1] x [0,2], z = slope x, as quadrilaterals or triangles.
InterfaceMesh plate(int n, int m, int nodes_per_face, double slope) {
  InterfaceMesh mesh{3, nodes_per_face, {}, {}};
  for (int j = 0; j <= m; ++j)
    for (int i = 0; i <= n; ++i) {
      const double x = std::pow(static_cast<double>(i) / n, 1.3), y = 2.0 * j / m;
      mesh.positions.insert(mesh.positions.end(), {x, y, slope * x});
    }
  for (int j = 0; j < m; ++j)
    for (int i = 0; i < n; ++i) {
      const int a = j * (n + 1) + i, b = a + 1, c = b + n + 1, d = c - 1;
      const std::vector<int> quad{a, b, c, d}, triangles{a, b, c, a, c, d};
      const auto &cell = nodes_per_face == 4 ? quad : triangles;
      mesh.faces.insert(mesh.faces.end(), cell.begin(), cell.end());
    }
  return mesh;
}

std::vector<double> sum_of(const std::vector<double> &x, const std::vector<double> &y) {
  std::vector<double> sum(x);
  for (std::size_t k = 0; k < x.size(); ++k)
    sum[k] += y[k];
  return sum;
}

// Fluid and solid totals for random forces and a large random motion of the solid.
struct BothTotals {
  InterfaceTotals fluid, solid;
};
BothTotals totals_of(const InterfaceMesh &fluid, const InterfaceMesh &solid) {
  const Mapping map = projection_map(fluid, solid);
  const auto force = random_values(fluid.positions.size(), 1);
  const auto motion = random_values(solid.positions.size(), 2, 0.05);
  const auto increment = random_values(solid.positions.size(), 3, 0.001);
  const auto end = sum_of(motion, increment);
  return {interface_totals(fluid.dim, fluid.positions, force, map.consistent(motion),
                           map.consistent(end)),
          interface_totals(solid.dim, solid.positions, map.conservative(force), motion, end)};
}

void expect_balance(const BothTotals &both) {
  const auto &[fluid, solid] = both;
  for (std::size_t d = 0; d < 3; ++d) {
    EXPECT_NEAR(fluid.force[d], solid.force[d], 1e-14 * fluid.force_magnitude);
    EXPECT_NEAR(fluid.moment[d], solid.moment[d], 1e-14 * fluid.moment_magnitude);
  }
  EXPECT_NEAR(fluid.work, solid.work, 1e-14 * fluid.work_magnitude);
  EXPECT_GT(std::abs(fluid.work), 1e-6 * fluid.work_magnitude) << "nothing was compared";
}

TEST(ProjectionMap, force_moment_and_work_balance_on_non_matching_lines) {
  expect_balance(totals_of(gate(57, 4, 0.4), gate(28, 1, 0)));
  expect_balance(totals_of(gate(13, 1, -0.3), gate(28, 2, 0.2)));
}

TEST(ProjectionMap, force_moment_and_work_balance_on_non_matching_plates) {
  expect_balance(totals_of(plate(7, 9, 4, 0.3), plate(4, 5, 4, 0.3)));
  expect_balance(totals_of(plate(7, 9, 3, 0.3), plate(4, 5, 3, 0.3)));
  expect_balance(totals_of(plate(3, 4, 3, 0.3), plate(5, 6, 4, 0.3)));
}

TEST(ProjectionMap, is_exact_for_linear_fields) {
  for (const int nodes : {3, 4}) {
    const InterfaceMesh fluid = plate(7, 9, nodes, 0.3), solid = plate(4, 5, nodes, 0.3);
    const Mapping map = projection_map(fluid, solid);
    const auto moved = map.consistent(solid.positions); // the field x, y, z
    for (std::size_t k = 0; k < moved.size(); ++k)
      EXPECT_NEAR(moved[k], fluid.positions[k], 4e-15);
  }
}

TEST(ProjectionMap, conservative_is_the_transpose_of_consistent) {
  const Mapping map = projection_map(gate(13, 2, 0.2), gate(28, 1, 0));
  const Eigen::MatrixXd h = map.matrix();
  for (Eigen::Index column = 0; column < h.cols(); ++column) {
    std::vector<double> unit(static_cast<std::size_t>(2 * h.cols()), 0.0);
    unit[static_cast<std::size_t>(2 * column + 1)] = 1;
    const auto y = map.consistent(unit);
    for (Eigen::Index row = 0; row < h.rows(); ++row) {
      EXPECT_EQ(y[static_cast<std::size_t>(2 * row + 1)], h(row, column));
      EXPECT_EQ(y[static_cast<std::size_t>(2 * row)], 0);
    }
  }
  for (Eigen::Index row = 0; row < h.rows(); ++row) {
    std::vector<double> unit(static_cast<std::size_t>(2 * h.rows()), 0.0);
    unit[static_cast<std::size_t>(2 * row)] = 1;
    const auto x = map.conservative(unit);
    for (Eigen::Index column = 0; column < h.cols(); ++column)
      EXPECT_EQ(x[static_cast<std::size_t>(2 * column)], h(row, column));
  }
}

TEST(ProjectionMap, a_matching_mesh_gives_the_identity) {
  const InterfaceMesh mesh = gate(28, 1, 0);
  const Mapping map = projection_map(mesh, mesh);
  EXPECT_EQ(map.matrix().nonZeros(), map.matrix().rows());
  EXPECT_EQ(map.consistent(mesh.positions), mesh.positions);
  EXPECT_EQ(map.report().coverage(), 1);
}

TEST(ProjectionMap, reports_coverage_distance_and_row_sums) {
  const InterfaceMesh solid = polyline(uneven_line({0, 0}, {1, 0}, 10, 0));
  const InterfaceMesh fluid = polyline({{0.05, 0.001}, {0.3, 0.002}, {0.52, 0}});
  const MapReport report = projection_map(fluid, solid).report();
  EXPECT_EQ(report.solid_nodes_reached, 5u); // two of one segment, node 3, two of another
  EXPECT_NEAR(report.coverage(), 5.0 / 11, 1e-15);
  EXPECT_NEAR(report.largest_distance, 0.002, 1e-15);
  EXPECT_EQ(report.farthest_node, 1u);
  EXPECT_LE(report.row_sum_error, 1e-15);
  EXPECT_TRUE(contains(report.text(), "45.5 %")) << report.text();
}

TEST(ProjectionMap, counts_nodes_beyond_the_rim) {
  const InterfaceMesh solid = polyline(uneven_line({0, 0}, {1, 0}, 5, 0));
  const InterfaceMesh fluid = polyline({{-0.01, 0}, {0.5, 0}, {1, 0}});
  EXPECT_EQ(projection_map(fluid, solid).report().fluid_nodes_beyond, 1u);
}

TEST(ProjectionMap, refuses_an_absurd_gap_with_numbers) {
  const InterfaceMesh solid = polyline(uneven_line({0, 0}, {1, 0}, 10, 0));
  const InterfaceMesh fluid = polyline({{0.05, 0}, {0.3, 0.03}});
  const auto error = error_of([&] { projection_map(fluid, solid); });
  EXPECT_TRUE(contains(error, "fluid node 1 at (0.3, 0.03, 0)")) << error;
  EXPECT_TRUE(contains(error, "0.03 m from") && contains(error, "at most 0.025 m")) << error;
}

TEST(ProjectionMap, refuses_meshes_of_different_dimension) {
  const auto error = error_of([&] { projection_map(gate(4, 1, 0), plate(2, 2, 4, 0)); });
  EXPECT_TRUE(contains(error, "2-dimensional") && contains(error, "3-dimensional")) << error;
}

TEST(FaceTree, agrees_with_the_search_over_all_faces) {
  const InterfaceMesh solid = gate(40, 3, 0.3);
  const FaceTree tree(solid);
  const auto noise = random_values(2000, 7, 0.1);
  for (std::size_t k = 0; k < noise.size(); k += 2) {
    const Vec<2> p(0.1 + noise[k], noise[k + 1]);
    double nearest = 1e9;
    for (std::size_t f = 0; f < solid.n_faces(); ++f) {
      const auto a = solid.position(f), b = solid.position(f + 1);
      nearest =
          std::min(nearest, project_on_segment<2>(p, {a[0], a[1]}, {b[0], b[1]}).distance_squared);
    }
    EXPECT_NEAR(tree.nearest({p.x(), p.y(), 0}).projection.distance_squared, nearest, 1e-17);
  }
}

TEST(Projection, finds_the_nearest_point_of_a_warped_quadrilateral) {
  const std::array<Vec<3>, 4> x{Vec<3>(0, 0, 0), {1, 0, 0.2}, {1.1, 1, 0}, {0, 0.9, 0.3}};
  const auto noise = random_values(300, 5);
  for (std::size_t k = 0; k < 300; k += 3) {
    const Vec<3> p(0.5 + 0.8 * noise[k], 0.5 + 0.8 * noise[k + 1], 0.3 * noise[k + 2]);
    const Projection found = project_on_quadrilateral(p, x);
    double nearest = 1e9;
    for (int i = 0; i <= 200; ++i)
      for (int j = 0; j <= 200; ++j) {
        const double r = i / 200.0, s = j / 200.0;
        const Vec<3> q =
            (1 - r) * (1 - s) * x[0] + r * (1 - s) * x[1] + r * s * x[2] + (1 - r) * s * x[3];
        nearest = std::min(nearest, (p - q).squaredNorm());
      }
    EXPECT_LE(found.distance_squared, nearest + 1e-12);
    EXPECT_NEAR(found.weights[0] + found.weights[1] + found.weights[2] + found.weights[3], 1,
                1e-15);
  }
}

// The distance of the face from the origin must not decide whether a point is found on it. The
// point stands on the normal at (r, s), where neither gap nor residual round to zero by luck.
TEST(Projection, finds_the_point_of_a_small_quadrilateral_far_from_the_origin) {
  const double size = 2.8e-3, height = 0.2 * size; // [m]
  const auto places = random_values(40, 11, 0.45);
  for (const double offset : {0.0, 1.0, 10.0})
    for (std::size_t k = 0; k < places.size(); k += 2) {
      const double r = 0.5 + places[k], s = 0.5 + places[k + 1];
      const Vec<3> o(offset, offset, offset);
      const std::array<Vec<3>, 4> x{o, o + size * Vec<3>(1, 0, 0.1), o + size * Vec<3>(1.1, 1, 0.2),
                                    o + size * Vec<3>(0, 0.9, 0.1)};
      const std::array<double, 4> weights{(1 - r) * (1 - s), r * (1 - s), r * s, (1 - r) * s};
      const Vec<3> along_r = (1 - s) * (x[1] - x[0]) + s * (x[2] - x[3]);
      const Vec<3> along_s = (1 - r) * (x[3] - x[0]) + r * (x[2] - x[1]);
      Vec<3> p = height * along_r.cross(along_s).normalized();
      for (std::size_t a = 0; a < 4; ++a)
        p += weights[a] * x[a];
      // Some ten sums of numbers as large as the offset, seen from a face of that size.
      const double rounding = 16 * 1e-16 * (1 + offset / size);
      const Projection found = project_on_quadrilateral(p, x);
      for (std::size_t a = 0; a < 4; ++a)
        EXPECT_NEAR(found.weights[a], weights[a], rounding) << "at " << offset << " m";
      EXPECT_NEAR(std::sqrt(found.distance_squared), height, rounding * size);
    }
}

TEST(InterfaceMesh, an_unusable_mesh_is_refused_with_the_place) {
  InterfaceMesh mesh = gate(4, 1, 0);
  mesh.faces[3] = 99;
  EXPECT_TRUE(contains(error_of([&] { check_mesh(mesh, "fluid"); }), "face 1 of the fluid's"));
  mesh.faces[3] = mesh.faces[2];
  EXPECT_TRUE(contains(error_of([&] { check_mesh(mesh, "fluid"); }), "no length"));
  mesh = gate(4, 1, 0);
  mesh.positions[5] = std::nan("");
  EXPECT_TRUE(contains(error_of([&] { check_mesh(mesh, "solid"); }), "node 2 of the solid's"));
  EXPECT_TRUE(contains(error_of([&] { check_mesh({}, "solid"); }), "0 coordinates"));
}

} // namespace
} // namespace sluice::bridge
