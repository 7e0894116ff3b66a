// SPDX-License-Identifier: MIT
// The share of the last pressure that a stiff step leaves in the velocity.
//
// The projection finds the whole pressure anew, by a compact Laplacian; the viscous step has used
// the last pressure through gradient and divergence of the points. Where a step is long against the
// time of viscosity between points, s = dt nu / spacing^2 >> 1, pressures are of order mu, and what
// these operators make of them differs by more than the velocity itself. There the projection only
// corrects: the velocity keeps the share beta of the last pressure,
//
//   u* = u_viscous + (1 - beta) dt/rho grad p_last,    beta = s^2 / (1 + s^2),
//   L (p - beta p_last) = rho/dt (D u* - theta),       u = u* - dt/rho (grad p - beta grad p_last),
//
// and the next step knows p - beta mu (D u* - theta): without this term the pressure of a creeping
// flow would take s (width / spacing)^2 steps to build up. Left out
// by default in a fluid with a free surface, where it threw a film with s = 25 apart (589 points
// lost; shares of zero at the surface alone are worse). It is averaged over a point's surroundings,
// with the point's viscosity or the harmonic mean of all, whichever is less: a plug that slides on
// a thin layer answers to its pressure by the layer's viscosity. Source: L. J. P. Timmermans, P. D.
// Minev, F. N. van de Vosse, Int. J. Numer. Meth. Fluids 22 (1996) 673; J. L. Guermond, J. Shen,
// Math. Comp. 73 (2004) 1719 (for beta = 1).
#pragma once

#include "fluid/pressure.hpp"

#include <span>
#include <vector>

namespace sluice::fluid {

/// One step's, per point; empty in a fluid without an implicit viscosity.
template <int dim> struct CarriedPressure {
  std::vector<double> share;      // beta
  std::vector<Vec<dim>> velocity; // [m/s], -beta dt/rho grad p_last: what u* has kept
  std::vector<double> correction; // [Pa], of what the next step knows
  std::vector<double> smoothing;  // [Pa]
  double new_share = 1;           // of the pressure's sources that the step adds, by their size

  bool exists() const { return !share.empty(); }
  void clear() {
    share.clear();
    new_share = 1;
  }
};

/// The shares in a step of viscosity [Pa s], `factor` = dt / density [s m^3/kg], and what they keep
/// of `by_pressure` = -dt/rho grad p_last [m/s]. Points that emerge keep nothing.
template <int dim>
void share_pressure(std::span<const double> viscosity, const Cloud<dim> &cloud, double factor,
                    VecView<dim> by_pressure, CarriedPressure<dim> &carried);

/// Adds beta p_last to sources and wall data of an assembled problem, whose solution then is the
/// whole pressure, and computes the correction from the problem's velocity gradients.
template <int dim>
void add_carried_pressure(const Points<dim> &points, const Cloud<dim> &cloud,
                          std::span<const double> viscosity,
                          std::span<const double> target_divergence, CarriedPressure<dim> &carried,
                          PressureProblem<dim> &problem);

/// Makes of the step's pressure that which the next one knows: corrected, and without what
/// neighbours differ by beyond the mean of their gradients. Gradients of points do not see that
/// part, so that no later step would take it away; it is zero for quadratic fields.
template <int dim>
void settle_pressure(const Cloud<dim> &cloud, CarriedPressure<dim> &carried, Points<dim> &points);

} // namespace sluice::fluid
