// SPDX-License-Identifier: MIT
// What the table [fluid] of a case file says.
#pragma once

#include "bridge/base/vec.hpp"
#include "fluid/formula.hpp"
#include "fluid/motion.hpp"
#include "fluid/rheology.hpp"

#include <algorithm>
#include <array>
#include <fmt/format.h>
#include <fmt/ranges.h>
#include <string>
#include <string_view>
#include <vector>

namespace sluice::fluid {

/// Fields of the points that can be written for ParaView.
inline constexpr std::array field_names{"pressure", "velocity", "viscosity",         "kind",
                                        "id",       "volume",   "pressure_gradient", "shear_rate"};

/// The first of `names` that is no field, "" if there is none.
inline std::string unknown_field(const std::vector<std::string> &names) {
  const auto unknown = std::find_if_not(names.begin(), names.end(), [](const std::string &name) {
    return std::find(field_names.begin(), field_names.end(), name) != field_names.end();
  });
  return unknown == names.end() ? "" : *unknown;
}

/// Table [fluid].
template <int dim> struct FluidParams {
  static constexpr double no_place = 1e300;

  double spacing = 0;
  double density = 1000;
  double viscosity = 1e-3;
  Vec<dim> gravity = -9.81 * Vec<dim>::Unit(1);
  std::vector<Vec<2>> water;
  Vec<dim> fill_from = Vec<dim>::Constant(no_place);
  double fill_level = 1e300;
  std::vector<std::string> start_velocity;
  double start_jitter = 0;
  double depth = 0;
  std::string side_walls = "free-slip";
  std::string lattice = "square";
  double lattice_angle = 0;
  double outlet_x = 1e300;
  bool open_sides = false;
  bool free_surface = true;
  std::string stiff_pressure = "auto";
  bool holds_tension = false;
  std::string coupled_walls = "move";
  std::string start_state;
  std::vector<std::string> fields{"pressure", "velocity", "viscosity", "kind", "id", "volume"};
  int time_order = 1;
  double courant = 0;
  double pressure_tolerance = 1e-6;
  std::string pressure_rows = "quadratic";
  double row_guard = 0.1;
  double gradient_guard = 20;
  double noise_damping = 1;
  bool remember_cells = true;
  bool record_wall_force = true;
  double negligible_viscosity = 1e-5;
  MotionParams motion;
  Rheology rheology; // from table [fluid.rheology] and `viscosity`

  /// The fluid is poured in at fill_from instead of filling `water`.
  bool is_flooded() const { return fill_from[0] < no_place; }
  bool writes(std::string_view field) const {
    return std::find(fields.begin(), fields.end(), field) != fields.end();
  }

  template <class Reader> void describe(Reader &read) {
    int dimension = dim;
    read("dimension", dimension, "2: per metre of depth; 3: in space")
        .check(dimension == dim, "must be 2 or 3");
    read.required("spacing_m", spacing, "distance between points").positive();
    read("density_kg_m3", density, "mass per volume").positive();
    read("dynamic_viscosity_pa_s", viscosity, "dynamic viscosity; 0 is inviscid").at_least(0);
    read("gravity_m_s2", gravity, "acceleration of gravity");
    read("fill_from_m", fill_from,
         "place from which the fluid floods the scene up to fill_level_m");
    read("fill_level_m", fill_level, "height along y that the flood reaches")
        .check(!is_flooded() || fill_level < no_place, "is missing: fill_from_m needs a level");
    read("start_state", start_state,
         "file fluid_state.h5 of a run to go on from, relative to the case file; the water is that "
         "of the file");
    read("water_m", water, "polygon that is filled with points at t = 0")
        .check(
            water.size() >= 3 || (water.empty() && (is_flooded() || !start_state.empty())),
            "needs at least three corners (or give fill_from_m and fill_level_m, or start_state)")
        .check(water.empty() || !is_flooded(), "is not needed where fill_from_m is given");
    auto velocity = read("start_velocity_m_s", start_velocity,
                         "formulas in x, y (z) of the velocity at t = 0; nothing is at rest");
    const std::string problem = problem_of<dim>(start_velocity);
    velocity.check(problem.empty(), problem);
    read("start_jitter", start_jitter, "random displacement of the first points, in spacings")
        .at_least(0)
        .at_most(0.25);
    read("lattice", lattice,
         "of the first points: square, or along the edges of a parallelogram water_m")
        .one_of({"square", "edges"});
    if constexpr (dim == 3) {
      read("depth_m", depth, "extent along z, from 0, of what is given in the plane")
          .check(depth > 0 || (water.empty() && depth == 0), "must be positive");
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
    read("holds_tension", holds_tension,
         "points next to air may pull: for a drop or a patch held together by nothing else");
    read("stiff_pressure", stiff_pressure,
         "where viscosity is stiff: \"kept\", corrected by the projection, \"renewed\" by it, or "
         "\"auto\": kept without a free surface")
        .one_of({"auto", "kept", "renewed"});
    read("coupled_walls", coupled_walls, "what coupled walls do").one_of({"move", "stay"});
    read("fields", fields, "of the points, written every case.output_interval_s")
        .check(unknown_field(fields).empty(),
               fmt::format("names '{}'; valid are {}", unknown_field(fields),
                           fmt::join(field_names, ", ")));
    read("time_order", time_order,
         "1: each step by itself; 2: backward differences over two, viscosity with the last "
         "pressure")
        .at_least(1)
        .at_most(2);
    read(
        "courant", courant,
        "spacings that the fastest point may move in a step, which then is adapted; with a partner "
        "a longer window is halved (bridge.max_halvings). 0: always case.time_step_s")
        .at_least(0)
        .at_most(1);
    read("pressure_tolerance", pressure_tolerance, "residual of the pressure, relative")
        .at_least(1e-12)
        .at_most(1e-2);
    read("pressure_rows", pressure_rows,
         "\"quadratic\": least squares of second order; \"renormalised\": the linear ones of the "
         "method as published")
        .one_of({"quadratic", "renormalised"});
    read("row_guard", row_guard, "largest share of negative weights in a pressure row").positive();
    read("gradient_guard", gradient_guard,
         "largest norm of a pressure gradient's functional, times the kernel radius")
        .positive();
    read("noise_damping", noise_damping,
         "decay of velocity modes at the scale of the points, in units of the pace")
        .at_least(0);
    read("remember_cells", remember_cells,
         "false: all Voronoi cells are cut anew in every step, with the same result");
    read("record_wall_force", record_wall_force,
         "false: wall_force in fluid.csv is nan, and loads are those of the coupled walls alone");
    read("negligible_viscosity", negligible_viscosity,
         "time step times kinematic viscosity over spacing^2 below which viscosity is left out")
        .at_least(0)
        .at_most(1e-3);
    read("regularity", motion.regularity, "shift towards the cell's centroid per unit of strain")
        .at_least(0);
    read("agitation", motion.agitation, "disturbance of the points per unit of strain, in spacings")
        .at_least(0);
    if (!free_surface) // the container holds the volume: only cells even out
      motion.volume_rate = 0.1;
    read("volume_rate", motion.volume_rate,
         "decay of volume errors, in units of the pace; 0.1 by default without a free surface")
        .at_least(0);
    read("widest_offset", motion.widest_offset,
         "farthest that a point lies from the middle of its cell, in spacings")
        .positive();
    read("closest_pair", motion.closest_pair, "closest distance of two points, in spacings")
        .at_least(0)
        .at_most(0.9);
    read("wall_clearance", motion.wall_clearance, "closest distance to a wall, in spacings")
        .positive()
        .at_most(0.5);
  }
};

} // namespace sluice::fluid
