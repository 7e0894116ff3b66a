// SPDX-License-Identifier: MIT
// The fluid's state: a value that can be copied. A coupling checkpoint is such a copy.
#pragma once

#include "bridge/base/vec.hpp"

#include <cstdint>
#include <span>
#include <type_traits>
#include <vector>

namespace sluice::fluid {

/// What a point remembers of the last step's free surface.
enum SurfaceMemory : std::uint8_t { enclosed = 0, open = 1, released = 2 };

/// The points that carry the fluid, one entry per point in every array, sorted by grid cell.
template <int dim> struct Points {
  std::vector<Vec<dim>> position;          // [m]
  std::vector<Vec<dim>> velocity;          // [m/s], at the end of the last step
  std::vector<Vec<dim>> previous_velocity; // [m/s], one step earlier, carried by the point
  std::vector<Vec<dim>> shift;             // [m], regularisation to be applied in the next move
  std::vector<Vec<dim>> shift_velocity;    // [m/s], change of velocity along that shift
  std::vector<double> pressure;            // [Pa], mean over the last step
  std::vector<Vec<dim>> pressure_gradient; // [Pa/m], of the last step
  std::vector<double> surface_pressure;    // [Pa], outside of surface points; elsewhere 0
  std::vector<double> strain_rate;         // [1/s], sqrt(2 E : E) in the last step
  std::vector<std::int32_t> id;            // stays with the point for its life
  std::vector<SurfaceMemory> at_surface;   // in the last step

  int size() const { return static_cast<int>(position.size()); }
};

/// Calls body(name, array of a, array of b) for every array of the points: the one list of them.
template <class A, class B, class Body> void for_each_pair_of_arrays(A &a, B &b, Body &&body) {
  body("position", a.position, b.position);
  body("velocity", a.velocity, b.velocity);
  body("previous_velocity", a.previous_velocity, b.previous_velocity);
  body("shift", a.shift, b.shift);
  body("shift_velocity", a.shift_velocity, b.shift_velocity);
  body("pressure", a.pressure, b.pressure);
  body("pressure_gradient", a.pressure_gradient, b.pressure_gradient);
  body("surface_pressure", a.surface_pressure, b.surface_pressure);
  body("strain_rate", a.strain_rate, b.strain_rate);
  body("id", a.id, b.id);
  body("at_surface", a.at_surface, b.at_surface);
}
/// Calls body(name, array).
template <class AnyPoints, class Body> void for_each_array(AnyPoints &points, Body &&body) {
  for_each_pair_of_arrays(points, points,
                          [&](const char *name, auto &array, auto &) { body(name, array); });
}

/// Volume that a point stands for [m^3; in the plane m^2, per metre of depth].
template <int dim> constexpr double volume_of_point(double spacing) {
  return dim == 2 ? spacing * spacing : spacing * spacing * spacing;
}

/// All that a step reads and writes between windows. In the plane energies and momenta are per
/// metre of depth.
template <int dim> struct FluidState {
  Points<dim> points;
  std::int64_t step = 0;           // steps completed
  double step_size = 0;            // [s], of the last step
  std::int64_t wall_returns = 0;   // points put back through a wall so far
  std::int64_t outflow_points = 0; // points that left through the outlet so far
  std::int64_t lost_points = 0;    // points that ended outside except through the outlet
  double outlet_energy = 0;        // energy of the points that left [J]
  Vec<dim> outlet_momentum = Vec<dim>::Zero(); // momentum of the points that left [N s]
};

/// Arrays of vectors as arguments, where another argument tells the dimension.
template <int dim> using VecView = std::type_identity_t<std::span<const Vec<dim>>>;
template <int dim> using VecSpan = std::type_identity_t<std::span<Vec<dim>>>;
template <int dim> using MatView = std::type_identity_t<std::span<const Mat<dim>>>;

} // namespace sluice::fluid
