// SPDX-License-Identifier: MIT
// Rows of the viscous operator of a frozen cloud: what each neighbour's and each wall's velocity
// weighs, before any viscosity is known.
//
//   interior  quadratic fit with the walls as data (no-slip): Laplacian and gradient; next to walls
//             that slip one fit per direction: the wall's velocity holds for the component along
//             its normal, no change across it for the others,
//   surface   quadratic fit of all components together that holds the traction-free conditions
//             t . 2E n = 0 and div u = 0 half a spacing outside the point,
//   thin      pairs of points act along their line: momentum and angular momentum are kept, no
//             traction on either side.
#pragma once

#include "fluid/cloud.hpp"
#include "fluid/pressure.hpp"
#include "fluid/rheology.hpp"

#include <array>
#include <vector>

namespace sluice::fluid {

template <int dim> Mat<dim> outer(const Vec<dim> &a, const Vec<dim> &b) {
  return a * b.transpose();
}

/// How the rows of the viscous operator were made, for the run report.
struct ViscousRowCounts {
  int quadratic = 0; // interior: quadratic fit
  int linear = 0;    // interior, fallback: renormalised (LDD) Laplacian, positive weights
  int surface = 0;   // surface: traction-free quadratic fit
  int pairs = 0;     // thin, and fallback of the surface: central forces between pairs
};

/// Whether one number per neighbour serves all components, and where it stands.
enum class ViscousRowForm : std::uint8_t {
  scalar,    // in `laplacian`
  blocks,    // in `block`: a matrix per neighbour
  pressures, // in the pressure's matrix: a Newtonian fluid away from walls and surfaces
};

/// Weights of one wall projection in the rows of its point.
template <int dim> struct ViscousWallWeight {
  double laplacian = 0;                 // [1/m^2], scalar rows
  Mat<dim> block = Mat<dim>::Zero();    // [1/m^2], rows of blocks
  Vec<dim> gradient = Vec<dim>::Zero(); // [1/m]
  double viscosity = 0;                 // mean of the point's and the wall's [Pa s]
};

template <int dim> struct ViscousRows {
  std::vector<int> start; // of each point's neighbours in the three arrays below; none: `pressures`
  std::vector<ViscousRowForm> form;
  std::vector<double> laplacian;  // [1/m^2], scalar rows
  std::vector<Vec<dim>> gradient; // [1/m]
  std::vector<Mat<dim>> block;    // [1/m^2], rows of blocks: of the components together
  std::vector<std::array<ViscousWallWeight<dim>, most_projections<dim>>>
      wall_weights; // per wall slot
  const SlicedMatrix *pressure_matrix = nullptr;
  double pressure_scale = 0; // from its entries to Laplacians [1/m^2]
  ViscousRowCounts count;
};

/// Builds the rows; once per step. Away from walls and surfaces they are those of the pressure,
/// whose operators must be assembled; a Newtonian fluid, whose law does not look at gradients, gets
/// none of its own there.
template <int dim>
void build_viscous_rows(const Points<dim> &points, const Cloud<dim> &cloud,
                        const Rheology &rheology, const PressureProblem<dim> &pressure,
                        ViscousRows<dim> &rows);

} // namespace sluice::fluid
