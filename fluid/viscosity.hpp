// SPDX-License-Identifier: MIT
// Implicit viscous diffusion of the velocity, no-slip at walls:
//   (1 - dt nu L) u = u^n,  L the renormalised Laplacian with the wall projections as neighbours.
// It acts before gravity is added, so that water at rest stays at rest. Open points (surface, thin)
// keep their velocity: a one-sided Laplacian would be worse than none.
#pragma once

#include "fluid/bicgstab.hpp"
#include "fluid/cloud.hpp"

#include <span>
#include <vector>

namespace sluice::fluid {

/// Memory of the viscous solve, kept between steps.
struct ViscousProblem {
  SparseMatrix matrix; // rows scaled to 1 + ...: entries of order max(1, dt nu / spacing^2)
  ScaledMatrix scaled;
  std::vector<double> source_x, source_y, x, y; // [m/s]
};

/// Diffuses `velocity` [m/s] over `dt` [s] with kinematic viscosity `nu` [m^2/s]; returns the
/// iterations needed, both components together. Throws UserError when the solver does not converge.
int diffuse_velocity(const Points &points, const Walls &walls, const Cloud &cloud, double nu,
                     double dt, std::span<Vec<2>> velocity, ViscousProblem &problem,
                     KrylovMemory &memory);

} // namespace sluice::fluid
