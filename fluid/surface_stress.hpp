// SPDX-License-Identifier: MIT
// Normal viscous stress at the free surface: where no traction acts, p = 2 mu n . E n.
#pragma once

#include "fluid/cloud.hpp"
#include "fluid/points.hpp"

#include <span>
#include <vector>

namespace sluice::fluid {

/// The surface points of a cloud, numbered on their own; memory that is kept between steps.
struct SurfacePoints {
  std::vector<int> point;     // of each number
  std::vector<int> number;    // of each point, -1: not at the surface
  std::vector<double> change; // of the pressure, per number [Pa]
};

/// Sets points.surface_pressure [Pa] of the surface points, and zero elsewhere. In a solenoidal
/// flow n . E n is the rate at which the surface contracts, which a fit with neighbours on one side
/// only holds well. The pressure that follows from a velocity u* changes that velocity in the same
/// step: a surface wave of number k by -2 nu k^2 dt of it. Taken from u* alone the change
/// overshoots where nu dt k^2 > 1/2; so the change of p against the last step solves
///
///   (1 - 2 dt div_s nu grad_s) dp = 2 mu n . E(u*) n - p_last
///
/// along the surface, by which p fits the velocity that it leads to (derived here for waves that
/// are short against the depth). Where factor mu / spacing^2 is below 0.01 nothing overshoots, and
/// the change is the right-hand side itself. `viscosity` [Pa s] per point, `velocity` u* [m/s],
/// `factor`: step over density [s m^3/kg].
template <int dim>
void update_surface_pressure(const Cloud<dim> &cloud, std::span<const double> viscosity,
                             VecView<dim> velocity, double factor, Points<dim> &points,
                             SurfacePoints &surface);

} // namespace sluice::fluid
