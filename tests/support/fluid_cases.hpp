// SPDX-License-Identifier: MIT
// Small scenes for the tests of the fluid: clouds, walls, and the frozen cloud as a step builds it.
#pragma once

#include "bridge/base/check.hpp"
#include "fluid/cloud.hpp"
#include "fluid/motion.hpp"
#include "fluid/pressure.hpp"
#include "fluid/scene.hpp"
#include "fluid/step.hpp"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <random>
#include <string>
#include <vector>

namespace sluice::fluid::testing {

/// Points at rest at the given places.
template <int dim> Points<dim> points_in(const std::vector<Vec<dim>> &position) {
  Points<dim> points;
  const std::size_t n = position.size();
  points.position = position;
  for (auto *v : {&points.velocity, &points.previous_velocity, &points.shift,
                  &points.shift_velocity, &points.pressure_gradient})
    v->assign(n, Vec<dim>::Zero());
  points.pressure.assign(n, 0);
  points.surface_pressure.assign(n, 0);
  points.strain_rate.assign(n, 0);
  points.at_surface.assign(n, SurfaceMemory::enclosed);
  for (std::size_t i = 0; i < n; ++i)
    points.id.push_back(static_cast<std::int32_t>(i));
  return points;
}
inline Points<2> points_at(const std::vector<Vec<2>> &position) { return points_in<2>(position); }

/// Lattice in [0, nx h] x [0, ny h], half a spacing inside; displaced by up to `jitter` spacings.
inline std::vector<Vec<2>> lattice(int nx, int ny, double h, double jitter = 0, unsigned seed = 1) {
  std::mt19937 engine(seed);
  std::uniform_real_distribution<double> uniform(-jitter, jitter);
  std::vector<Vec<2>> x;
  for (int j = 0; j < ny; ++j)
    for (int i = 0; i < nx; ++i) {
      const double dx = uniform(engine), dy = uniform(engine);
      x.emplace_back(h * (i + 0.5 + dx), h * (j + 0.5 + dy));
    }
  return x;
}

/// The same in space.
inline std::vector<Vec<3>> lattice(const std::array<int, 3> &n, double h, double jitter = 0,
                                   unsigned seed = 1) {
  std::mt19937 engine(seed);
  std::uniform_real_distribution<double> uniform(-jitter, jitter);
  std::vector<Vec<3>> x;
  for (int k = 0; k < n[2]; ++k)
    for (int j = 0; j < n[1]; ++j)
      for (int i = 0; i < n[0]; ++i) {
        const double dx = uniform(engine), dy = uniform(engine), dz = uniform(engine);
        x.emplace_back(h * (i + 0.5 + dx), h * (j + 0.5 + dy), h * (k + 0.5 + dz));
      }
  return x;
}

inline std::vector<Vec<2>> random_points(int n, const Vec<2> &size, unsigned seed) {
  std::mt19937 engine(seed);
  std::uniform_real_distribution<double> uniform(0, 1);
  std::vector<Vec<2>> x;
  for (int i = 0; i < n; ++i) {
    const double a = uniform(engine), b = uniform(engine);
    x.emplace_back(a * size.x(), b * size.y());
  }
  return x;
}

inline void add_polyline(Walls<2> &walls, const std::vector<Vec<2>> &vertices,
                         const std::string &name = "wall") {
  const int first = static_cast<int>(walls.position.size());
  const int wall = static_cast<int>(walls.names.size());
  walls.names.push_back(name);
  walls.slip.push_back(Slip::none);
  for (std::size_t k = 0; k < vertices.size(); ++k) {
    walls.position.push_back(vertices[k]);
    walls.velocity.emplace_back(0, 0);
    if (const int b = first + static_cast<int>(k); k > 0)
      walls.faces.push_back({{b - 1, b}, wall});
  }
}

inline Walls<2> polyline(const std::vector<Vec<2>> &vertices) {
  Walls<2> walls;
  add_polyline(walls, vertices);
  link_faces(walls);
  return walls;
}

/// The inside of a box, closed on all sides.
inline Walls<2> closed_box(double width, double height) {
  return polyline({{0, height}, {0, 0}, {width, 0}, {width, height}, {0, height}});
}

/// What a box is to the fluid.
enum class Box { container, obstacle };

/// A box [0, size] of twelve triangles.
inline Walls<3> box_of_triangles(const Vec<3> &size, Box box = Box::container) {
  Walls<3> walls;
  walls.names = {"box"};
  walls.slip = {Slip::none};
  for (int k = 0; k < 8; ++k)
    walls.position.emplace_back(k & 1 ? size.x() : 0, k & 2 ? size.y() : 0, k & 4 ? size.z() : 0);
  walls.velocity.assign(8, Vec<3>::Zero());
  // Corners counter-clockwise seen from inside.
  for (const auto &[a, b, c, d] : std::vector<std::array<int, 4>>{
           {0, 1, 3, 2}, {4, 6, 7, 5}, {0, 4, 5, 1}, {2, 3, 7, 6}, {0, 2, 6, 4}, {1, 5, 7, 3}})
    for (std::array<int, 3> corners : {std::array{a, b, c}, std::array{a, c, d}}) {
      if (box == Box::obstacle)
        std::swap(corners[1], corners[2]);
      walls.faces.push_back({corners, 0, static_cast<int>(walls.faces.size())});
    }
  link_faces(walls);
  return walls;
}

template <int dim> std::vector<int> every_face(const Walls<dim> &walls) {
  std::vector<int> all;
  for (int k = 0; k < static_cast<int>(walls.faces.size()); ++k)
    all.push_back(k);
  return all;
}

/// The projections of x on all walls.
inline PointWalls<2> project(const Walls<2> &walls, const Vec<2> &x, double reach) {
  return project_on_walls(walls, every_face(walls), x, reach);
}

/// A cloud frozen as FluidSolver does, without moving the points.
template <int dim> struct FrozenCloudIn {
  Points<dim> points;
  Walls<dim> walls;
  Cloud<dim> cloud;

  FrozenCloudIn(std::vector<Vec<dim>> position, Walls<dim> w, double spacing)
      : points(points_in<dim>(position)), walls(std::move(w)) {
    update_walls(points, walls, spacing, cloud);
    update_neighbours(points, walls, cloud);
    update_cells(points, cloud);
  }
  int size() const { return points.size(); }
  int count(PointKind kind) const {
    int n = 0;
    for (const PointKind k : cloud.kind)
      n += k == kind;
    return n;
  }
  /// field(x) at every point.
  template <class Field> auto values(Field &&field) const {
    std::vector<std::decay_t<decltype(field(Vec<dim>()))>> result;
    for (const Vec<dim> &x : points.position)
      result.push_back(field(x));
    return result;
  }
};
using FrozenCloud = FrozenCloudIn<2>;

/// Solver on a scene given as the text of a case file.
inline Scene<2> scene_of(const std::string &text, const std::vector<std::string> &overrides = {}) {
  return read_scene<2>(Config::parse(text, "case.toml", overrides));
}

/// The elastic gate's tank with 4 mm between points and a gate of the given thickness [m].
inline std::string gate_tank(double thickness = 0.012) {
  return fmt::format(R"(
[fluid]
spacing_m = 0.004
dynamic_viscosity_pa_s = 1e-3
water_m = [[0, 0], [0.1, 0], [0.1, 0.14], [0, 0.14]]
outlet_x_m = 0.7
[[fluid.wall]]
name = "tank"
points_m = [[0, 0.3], [0, 0], [0.8, 0]]
[[fluid.wall]]
name = "upper"
points_m = [[0.1, 0.079], [0.1, 0.3], [{0}, 0.3], [{0}, 0.079]]
[[fluid.wall]]
name = "gate"
coupled = true
segment_length_m = 0.005
points_m = [[{0}, 0.079], [{0}, 0], [0.1, 0], [0.1, 0.079]]
)",
                     0.1 + thickness);
}

/// A channel as deep as the water is long, still, between slippery side walls.
inline const std::string still_channel = R"(
[fluid]
dimension = 3
depth_m = 0.05
spacing_m = 0.01
dynamic_viscosity_pa_s = 1e-3
pressure_tolerance = 1e-12
gravity_m_s2 = [0, -9.81, 0]
water_m = [[0, 0], [0.06, 0], [0.06, 0.08], [0, 0.08]]
[[fluid.wall]]
name = "tank"
points_m = [[0, 0.15], [0, 0], [0.06, 0]]
[[fluid.wall]]
name = "gate"
coupled = true
segment_length_m = 0.02
points_m = [[0.06, 0], [0.06, 0.05]]
[[fluid.wall]]
name = "upper"
points_m = [[0.06, 0.05], [0.06, 0.15]]
)";

/// A column of water that collapses in a tank with walls at both ends.
inline const std::string dam_break = R"(
[fluid]
spacing_m = 0.0025
dynamic_viscosity_pa_s = 1e-3
water_m = [[0, 0], [0.1, 0], [0.1, 0.12], [0, 0.12]]
open_sides = true
[[fluid.wall]]
name = "tank"
points_m = [[0, 0.4], [0, 0], [0.4, 0], [0.4, 0.4]]
)";

/// Slope of log(error) against log(h), by least squares.
inline double fitted_order(const std::vector<double> &h, const std::vector<double> &error) {
  double mean_x = 0, mean_y = 0, xy = 0, xx = 0;
  const double n = static_cast<double>(h.size());
  for (std::size_t k = 0; k < h.size(); ++k) {
    mean_x += std::log(h[k]) / n;
    mean_y += std::log(error[k]) / n;
  }
  for (std::size_t k = 0; k < h.size(); ++k) {
    xy += (std::log(h[k]) - mean_x) * (std::log(error[k]) - mean_y);
    xx += (std::log(h[k]) - mean_x) * (std::log(h[k]) - mean_x);
  }
  return xy / xx;
}

/// The message of the UserError that `action` throws; "" when it throws none.
template <class Action> std::string message_of(Action &&action) {
  try {
    action();
  } catch (const UserError &error) {
    return error.what();
  }
  return "";
}

inline bool contains(const std::string &text, const std::string &part) {
  return text.find(part) != std::string::npos;
}

} // namespace sluice::fluid::testing
