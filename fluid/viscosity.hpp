// SPDX-License-Identifier: MIT
// Viscous diffusion of the velocity, rho Du/Dt = div(2 mu E), on a frozen cloud.
//
//   interior  mean-viscosity Laplacian plus the transpose term,
//             sum_j a_ij (mu_i + mu_j)/2 (u_j - u_i) + (grad u)^T grad mu,
//   open      the rows' blocks times the mean viscosity (viscous_rows.hpp).
//
// The step is implicit unless viscosity reaches less than a seventh of a spacing in it; then the
// same rows act once, explicitly.
#pragma once

#include "fluid/bicgstab.hpp"
#include "fluid/cloud.hpp"
#include "fluid/multigrid.hpp"
#include "fluid/rheology.hpp"
#include "fluid/viscous_rows.hpp"

#include <span>
#include <vector>

namespace sluice::fluid {

/// Memory of the viscous solve, kept between steps.
template <int dim> struct ViscousProblem {
  std::vector<double> viscosity;           // [Pa s], per point
  std::vector<Mat<dim>> velocity_gradient; // [1/s], walls included; what the law has seen last

  ViscousRows<dim> rows;

  SparseMatrix matrix, scalar_matrix; // of all components, interleaved; of one, for multigrid
  ScaledMatrix scaled, scalar_scaled;
  Multigrid multigrid;
  KrylovMemory memory;
  double relative_tolerance = 1e-8;               // of the linear solves
  std::vector<double> source, solution, previous; // [m/s], interleaved
};

/// dt nu / spacing^2 of a Newtonian fluid; infinity for others.
double viscous_number(const Rheology &rheology, double density, double dt, double spacing);
/// Whether a Newtonian fluid's viscosity [Pa s] is so low that its step is explicit.
bool is_explicit(const Rheology &rheology, double density, double dt, double spacing);

struct ViscousResult {
  int iterations = 0; // of the linear solver
  int passes = 0;     // over the viscosity law; 0: explicit
};

/// Diffuses `velocity` [m/s] over `dt` [s] in a fluid of the given density [kg/m^3]; walls move
/// with their velocity. The law is evaluated anew until the velocity changes by less than its
/// tolerance, for the first time at `expected` [m/s], what the velocity may be afterwards: the
/// better it is, the fewer passes. Throws UserError when a solve does not converge.
template <int dim>
ViscousResult diffuse_velocity(const Points<dim> &points, const Walls<dim> &walls,
                               const Cloud<dim> &cloud, const Rheology &rheology, double density,
                               double dt, VecView<dim> expected, VecSpan<dim> velocity,
                               ViscousProblem<dim> &problem);

/// Shear rate sqrt(2 E : E) [1/s] of a velocity gradient.
template <int dim> double shear_rate(const Mat<dim> &gradient);

} // namespace sluice::fluid
