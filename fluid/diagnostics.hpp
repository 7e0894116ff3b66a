// SPDX-License-Identifier: MIT
// Integral quantities of the fluid: what is watched, and checked against conservation.
#pragma once

#include "bridge/statistics.hpp"
#include "fluid/step.hpp"

#include <optional>

namespace sluice::fluid {

/// Integral state at the end of a step; in the plane per metre of depth.
template <int dim> struct Integrals {
  double kinetic = 0;                   // [J]
  double potential = 0;                 // [J], of gravity, zero at the origin
  Vec<dim> momentum = Vec<dim>::Zero(); // [N s]
  double volume = 0;                    // [m^dim], inside the surface envelope: holes do not count
  double point_volume = 0;              // [m^dim], number of points times spacing^dim
  double tank_volume = 0;       // [m^dim], envelope on this side of the coupled wall's centre line
  double tank_point_volume = 0; // [m^dim], points there times spacing^dim
  double max_speed = 0;         // [m/s]
  double min_pressure = 0, max_pressure = 0; // [Pa]
};

/// Those that the points alone make up: energies, momentum, point_volume and speed. Positions are
/// taken at the end of the step: stage position plus dt (u^{n+1} - u^n) / 2.
template <int dim>
Integrals<dim> integrate(const FluidState<dim> &state, const FluidParams<dim> &params);
/// All of them; needs a completed step.
template <int dim> Integrals<dim> integrate(const FluidSolver<dim> &solver);

/// Force, moment about the origin and work of the fluid on the coupled walls: the fluid's own
/// traction integral over its own quadrature, not the nodal forces that the bridge maps.
/// `start` and `end` are the displacements of the wall's vertices at both ends of the step [m].
template <int dim>
bridge::InterfaceTotals interface_totals(const FluidSolver<dim> &solver, VecView<dim> start,
                                         VecView<dim> end);

/// Centre line of a coupled wall in the plane that hangs down like a gate: an outline that runs
/// down one face and up the other. Other coupled walls have none; in space there is none.
class CentreLine {
public:
  explicit CentreLine(const Walls<2> &walls);
  explicit CentreLine(const Walls<3> &) {}
  bool exists() const { return !line_.empty(); }
  /// True beyond the plate: past its face above the tip, past the tip below it.
  template <int dim> bool is_past(const Vec<dim> &x) const { return is_past(x.x(), x.y()); }
  /// Free end [m].
  Vec<2> tip() const { return line_.back(); }

private:
  bool is_past(double x, double y) const;

  std::vector<Vec<2>> line_; // from the clamp to the tip
};

/// A vertical line, along y: x in the plane, x and z in space [m].
template <int dim> using VerticalLine = Vec<dim - 1>;

/// Height of the lowest wall on the line that has the fluid above it [m], if there is one.
template <int dim>
std::optional<double> floor_at(const Walls<dim> &walls, const VerticalLine<dim> &line);

/// Height of the water column on the line that stands on `floor` [m]: its top point plus half a
/// spacing; the floor itself where it is dry. Without a floor: of the lowest column, NaN where
/// there is none.
template <int dim>
double water_level(const Points<dim> &points, const VerticalLine<dim> &line, double spacing,
                   std::optional<double> floor);

/// The farthest place along x that the water reaches within a spacing of the height y [m]: a point
/// and half a spacing; NaN where there is none.
template <int dim> double front(const Points<dim> &points, double y, double spacing);

} // namespace sluice::fluid
