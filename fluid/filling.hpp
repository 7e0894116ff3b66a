// SPDX-License-Identifier: MIT
// The fluid at t = 0: points on a lattice inside a given outline, or wherever fluid that is poured
// in at a place would rise to.
#pragma once

#include "fluid/fluid_params.hpp"
#include "fluid/points.hpp"
#include "fluid/walls.hpp"

namespace sluice::fluid {

/// Points inside water_m, or, where fill_from_m is given, on all places that a flood from there
/// reaches below fill_level_m without crossing a wall; with the start's velocity and hydrostatic
/// pressure. Throws UserError on an outline without points and on a flood that runs out of the
/// scene, with place and numbers.
template <int dim> Points<dim> fill(const FluidParams<dim> &params, const Walls<dim> &walls);

/// Volume of what water_m encloses [m^3; in the plane m^2]; 0 where the fluid was flooded in.
template <int dim> double outlined_volume(const FluidParams<dim> &params);

/// Throws UserError if the outline of the fluid has a place below its surface without a wall.
template <int dim>
void check_holes(const FluidParams<dim> &params, const Walls<dim> &walls,
                 const Points<dim> &points);

} // namespace sluice::fluid
