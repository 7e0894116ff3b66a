// SPDX-License-Identifier: MIT
// Normal viscous stress at the free surface: where no traction acts, p = 2 mu n . E n.
#pragma once

#include "fluid/cloud.hpp"
#include "fluid/points.hpp"

#include <span>
#include <vector>

namespace sluice::fluid {

/// Pressure of the fluid at its surface [Pa], per point; zero except at surface points. In a
/// solenoidal flow n . E n is the rate at which the surface contracts: the gradient along the
/// surface decides, which both sides of a fit with neighbours on one side only hold well. Averaged
/// over the surface points within the kernel's radius: what is as short as a spacing would feed on
/// itself, since the pressure acts a step after the viscosity. `viscosity` [Pa s] per point;
/// without one the result is empty.
template <int dim>
void surface_pressure(const Points<dim> &points, const Cloud<dim> &cloud,
                      std::span<const double> viscosity, VecView<dim> velocity,
                      std::vector<double> &pressure);

} // namespace sluice::fluid
