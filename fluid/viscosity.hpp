// SPDX-License-Identifier: MIT
// Viscous diffusion of the velocity, rho Du/Dt = div(2 mu E), on a frozen cloud.
//
//   interior  mean-viscosity Laplacian plus the transpose term,
//             sum_j a_ij (mu_i + mu_j)/2 (u_j - u_i) + (grad u)^T grad mu,  walls as data
//             (no-slip),
//   surface   quadratic fit of all components together that holds the traction-free conditions
//             t . 2E n = 0 and div u = 0 half a spacing outside the point,
//   thin      pairs of points act along their line: momentum and angular momentum are kept, no
//             traction on either side.
//
// The step is implicit unless viscosity reaches less than a seventh of a spacing in it; then the
// same rows act once, explicitly.
#pragma once

#include "fluid/bicgstab.hpp"
#include "fluid/cloud.hpp"
#include "fluid/multigrid.hpp"
#include "fluid/pressure.hpp"
#include "fluid/rheology.hpp"

#include <array>
#include <span>
#include <vector>

namespace sluice::fluid {

/// How the rows of the viscous operator were made, for the run report.
struct ViscousRowCounts {
  int quadratic = 0; // interior: quadratic fit
  int linear = 0;    // interior, fallback: renormalised (LDD) Laplacian, positive weights
  int surface = 0;   // surface: traction-free quadratic fit
  int pairs = 0;     // thin, and fallback of the surface: central forces between pairs
};

/// Weights of one wall projection in the rows of its point.
template <int dim> struct ViscousWallWeight {
  double laplacian = 0;                 // [1/m^2]
  Vec<dim> gradient = Vec<dim>::Zero(); // [1/m]
  double viscosity = 0;                 // mean of the point's and the wall's [Pa s]
};

/// Memory of the viscous solve, kept between steps.
template <int dim> struct ViscousProblem {
  std::vector<double> viscosity;           // [Pa s], per point
  std::vector<Mat<dim>> velocity_gradient; // [1/s], walls included; what the law has seen last

  std::vector<int> start;         // of each point's neighbours in the three arrays below
  std::vector<double> laplacian;  // [1/m^2], scalar rows
  std::vector<Vec<dim>> gradient; // [1/m]
  std::vector<Mat<dim>> block;    // [1/m^2], open rows: of the components together
  std::vector<std::array<ViscousWallWeight<dim>, most_projections<dim>>>
      wall_weights; // per wall slot
  ViscousRowCounts rows;

  SparseMatrix matrix, scalar_matrix; // of all components, interleaved; of one, for multigrid
  ScaledMatrix scaled, scalar_scaled;
  Multigrid multigrid;
  KrylovMemory memory;
  double relative_tolerance = 1e-8;               // of the linear solves
  std::vector<double> source, solution, previous; // [m/s], interleaved
};

/// Stencils of a frozen cloud; once per step. Away from walls and surfaces they are those of the
/// pressure, whose operators must be assembled. A Newtonian fluid gets no gradients there: its law
/// does not look at them.
template <int dim>
void build_viscous_rows(const Points<dim> &points, const Cloud<dim> &cloud,
                        const Rheology &rheology, const PressureProblem<dim> &pressure,
                        ViscousProblem<dim> &problem);

struct ViscousResult {
  int iterations = 0; // of the linear solver
  int passes = 0;     // over the viscosity law; 0: explicit
};

/// Diffuses `velocity` [m/s] over `dt` [s] in a fluid of the given density [kg/m^3]; walls move
/// with their velocity. The law is evaluated anew until the velocity changes by less than its
/// tolerance. Throws UserError when a solve does not converge.
template <int dim>
ViscousResult diffuse_velocity(const Points<dim> &points, const Walls<dim> &walls,
                               const Cloud<dim> &cloud, const Rheology &rheology, double density,
                               double dt, VecSpan<dim> velocity, ViscousProblem<dim> &problem);

/// Shear rate sqrt(2 E : E) [1/s] of a velocity gradient.
template <int dim> double shear_rate(const Mat<dim> &gradient);

} // namespace sluice::fluid
