// SPDX-License-Identifier: MIT
// Integral quantities of the fluid: what is watched, and checked against conservation.
#pragma once

#include "bridge/statistics.hpp"
#include "fluid/step.hpp"

#include <optional>

namespace sluice::fluid {

/// Integral state at the end of a step, per metre of depth.
struct Integrals {
  double kinetic = 0;       // [J/m]
  double potential = 0;     // [J/m], of gravity, zero at the origin
  Vec<2> momentum{0, 0};    // [N s/m]
  double volume = 0;        // [m^2], area inside the surface envelope: holes do not count
  double point_volume = 0;  // [m^2], number of points times spacing^2
  double tank_volume = 0;        // [m^2], envelope on this side of the coupled wall's centre line
  double tank_point_volume = 0;  // [m^2], points there times spacing^2
  double max_speed = 0;     // [m/s]
  double min_pressure = 0, max_pressure = 0; // [Pa]
};

/// Those that the points alone make up: energies, momentum, point_volume and speed. Positions are
/// taken at the end of the step: stage position plus dt (u^{n+1} - u^n) / 2.
Integrals integrate(const FluidState &state, const FluidParams &params);
/// All of them; needs a completed step.
Integrals integrate(const FluidSolver &solver);

/// Force, moment about the origin and work of the fluid on the coupled walls: the fluid's own
/// traction integral over its own quadrature, not the nodal forces that the bridge maps.
/// `start` and `end` are the displacements of the wall's vertices at both ends of the step [m].
bridge::InterfaceTotals interface_totals(const FluidSolver &solver, std::span<const Vec<2>> start,
                                         std::span<const Vec<2>> end);

/// Centre line of a coupled wall that hangs down like a gate: an outline that runs down one face and
/// up the other. Other coupled walls have none.
class CentreLine {
public:
  explicit CentreLine(const Walls &walls);
  bool exists() const { return !line_.empty(); }
  /// True beyond the plate: past its face above the tip, past the tip below it.
  bool is_past(const Vec<2> &x) const;
  /// Free end [m].
  Vec<2> tip() const { return line_.back(); }

private:
  std::vector<Vec<2>> line_; // from the clamp to the tip
};

/// Height of the lowest wall at x that has the fluid above it [m], if there is one.
std::optional<double> floor_at(const Walls &walls, double x);

/// Height of the water column at x that stands on `floor` [m]: its top point plus half a spacing;
/// the floor itself where it is dry. Without a floor: of the lowest column, NaN where there is none.
double water_level(const Points &points, double x, double spacing, std::optional<double> floor);

} // namespace sluice::fluid
