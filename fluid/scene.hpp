// SPDX-License-Identifier: MIT
// From a case file to a scene: parameters, walls, and the water filled with points. In space what
// is given in the plane is swept along z: the same case file makes a channel of it.
#pragma once

#include "bridge/base/config.hpp"
#include "fluid/motion.hpp"
#include "fluid/points.hpp"
#include "fluid/rheology.hpp"
#include "fluid/surface_mesh.hpp"
#include "fluid/walls.hpp"

#include <limits>
#include <string>
#include <vector>

namespace sluice::fluid {

/// Table [fluid].
template <int dim> struct FluidParams {
  double spacing = 0;
  double density = 1000;
  double viscosity = 1e-3;
  Vec<dim> gravity = -9.81 * Vec<dim>::Unit(1);
  std::vector<Vec<2>> water;
  double depth = 0;
  std::string side_walls = "free-slip";
  std::string lattice = "square";
  double lattice_angle = 0;
  double outlet_x = 1e300;
  bool open_sides = false;
  bool free_surface = true;
  std::string coupled_walls = "move";
  std::string start_state;
  int time_order = 1;
  double pressure_tolerance = 1e-6;
  double row_guard = 0.1;
  double gradient_guard = 20;
  double noise_damping = 0.5;
  MotionParams motion;
  Rheology rheology; // from table [fluid.rheology] and `viscosity`

  template <class Reader> void describe(Reader &read) {
    int dimension = dim;
    read("dimension", dimension, "2: per metre of depth; 3: in space")
        .check(dimension == dim, "must be 2 or 3");
    read.required("spacing_m", spacing, "distance between points").positive();
    read("density_kg_m3", density, "mass per volume").positive();
    read("dynamic_viscosity_pa_s", viscosity, "dynamic viscosity; 0 is inviscid").at_least(0);
    read("gravity_m_s2", gravity, "acceleration of gravity");
    read.required("water_m", water, "polygon that is filled with points at t = 0")
        .check(water.size() >= 3, "needs at least three corners");
    read("lattice", lattice,
         "of the first points: square, or along the edges of a parallelogram water_m")
        .one_of({"square", "edges"});
    if constexpr (dim == 3) {
      read.required("depth_m", depth, "extent along z, from 0, of what is given in the plane")
          .positive();
      read("side_walls", side_walls, "walls at z = 0 and z = depth_m")
          .one_of({"free-slip", "no-slip", "none"});
    }
    read("lattice_angle_deg", lattice_angle, "angle by which the first lattice is turned")
        .at_least(-45)
        .at_most(45);
    read("outlet_x_m", outlet_x, "points beyond leave the scene and count as outflow");
    read("open_sides", open_sides, "water may touch air at its sides and below at t = 0");
    read("free_surface", free_surface, "false: the fluid fills a closed container and has no air")
        .check(free_surface || outlet_x > 1e299,
               "has no outlet: outlet_x_m is for water next to air");
    read("coupled_walls", coupled_walls, "what coupled walls do").one_of({"move", "stay"});
    read("start_state", start_state,
         "file fluid_state.h5 of a run to go on from, instead of filling water_m");
    read("time_order", time_order,
         "1: each step by itself; 2: backward differences over two, viscosity with the last "
         "pressure")
        .at_least(1)
        .at_most(2);
    read("pressure_tolerance", pressure_tolerance, "residual of the pressure, relative")
        .at_least(1e-12)
        .at_most(1e-2);
    read("row_guard", row_guard, "largest share of negative weights in a pressure row").positive();
    read("gradient_guard", gradient_guard,
         "largest norm of a pressure gradient's functional, times the kernel radius")
        .positive();
    read("noise_damping", noise_damping,
         "decay of velocity modes at the scale of the points, in units of the pace")
        .at_least(0);
    read("regularity", motion.regularity, "shift towards the cell's centroid per unit of strain")
        .at_least(0);
    read("agitation", motion.agitation, "disturbance of the points per unit of strain, in spacings")
        .at_least(0);
    read("volume_rate", motion.volume_rate, "decay of volume errors, in units of the pace")
        .at_least(0);
    read("closest_pair", motion.closest_pair, "closest distance of two points, in spacings")
        .at_least(0)
        .at_most(0.9);
    read("wall_clearance", motion.wall_clearance, "closest distance to a wall, in spacings")
        .positive()
        .at_most(0.5);
  }
};

/// Table [[fluid.wall]]: a polyline with the fluid on its left, in space swept along z; or, in
/// space, a surface from a file.
template <int dim> struct WallParams {
  std::string name;
  std::string condition = "no-slip";
  std::vector<Vec<2>> points;
  std::string file;
  bool open = false, reversed = false;
  bool coupled = false;
  double segment_length = 0;
  Vec<2> velocity{0, 0};

  template <class Reader> void describe(Reader &read) {
    read.required("name", name, "name of the wall");
    if constexpr (dim == 2) {
      read.required("points_m", points, "polyline with the fluid on its left")
          .check(points.size() >= 2, "needs at least two points");
    } else {
      read("file", file, "surface of triangles and quadrilaterals: .stl, .obj, .ply or .vtp");
      read("open", open, "the surface of the file may have a border, as a tank without a lid");
      read("reversed", reversed, "the fluid lies behind the faces of the file, not in front");
      read("points_m", points, "polyline with the fluid on its left, swept along z")
          .check(file.empty() ? points.size() >= 2 : points.empty(),
                 "needs at least two points, or none where a file is given");
    }
    read("condition", condition, "what holds for viscous water that flows along the wall")
        .one_of({"no-slip", "free-slip"});
    read("coupled", coupled, "moves with the partner of the bridge");
    read("segment_length_m", segment_length, "longest segment; 0 keeps the given ones").at_least(0);
    read("velocity_m_s", velocity, "of a wall that slides along itself, as a lid does");
  }
};

/// Table [[fluid.gauge]]: water level at a place, measured along y.
template <int dim> struct GaugeParams {
  std::string name;
  double x = 0, z = std::numeric_limits<double>::quiet_NaN();

  template <class Reader> void describe(Reader &read) {
    read.required("name", name, "name of the gauge: letters, digits, _ and -");
    read.required("x_m", x, "place of the gauge");
    if constexpr (dim == 3)
      read("z_m", z, "place of the gauge; in the middle when not given");
  }
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
