// SPDX-License-Identifier: MIT
// What holds the body, what is wetted, and what loads it without a partner: the boundary by parts.
#pragma once

#include "solid-dealii/loads.hpp"
#include "solid-dealii/params.hpp"

namespace sluice::solid {

/// The boundary of one body after its parameters.
struct Supports {
  std::vector<bool> fixed; ///< per displacement component
  std::vector<int> held;   ///< nodes of the clamped parts, ascending: where the reaction is summed
  std::vector<int> wetted; ///< faces that meet the partner, in ascending order
};

/// Without [[solid.boundary]]: clamped_side is clamped, near and far are symmetry planes, all other
/// sides of the box are wetted. Throws UserError for an unknown name (listing those there are), a
/// symmetry plane that is not normal to an axis, and a body that nothing holds.
template <int dim>
Supports supports_of(const Discretisation<dim> &discretisation, const SolidParams &params);

/// Nodal forces [N] of gravity and of the tractions of all parts.
template <int dim>
Eigen::VectorXd own_load(const Discretisation<dim> &discretisation, const SolidParams &params);

} // namespace sluice::solid
