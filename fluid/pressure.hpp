// SPDX-License-Identifier: MIT
// The pressure that makes the velocity solenoidal, on a frozen cloud.
//
//   interior  L p = rho/dt (D u* - theta),   n . grad p = rho/dt n . (u* - u_wall) at walls,
//   surface   p falls linearly to what acts outside half a spacing off the outermost points,
//   after     u = u* - dt/rho grad p.
//
// D sees the fluid alone; the jump at a wall is counted once, in the Neumann datum. A coupling
// iteration changes u_wall only, hence the right-hand side only.
#pragma once

#include "fluid/cloud.hpp"
#include "fluid/least_squares.hpp"
#include "fluid/sparse_matrix.hpp"

#include <array>
#include <cstdint>
#include <span>
#include <vector>

namespace sluice::fluid {

/// Coefficients of one projection in the rows of its point.
template <int dim> struct WallRow {
  double approach = 0;  // n . u* of the fluid at the wall, extrapolated [m/s]
  double laplacian = 0; // of the datum g in the point's Laplacian row, times spacing^2 [m]
  Vec<dim> gradient = Vec<dim>::Zero(); // of the datum g in the point's gradient [-]
  double datum = 0;                     // g = n . grad p [Pa/m], with the latest wall velocity
  double carried = 0;                   // of it, what u* has kept of the last pressure
};

/// How a row of the Laplacian was made.
enum class RowKind : std::uint8_t {
  quadratic, // the quadratic fit
  blended,   // sign guard: with as much of the next as its signs need
  linear,    // sign guard: renormalised (LDD) Laplacian instead
  plain,     // sign guard: positive weights without correction
  open,      // of an open point: no Laplacian
};

/// Is the gradient of the point that of the quadratic fit?
constexpr bool has_quadratic_gradient(RowKind kind) {
  return kind == RowKind::quadratic || kind == RowKind::blended;
}

/// Rows of each kind, for the run report.
struct RowCounts {
  int quadratic = 0, blended = 0, linear = 0, plain = 0, open = 0;

  int guarded() const { return blended + linear + plain; }

  int &of(RowKind kind) {
    switch (kind) {
    case RowKind::quadratic:
      return quadratic;
    case RowKind::blended:
      return blended;
    case RowKind::linear:
      return linear;
    case RowKind::plain:
      return plain;
    default:
      return open;
    }
  }
};

/// The discrete pressure problem of one step.
template <int dim> struct PressureProblem {
  SlicedMatrix matrix;                    // rows scaled by spacing^2: entries of order one
  std::vector<double> fluid_source;       // right-hand side without the wall velocity
  std::vector<double> source;             // right-hand side with it
  std::vector<Functionals<dim>> gradient; // of the derivatives per point
  std::vector<RowKind> row_kind;
  std::vector<std::array<WallRow<dim>, most_projections<dim>>> wall_rows; // per wall slot
  std::vector<Mat<dim>> velocity_gradient; // of u* [1/s], row: component
  std::vector<std::int32_t> is_air;        // memory of release_tension, as the next two
  std::vector<char> is_released;
  std::vector<int> released;
  RowCounts rows;
  bool has_open_point = false; // else pressure is known up to a constant
};

/// Operators of the pressure where the cloud allows both.
enum class PressureOperators : std::uint8_t {
  quadratic,    // Laplacian and gradient of second order from quadratic fits
  renormalised, // linear gradient and renormalised Laplacian: the method as published
};

struct PressureParams {
  double density = 1000; // [kg/m^3]
  PressureOperators operators = PressureOperators::quadratic;
  double row_guard = 0.1;     // largest ratio of negative to positive weights in a row
  double gradient_guard = 20; // largest norm of a gradient's functional, times the kernel radius
};

/// Assembles matrix and gradient functionals, which the cloud alone decides.
template <int dim>
void assemble_pressure_operators(const Points<dim> &points, const Cloud<dim> &cloud,
                                 const PressureParams &params, PressureProblem<dim> &problem);

/// Assembles the fluid source of these operators. `target_divergence` [1/s] per point is the rate
/// at which a cell shall grow (volume control); `dt` [s].
template <int dim>
void assemble_pressure_source(const Points<dim> &points, const Cloud<dim> &cloud,
                              const PressureParams &params, VecView<dim> predicted_velocity,
                              std::span<const double> target_divergence, double dt,
                              PressureProblem<dim> &problem);

/// Water next to air bears no tension: an interior point that touches an open one, or one that was
/// released in the last step, and whose row would pull its pressure below zero becomes open itself,
/// pressure zero, held by no wall. So a jet
/// separates from an edge and spray flies freely. Decided once per step, before the coupling
/// iterates (the map stays affine). Returns the number of points released.
template <int dim>
int release_tension(Points<dim> &points, const Walls<dim> &walls, const PressureParams &params,
                    VecView<dim> predicted_velocity, std::span<const double> target_divergence,
                    double dt, Cloud<dim> &cloud, PressureProblem<dim> &problem);

/// Sets the wall data and the right-hand side for the current wall velocity.
template <int dim>
void set_wall_velocity(const Walls<dim> &walls, const Cloud<dim> &cloud,
                       const PressureParams &params, double dt, PressureProblem<dim> &problem);

/// grad p at a point [Pa/m]: wall data and the surface's pressure included.
template <int dim>
Vec<dim> pressure_gradient(int i, const Points<dim> &points, const Cloud<dim> &cloud,
                           const PressureProblem<dim> &problem, std::span<const double> pressure);
/// The same at every point.
template <int dim>
void pressure_gradients(const Points<dim> &points, const Cloud<dim> &cloud,
                        const PressureProblem<dim> &problem, std::span<const double> pressure,
                        VecSpan<dim> gradient);

/// grad p at every point, of the pressure that the points carry from the last step, with the
/// operators of this one; the data at walls are those of the last gradient. What a step takes off a
/// velocity by this gradient and gives back by the next differs by the change of the pressure
/// alone, not by that of the operators.
template <int dim>
void carried_pressure_gradients(const Points<dim> &points, const Cloud<dim> &cloud,
                                const PressureProblem<dim> &problem, VecSpan<dim> gradient);

} // namespace sluice::fluid
