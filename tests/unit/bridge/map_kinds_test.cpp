// SPDX-License-Identifier: MIT
// What every kind of map promises, on flat and curved, closed and open surfaces that do not match.
#include "bridge/linear_reproduction.hpp"
#include "bridge/mapping.hpp"
#include "bridge/node_tree.hpp"
#include "bridge/overlap.hpp"
#include "bridge/participant.hpp"
#include "tests/support/mapping_case.hpp"

#include "support.hpp"

#include <Eigen/Geometry>

#include <cmath>

namespace sluice::bridge {
namespace {

using benchmark::Surface;

struct Pair {
  std::string name;
  InterfaceMesh fluid, solid;
};

Pair spheres(int n) {
  return {"sphere", benchmark::geodesic_sphere(n), benchmark::cubed_sphere(n + n / 3)};
}
Pair plates(int n) {
  std::uint64_t state = benchmark::first_state;
  return {"plate", benchmark::jittered_plate(n + 1, state), benchmark::regular_plate(n)};
}

// The unit square in the plane z = 0.3 x, n x m cells of unequal width.
InterfaceMesh flat(int n, int m, int nodes_per_face, double power) {
  InterfaceMesh mesh{3, nodes_per_face, {}, {}};
  for (int j = 0; j <= m; ++j)
    for (int i = 0; i <= n; ++i) {
      const double x = std::pow(static_cast<double>(i) / n, power), y = static_cast<double>(j) / m;
      mesh.positions.insert(mesh.positions.end(), {x, y, 0.3 * x});
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

// Half a circle of radius one as a polyline.
InterfaceMesh arc(int n, double unevenness) {
  std::vector<Vec<2>> points;
  for (const Vec<2> &s : uneven_line({0, 0}, {M_PI, 0}, n, unevenness))
    points.emplace_back(std::cos(s.x()), std::sin(s.x()));
  return polyline(points);
}

std::vector<Pair> all_pairs() {
  return {spheres(6),
          plates(12),
          {"flat, triangles on quadrilaterals", flat(7, 5, 3, 1.3), flat(5, 6, 4, 1)},
          {"flat, quadrilaterals on triangles", flat(4, 6, 4, 0.8), flat(6, 5, 3, 1.2)},
          {"arc", arc(23, 0.3), arc(14, -0.2)}};
}

class EveryKind : public testing::TestWithParam<MapKind> {};
class EveryKindForForces : public testing::TestWithParam<MapKind> {};

INSTANTIATE_TEST_SUITE_P(Maps, EveryKind,
                         testing::Values(MapKind::nearest, MapKind::projection, MapKind::mortar,
                                         MapKind::rbf));
INSTANTIATE_TEST_SUITE_P(Maps, EveryKindForForces,
                         testing::Values(MapKind::projection, MapKind::mortar, MapKind::rbf));

// Totals of random forces for a large random motion of the solid, from both ends.
struct BothTotals {
  InterfaceTotals fluid, solid;
};
BothTotals totals_of(const Mapping &map, const Pair &pair) {
  const auto force = random_values(pair.fluid.positions.size(), 1);
  const auto start = random_values(pair.solid.positions.size(), 2, 0.1);
  const auto end = random_values(pair.solid.positions.size(), 3, 0.1);
  return {
      interface_totals(pair.fluid.dim, pair.fluid.positions, force, map.consistent(start),
                       map.consistent(end)),
      interface_totals(pair.solid.dim, pair.solid.positions, map.conservative(force), start, end)};
}

// Rounding: some hundred terms per row, each with an error of 1e-16.
constexpr double rounding = 1e-13;

TEST_P(EveryKind, keeps_force_and_work) {
  for (const Pair &pair : all_pairs()) {
    const Mapping map = make_mapping(GetParam(), pair.fluid, pair.solid);
    const auto [fluid, solid] = totals_of(map, pair);
    for (std::size_t d = 0; d < 3; ++d)
      EXPECT_NEAR(fluid.force[d], solid.force[d], rounding * fluid.force_magnitude) << pair.name;
    EXPECT_NEAR(fluid.work, solid.work, rounding * fluid.work_magnitude) << pair.name;
    EXPECT_GT(std::abs(fluid.work), 1e-4 * fluid.work_magnitude) << "nothing was compared";
    EXPECT_LE(map.report().row_sum_error, rounding) << pair.name;
  }
}

TEST_P(EveryKindForForces, keeps_the_moment_in_the_moved_configuration) {
  for (const Pair &pair : all_pairs()) {
    const Mapping map = make_mapping(GetParam(), pair.fluid, pair.solid);
    const auto [fluid, solid] = totals_of(map, pair);
    for (std::size_t d = 0; d < 3; ++d)
      EXPECT_NEAR(fluid.moment[d], solid.moment[d], rounding * fluid.moment_magnitude) << pair.name;
    EXPECT_LE(map.report().largest_offset, rounding) << pair.name;
  }
}

TEST(NearestMap, says_how_far_it_is_from_keeping_moments) {
  const Pair pair = plates(12);
  const Mapping map = make_mapping(MapKind::nearest, pair.fluid, pair.solid);
  const auto [fluid, solid] = totals_of(map, pair);
  const double error = std::abs(fluid.moment[0] - solid.moment[0]);
  EXPECT_GT(error, 1e-3 * fluid.moment_magnitude);
  EXPECT_LE(error, map.report().largest_offset * fluid.force_magnitude);
}

// The observed order of the l2 error, from 1,002 to 9,002 vertices on the sphere.
TEST_P(EveryKindForForces, is_of_second_order) {
  const auto error_at = [&](int n) {
    const Pair pair = spheres(n);
    const Mapping map = make_mapping(GetParam(), pair.fluid, pair.solid);
    return benchmark::error(map.consistent(benchmark::scalars(Surface::sphere, pair.solid)),
                            benchmark::scalars(Surface::sphere, pair.fluid))
        .l2;
  };
  const double coarse = error_at(10), fine = error_at(30);
  const double order = std::log(coarse / fine) / std::log(3.0);
  fmt::print("  l2 error {:.2e} -> {:.2e}, order {:.2f}\n", coarse, fine, order);
  EXPECT_GE(order, 1.8);
}

TEST(MortarMap, gives_smooth_tractions_on_equally_fine_meshes) {
  for (const auto &[surface, pair] :
       {std::pair(Surface::sphere,
                  Pair{"sphere", benchmark::geodesic_sphere(10), benchmark::cubed_sphere(13)}),
        std::pair(Surface::plate, plates(32))}) {
    const Mapping map = make_mapping(MapKind::mortar, pair.fluid, pair.solid);
    const auto forces = benchmark::nodal_forces(surface, pair.fluid);
    const auto error =
        benchmark::force_error(surface, pair.fluid, forces, pair.solid, map.conservative(forces));
    fmt::print("  {}: traction error {:.2f} %\n", pair.name, 100 * error.traction_l2);
    EXPECT_LE(error.traction_l2, 0.03) << pair.name; // the promise
    EXPECT_EQ(error.empty, 0) << pair.name;
  }
}

// Flat surfaces with an edge all round: the dual functions sum to one.
TEST(MortarMap, keeps_a_constant_traction_constant_up_to_open_edges) {
  for (const Pair &pair : {Pair{"triangles", flat(9, 7, 3, 1.3), flat(8, 8, 3, 1)},
                           Pair{"quadrilaterals", flat(9, 7, 4, 1.3), flat(8, 8, 4, 1)},
                           Pair{"lines", polyline(uneven_line({0, 0}, {1, 2}, 7, 0.3)),
                                polyline(uneven_line({0, 0}, {1, 2}, 6, -0.2))}}) {
    const Mapping map = make_mapping(MapKind::mortar, pair.fluid, pair.solid);
    for (const double t : map.traction(std::vector<double>(pair.fluid.positions.size(), 2.5)))
      EXPECT_NEAR(t, 2.5, 1e-12) << pair.name;
  }
}

TEST(MortarMap, a_surface_that_hangs_over_the_rim_stays_exact_for_linear_fields_and_is_reported) {
  InterfaceMesh fluid = flat(9, 7, 3, 1);
  for (std::size_t k = 0; k < fluid.positions.size(); k += 3) {
    fluid.positions[k] += 0.03;
    fluid.positions[k + 2] += 0.009;
  }
  const InterfaceMesh solid = flat(6, 5, 4, 1);
  const Mapping map = make_mapping(MapKind::mortar, fluid, solid);
  EXPECT_NEAR(map.report().area_covered, 0.97, 1e-12);
  EXPECT_LE(map.report().row_sum_error, rounding);
  EXPECT_LE(map.report().largest_offset, rounding);
  EXPECT_EQ(map.report().fluid_nodes_beyond, 8u);
}

TEST(ProjectionMap, a_gap_over_a_flat_surface_stays_and_is_reported) {
  InterfaceMesh fluid = polyline(uneven_line({0, 0.01}, {1, 0.01}, 7, 0.2));
  const Mapping map =
      make_mapping(MapKind::projection, fluid, polyline(uneven_line({0, 0}, {1, 0}, 5, 0)));
  EXPECT_NEAR(map.report().largest_offset, 0.01, 1e-15);
  EXPECT_LE(map.matrix().nonZeros(), 2 * map.matrix().rows()) << "no row was widened in vain";
}

TEST_P(EveryKind, refuses_an_absurd_gap_with_numbers) {
  InterfaceMesh fluid = flat(4, 4, 3, 1);
  fluid.positions[3 * 7 + 2] += 0.2;
  const auto error = error_of([&] { make_mapping(GetParam(), fluid, flat(5, 5, 3, 1)); });
  EXPECT_TRUE(contains(error, "fluid node 7") && contains(error, "is allowed")) << error;
}

// ---- a plane fluid on a column of hexahedra -----------------------------------------------------

// The wet outline of a gate of depth b, drawn out along z.
InterfaceMesh column(const InterfaceMesh &outline, double b, int layers) {
  InterfaceMesh mesh{3, 4, {}, {}};
  const auto n = static_cast<int>(outline.n_nodes());
  for (int k = 0; k <= layers; ++k)
    for (std::size_t a = 0; a < outline.n_nodes(); ++a)
      mesh.positions.insert(mesh.positions.end(),
                            {outline.point(a).x(), outline.point(a).y(), 0.2 + b * k / layers});
  for (int k = 0; k < layers; ++k)
    for (std::size_t f = 0; f < outline.n_faces(); ++f) {
      const int a = k * n + outline.face(f)[0], c = k * n + outline.face(f)[1];
      mesh.faces.insert(mesh.faces.end(), {a, c, c + n, a + n});
    }
  return mesh;
}

InterfaceMesh outline(int along, double unevenness) {
  auto points = uneven_line({0, 0.08}, {0, 0}, along, unevenness);
  points.emplace_back(0.005, 0);
  return polyline(points);
}

TEST_P(EveryKind, a_plane_fluid_loads_a_column_of_hexahedra) {
  const double depth = 0.1;
  const InterfaceMesh fluid = outline(31, 0.3), solid = column(outline(28, 0), depth, 2);
  const Mapping map = make_mapping(GetParam(), fluid, solid);
  EXPECT_NEAR(map.depth(), depth, 1e-15);
  const auto force = random_values(fluid.positions.size(), 4); // [N/m]
  const auto motion = random_values(solid.positions.size(), 5, 0.01);
  const auto loads = map.conservative(force), moved = map.consistent(motion);
  ASSERT_EQ(loads.size(), solid.positions.size());
  ASSERT_EQ(moved.size(), fluid.positions.size());
  const std::vector<double> rest(solid.positions.size(), 0.0), plane_rest(force.size(), 0.0);
  const auto in_plane = interface_totals(2, fluid.positions, force, plane_rest, moved);
  const auto in_space = interface_totals(3, solid.positions, loads, rest, motion);
  for (std::size_t d = 0; d < 2; ++d)
    EXPECT_NEAR(depth * in_plane.force[d], in_space.force[d],
                rounding * depth * in_plane.force_magnitude);
  EXPECT_NEAR(depth * in_plane.work, in_space.work, rounding * depth * in_plane.work_magnitude);
  for (std::size_t k = 2; k < loads.size(); k += 3)
    EXPECT_EQ(loads[k], 0);
  if (GetParam() != MapKind::nearest) {
    EXPECT_NEAR(depth * in_plane.moment[2], in_space.moment[2],
                rounding * depth * in_plane.moment_magnitude);
  }
}

TEST(ExtrudedMap, a_motion_that_is_the_same_at_every_depth_arrives_as_it_is) {
  const InterfaceMesh line = outline(28, 0), solid = column(line, 0.1, 3);
  std::vector<double> motion;
  for (std::size_t a = 0; a < solid.n_nodes(); ++a) {
    const Vec<3> x = solid.point(a);
    motion.insert(motion.end(), {2 * x.y(), x.x() - x.y(), 7.0});
  }
  const auto moved = make_mapping(MapKind::projection, line, solid).consistent(motion);
  for (std::size_t a = 0; a < line.n_nodes(); ++a) {
    EXPECT_NEAR(moved[2 * a], 2 * line.point(a).y(), 1e-16);
    EXPECT_NEAR(moved[2 * a + 1], line.point(a).x() - line.point(a).y(), 1e-16);
  }
}

TEST(ExtrudedMap, a_solid_without_depth_is_refused) {
  InterfaceMesh solid = column(outline(4, 0), 0, 1);
  const auto error = error_of([&] { make_mapping(MapKind::projection, outline(4, 0), solid); });
  EXPECT_TRUE(contains(error, "needs a depth along z")) << error;
}

// ---- the pieces ---------------------------------------------------------------------------------

TEST(NodeTree, agrees_with_the_search_over_all_nodes) {
  const InterfaceMesh mesh = benchmark::geodesic_sphere(7);
  const NodeTree tree(mesh);
  const auto places = random_values(300, 9, 1.2);
  for (std::size_t k = 0; k < places.size(); k += 3) {
    const Vec<3> p(places[k], places[k + 1], places[k + 2]);
    std::vector<NodeTree::Neighbour> all;
    for (std::size_t a = 0; a < mesh.n_nodes(); ++a)
      all.push_back({(p - mesh.point(a)).squaredNorm(), static_cast<int>(a)});
    std::sort(all.begin(), all.end());
    EXPECT_EQ(tree.nearest(p, 12), std::vector(all.begin(), all.begin() + 12));
    const auto beyond = std::find_if(all.begin(), all.end(),
                                     [](const auto &n) { return n.distance_squared > 0.25; });
    EXPECT_EQ(tree.within(p, 0.5), std::vector(all.begin(), beyond));
  }
  EXPECT_EQ(tree.nearest({0, 0, 0}, 10000).size(), mesh.n_nodes());
}

Facet triangle(const std::vector<double> &x) {
  Facet facet;
  facet.weights.setZero();
  for (std::size_t a = 0; a < 3; ++a)
    facet.x[a] = {x[2 * a], x[2 * a + 1], 0};
  return facet;
}

double overlap_area(const Facet &a, const Facet &b) {
  std::vector<OverlapPoint> points;
  add_overlap(a, b, points);
  double area = 0;
  for (const OverlapPoint &point : points) {
    area += point.weight;
    Vec<3> p = Vec<3>::Zero(), q = p;
    for (std::size_t k = 0; k < 3; ++k) {
      p += point.on_first[static_cast<Eigen::Index>(k)] * a.x[k];
      q += point.on_second[static_cast<Eigen::Index>(k)] * b.x[k];
    }
    EXPECT_LE((p - q).norm(), 1e-10) << "one point, seen from both";
  }
  return area;
}

TEST(Overlap, of_two_triangles_in_a_plane_does_not_depend_on_their_order) {
  const auto noise = random_values(600, 13);
  double total = 0;
  for (std::size_t k = 0; k + 12 <= noise.size(); k += 12) {
    const Facet a = triangle({noise.begin() + static_cast<std::ptrdiff_t>(k),
                              noise.begin() + static_cast<std::ptrdiff_t>(k) + 6});
    const Facet b = triangle({noise.begin() + static_cast<std::ptrdiff_t>(k) + 6,
                              noise.begin() + static_cast<std::ptrdiff_t>(k) + 12});
    const double there = overlap_area(a, b), back = overlap_area(b, a);
    EXPECT_NEAR(there, back, 1e-12);
    EXPECT_LE(there, std::min(a.area(), b.area()) * (1 + 1e-12));
    total += there;
  }
  EXPECT_GT(total, 1);
  const Facet unit = triangle({0, 0, 1, 0, 0, 1});
  EXPECT_NEAR(overlap_area(unit, triangle({0, 0, 1, 1, 0, 1})), 0.25, 1e-15);
  EXPECT_EQ(overlap_area(unit, triangle({2, 2, 3, 2, 2, 3})), 0);
}

TEST(NodeAreas, sum_to_the_surface) {
  for (const int nodes : {3, 4}) {
    const auto areas = node_areas(flat(5, 4, nodes, 1.4));
    double sum = 0;
    for (const double a : areas)
      sum += a;
    EXPECT_NEAR(sum, std::sqrt(1 + 0.3 * 0.3), 1e-14);
  }
}

} // namespace
} // namespace sluice::bridge
