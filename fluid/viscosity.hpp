// SPDX-License-Identifier: MIT
// Implicit viscous diffusion of the velocity:
//   (1 - dt nu L) u = u^n,  L the renormalised Laplacian with the wall projections as neighbours,
// of the wall's velocity where it holds the fluid, of the point's own where it slips (no traction).
// It acts before gravity is added, so that water at rest stays at rest. Open points (surface, thin)
// keep their velocity: a one-sided Laplacian would be worse than none.
#pragma once

#include "fluid/bicgstab.hpp"
#include "fluid/cloud.hpp"

#include <array>
#include <span>
#include <vector>

namespace sluice::fluid {

/// Memory of the viscous solve, kept between steps.
template <int dim> struct ViscousProblem {
  SparseMatrix matrix; // rows scaled to 1 + ...: entries of order max(1, dt nu / spacing^2)
  ScaledMatrix scaled;
  std::array<std::vector<double>, dim> source, solution; // [m/s], per component
};

/// Diffuses `velocity` [m/s] over `dt` [s] with kinematic viscosity `nu` [m^2/s]; returns the
/// iterations needed, all components together. Throws UserError when the solver does not converge.
template <int dim>
int diffuse_velocity(const Points<dim> &points, const Walls<dim> &walls, const Cloud<dim> &cloud,
                     double nu, double dt, VecSpan<dim> velocity, ViscousProblem<dim> &problem,
                     KrylovMemory &memory);

} // namespace sluice::fluid
