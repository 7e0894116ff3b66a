// SPDX-License-Identifier: MIT
// From a case file to a scene: parameters, walls, and the water filled with points. In space what
// is given in the plane is swept along z: the same case file makes a channel of it.
#pragma once

#include "bridge/base/config.hpp"
#include "fluid/fluid_params.hpp"
#include "fluid/points.hpp"
#include "fluid/surface_mesh.hpp"
#include "fluid/wall_motion.hpp"
#include "fluid/walls.hpp"

#include <cmath>
#include <limits>
#include <string>
#include <vector>

namespace sluice::fluid {

/// Table [[fluid.gauge]]: the water's level at x, measured along y, or its front at the height y,
/// measured along x.
template <int dim> struct GaugeParams {
  static constexpr double not_given = std::numeric_limits<double>::quiet_NaN();

  std::string name;
  double x = not_given, y = not_given, z = not_given;

  template <class Reader> void describe(Reader &read) {
    read.required("name", name, "name of the gauge: letters, digits, _ and -");
    read("x_m", x, "place at which the water level is measured");
    read("y_m", y, "height at which the front of the water is measured, instead of x_m")
        .check(std::isnan(x) != std::isnan(y), "is one of two: give x_m or y_m");
    if constexpr (dim == 3)
      read("z_m", z, "place of the gauge; in the middle when not given");
  }

  bool is_front() const { return std::isnan(x); }
};

/// Table [[fluid.probe]]: places along a line.
template <int dim> struct ProbeParams {
  std::string name;
  Vec<dim> from = Vec<dim>::Zero(), to = Vec<dim>::Zero();
  int samples = 1;

  template <class Reader> void describe(Reader &read) {
    read.required("name", name, "name of the probe: letters, digits, _ and -");
    read.required("from_m", from, "first place");
    read.required("to_m", to, "last place");
    read("samples", samples, "number of places, ends included").at_least(1).at_most(1e6);
  }
};

template <int dim> struct Scene {
  FluidParams<dim> params;
  Walls<dim> walls;
  std::vector<PrescribedWall<dim>> prescribed;
  std::vector<GaugeParams<dim>> gauges;
  std::vector<ProbeParams<dim>> probes;
  FluidState<dim> initial;
};

/// Volume that the points stand for minus that of water_m, over the latter: what the lattice
/// misses.
template <int dim> double volume_error(const Scene<dim> &scene);

/// Throws UserError, naming the point and the wall, if a point lies farther behind a wall than
/// `tolerance` [m].
template <int dim> void check_clear_of_walls(const Scene<dim> &scene, double tolerance);

/// Number of dimensions that the case file asks for, 2 or 3. Throws UserError on any other.
int dimension_of(const Config &config);

/// Reads the tables of the fluid and fills the water; `read_surface` reads walls from files. Throws
/// UserError, with place and numbers, on water that overlaps a wall, a hole in the walls below the
/// water line, or too few points.
template <int dim>
Scene<dim> read_scene(const Config &config, const SurfaceReader &read_surface = {});

} // namespace sluice::fluid
