// SPDX-License-Identifier: MIT
// Damping of velocity modes at the scale of the points. Collocated operators do not see a velocity
// that alternates from point to point: pressure cannot act against it, and rows of points part.
// The difference of two points beyond what their gradients explain,
//
//   e_ij = u_j - u_i - (G_i + G_j) . r_ij / 2,   du_i = dt rate sum_j W_ij e_ij / W_lattice,
//
// is zero for every quadratic field and of third order for smooth ones, but full for alternating
// ones. Antisymmetric in i and j with symmetric weights: linear momentum is kept (up to neighbours
// that a crowded list leaves out). Derived here; the idea is that of Rhie and Chow, AIAA J. 21
// (1983) 1525. A rate: independent of the step.
#pragma once

#include "fluid/cloud.hpp"

#include <span>

namespace sluice::fluid {

/// Adds the damping over `dt` [s] to `velocity` [m/s], computed from `reference` and its gradient
/// [1/s]; `rate` [1/s]. Points of kind `thin` take no part: spray flies freely.
template <int dim>
void damp_point_noise(const Points<dim> &points, const Cloud<dim> &cloud, VecView<dim> reference,
                      MatView<dim> gradient, double rate, double dt, VecSpan<dim> velocity);

} // namespace sluice::fluid
