// SPDX-License-Identifier: MIT
#include "fluid/scene.hpp"

#include "bridge/base/check.hpp"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <numbers>
#include <set>

namespace sluice::fluid {

namespace {

// --- walls ----------------------------------------------------------------------------------

void add_leg(Walls &walls, const WallParams &wall, int wall_index, const Vec<2> &to) {
  const int first = static_cast<int>(walls.position.size()) - 1;
  const Vec<2> from = walls.position[first];
  const double length = (to - from).norm();
  constexpr double most_pieces = 1e6;
  const double wanted =
      wall.segment_length > 0 ? std::ceil(length / wall.segment_length - 1e-9) : 1;
  check(wanted <= most_pieces, "wall '{}': segment_length_m = {} m cuts a leg of {} m into {:.3g} "
                               "pieces, at most {:.0e} are handled",
        wall.name, wall.segment_length, length, wanted, most_pieces);
  const int pieces = std::max(1, static_cast<int>(wanted));
  for (int k = 1; k <= pieces; ++k) {
    const double t = static_cast<double>(k) / pieces;
    walls.position.push_back(k == pieces ? to : Vec<2>((1 - t) * from + t * to));
    const int b = first + k;
    if (wall.coupled)
      walls.coupled_segments.push_back(static_cast<int>(walls.segments.size()));
    walls.segments.push_back({b - 1, b, -1, -1, wall_index});
  }
}

void add_wall(Walls &walls, const WallParams &wall) {
  const int index = static_cast<int>(walls.names.size());
  walls.names.push_back(wall.name);
  check(!wall.coupled || wall.velocity.isZero(),
        "wall '{}': a coupled wall moves as its partner says, not with velocity_m_s", wall.name);
  const int first = static_cast<int>(walls.position.size());
  walls.position.push_back(wall.points.front());
  for (std::size_t k = 1; k < wall.points.size(); ++k) {
    check((wall.points[k] - wall.points[k - 1]).norm() > 1e-9,
          "wall '{}': points {} and {} coincide at ({}, {}) m", wall.name, k - 1, k,
          wall.points[k].x(), wall.points[k].y());
    const Vec<2> leg = (wall.points[k] - wall.points[k - 1]).normalized();
    check(std::abs(cross(leg, wall.velocity)) <= 1e-9 * wall.velocity.norm(),
          "wall '{}': velocity_m_s = [{}, {}] points across the leg from point {} to {}; it may only "
          "slide along itself",
          wall.name, wall.velocity.x(), wall.velocity.y(), k - 1, k);
    add_leg(walls, wall, index, wall.points[k]);
  }
  walls.velocity.resize(walls.position.size(), wall.velocity);
  if (wall.coupled)
    for (int v = first; v < static_cast<int>(walls.position.size()); ++v)
      walls.coupled_vertices.push_back(v);
}

// Names become columns and groups of the output.
template <class Named> void check_names(const std::vector<Named> &all, std::string_view kind) {
  std::set<std::string> seen;
  for (const Named &one : all) {
    const bool is_plain = !one.name.empty() &&
                          std::all_of(one.name.begin(), one.name.end(), [](unsigned char c) {
                            return std::isalnum(c) || c == '_' || c == '-';
                          });
    check(is_plain, "{} '{}': a name has letters, digits, '_' and '-' only", kind, one.name);
    check(seen.insert(one.name).second, "two {}s are called '{}'", kind, one.name);
  }
}

Walls read_walls(const Config &config) {
  Walls walls;
  const auto tables = config.read_all<WallParams>("fluid.wall");
  check_names(tables, "wall");
  for (const WallParams &wall : tables)
    add_wall(walls, wall);
  link_outlines(walls);
  return walls;
}

// --- water ----------------------------------------------------------------------------------

bool is_inside(const std::vector<Vec<2>> &polygon, const Vec<2> &x) {
  bool inside = false;
  for (std::size_t k = 0, m = polygon.size() - 1; k < polygon.size(); m = k++) {
    const Vec<2> &a = polygon[k], &b = polygon[m];
    if ((a.y() > x.y()) != (b.y() > x.y()) &&
        x.x() < (b.x() - a.x()) * (x.y() - a.y()) / (b.y() - a.y()) + a.x())
      inside = !inside;
  }
  return inside;
}

double signed_area(const std::vector<Vec<2>> &polygon) {
  double twice = 0;
  for (std::size_t k = 0, m = polygon.size() - 1; k < polygon.size(); m = k++)
    twice += cross(polygon[m], polygon[k]);
  return 0.5 * twice;
}

struct Box {
  Vec<2> low = Vec<2>::Constant(1e300), high = Vec<2>::Constant(-1e300);
};

Box bounding_box(const std::vector<Vec<2>> &points) {
  Box box;
  for (const Vec<2> &x : points) {
    box.low = box.low.cwiseMin(x);
    box.high = box.high.cwiseMax(x);
  }
  return box;
}

// Square lattice over the box, half a spacing inside its edges, turned about the box's corner.
std::vector<Vec<2>> lattice_in(const std::vector<Vec<2>> &polygon, double spacing, double angle) {
  const Vec<2> corner = bounding_box(polygon).low;
  Mat<2> turn;
  turn << std::cos(angle), -std::sin(angle), std::sin(angle), std::cos(angle);
  std::vector<Vec<2>> in_lattice; // the polygon in coordinates along the rows, in spacings
  for (const Vec<2> &x : polygon)
    in_lattice.push_back(turn.transpose() * (x - corner) / spacing);
  const Box extent = bounding_box(in_lattice);
  std::vector<Vec<2>> points;
  for (double j = std::floor(extent.low.y()) + 0.5; j < extent.high.y(); ++j)
    for (double i = std::floor(extent.low.x()) + 0.5; i < extent.high.x(); ++i)
      if (const Vec<2> x = corner + spacing * (turn * Vec<2>(i, j)); is_inside(polygon, x))
        points.push_back(x);
  return points;
}

void check_hole(const Scene &scene, const Vec<2> &x) {
  const double nearest = distance_to_walls(scene.walls, x);
  check(nearest < 0.5 * scene.params.spacing,
        "hole in the walls below the water line at ({:.6g}, {:.6g}) m: the nearest wall is {:.3g} m "
        "away; close the wall there, or set open_sides = true if the water is meant to run out",
        x.x(), x.y(), nearest);
}

// Every edge of the water that does not face upwards must lie on a wall.
void check_holes(const Scene &scene) {
  const std::vector<Vec<2>> &water = scene.params.water;
  const double orientation = signed_area(water) > 0 ? 1 : -1;
  const Vec<2> up = -scene.params.gravity.normalized();
  for (std::size_t k = 0; k < water.size(); ++k) {
    const Vec<2> a = water[k], e = water[(k + 1) % water.size()] - a;
    const Vec<2> outward = -orientation * rotated_left(e).normalized();
    if (outward.dot(up) > 0.1)
      continue;
    const int samples = std::max(2, static_cast<int>(e.norm() / scene.params.spacing));
    for (int m = 0; m < samples; ++m)
      check_hole(scene, a + (m + 0.5) / samples * e);
  }
}

// Below the highest corner of the water: what is shown at t = 0, and the first guess of the solver.
std::vector<double> hydrostatic_pressure(const FluidParams &params,
                                         const std::vector<Vec<2>> &positions) {
  double at_surface = 1e300;
  for (const Vec<2> &corner : params.water)
    at_surface = std::min(at_surface, params.gravity.dot(corner));
  std::vector<double> pressure;
  for (const Vec<2> &x : positions)
    pressure.push_back(params.density * (params.gravity.dot(x) - at_surface));
  return pressure;
}

void check_water(const FluidParams &params) {
  const double area = std::abs(signed_area(params.water));
  const Box box = bounding_box(params.water);
  const Vec<2> size = (box.high - box.low) / params.spacing;
  constexpr double most_points = 2e8;
  check(area > 0, "water_m: the corners enclose no area; is an edge missing?");
  check(size.prod() <= most_points,
        "water_m spans {:.3g} x {:.3g} points at a spacing of {} m, at most {:.0e} are handled; use "
        "a larger spacing_m",
        size.x(), size.y(), params.spacing, most_points);
  for (const Vec<2> &corner : params.water)
    check(corner.x() < params.outlet_x,
          "the corner ({}, {}) m of water_m lies beyond the outlet at outlet_x_m = {}", corner.x(),
          corner.y(), params.outlet_x);
}

// Rows along two edges, half a distance inside; a rhombus of 60 degrees gets a triangular lattice.
std::vector<Vec<2>> lattice_along_edges(const std::vector<Vec<2>> &polygon, double spacing) {
  check(polygon.size() == 4 &&
            (polygon[0] + polygon[2] - polygon[1] - polygon[3]).norm() < 1e-6 * spacing,
        "lattice = \"edges\" needs a parallelogram as water_m");
  const Vec<2> a = polygon[1] - polygon[0], b = polygon[3] - polygon[0];
  const double widening = std::sqrt(a.norm() * b.norm() / std::abs(cross(a, b)));
  const auto count = [&](const Vec<2> &edge) {
    return std::max(1, static_cast<int>(std::lround(edge.norm() / (widening * spacing))));
  };
  const int na = count(a), nb = count(b);
  std::vector<Vec<2>> points;
  for (int j = 0; j < nb; ++j)
    for (int i = 0; i < na; ++i)
      points.push_back(polygon[0] + (i + 0.5) / na * a + (j + 0.5) / nb * b);
  return points;
}

Points fill(const FluidParams &params) {
  check_water(params);
  Points points;
  points.position = params.lattice == "edges"
                        ? lattice_along_edges(params.water, params.spacing)
                        : lattice_in(params.water, params.spacing,
                                     params.lattice_angle * std::numbers::pi / 180);
  const std::size_t n = points.position.size();
  check(n >= 4, "water_m holds {} points at a spacing of {} m; use a smaller spacing_m", n,
        params.spacing);
  points.velocity.assign(n, Vec<2>::Zero());
  points.previous_velocity.assign(n, Vec<2>::Zero());
  points.shift.assign(n, Vec<2>::Zero());
  points.shift_velocity.assign(n, Vec<2>::Zero());
  points.pressure_gradient.assign(n, params.density * params.gravity);
  points.pressure = hydrostatic_pressure(params, points.position);
  points.at_surface.assign(n, SurfaceMemory::enclosed);
  points.id.resize(n);
  for (std::size_t i = 0; i < n; ++i)
    points.id[i] = static_cast<std::int32_t>(i);
  return points;
}

} // namespace

double volume_error(const Scene &scene) {
  const double spacing = scene.params.spacing, area = std::abs(signed_area(scene.params.water));
  return scene.initial.points.size() * spacing * spacing / area - 1;
}

void check_clear_of_walls(const Scene &scene, double tolerance) {
  const double spacing = scene.params.spacing;
  const auto &position = scene.initial.points.position;
  const Grid grid = grid_over(scene.initial.points, 4 * spacing);
  SegmentGrid near;
  find_near_segments(scene.walls, grid, spacing, near);
  for (const Vec<2> &x : position)
    for (const Projection &p :
         project_on_walls(scene.walls, near.near(grid.cell(x)), x, spacing))
      check(p.distance > -tolerance,
            "the water overlaps wall '{}': a point at ({:.6g}, {:.6g}) m lies {:.3g} m behind it; "
            "correct water_m or the wall (the fluid lies on the left of its points_m)",
            scene.walls.names[scene.walls.segments[p.segment].wall], x.x(), x.y(), -p.distance);
}

Scene read_scene(const Config &config) {
  Scene scene;
  scene.params = config.read<FluidParams>("fluid");
  scene.params.rheology =
      Rheology(config.read<RheologyParams>("fluid.rheology"), scene.params.viscosity);
  scene.walls = read_walls(config);
  scene.gauges = config.read_all<GaugeParams>("fluid.gauge");
  check_names(scene.gauges, "gauge");
  scene.probes = config.read_all<ProbeParams>("fluid.probe");
  check_names(scene.probes, "probe");
  check(!scene.walls.segments.empty(), "{}: the scene has no [[fluid.wall]]", config.file_name());
  scene.initial.points = fill(scene.params);
  check_clear_of_walls(scene, 0);
  if (!scene.params.open_sides && scene.params.gravity.norm() > 0)
    check_holes(scene);
  return scene;
}

} // namespace sluice::fluid
