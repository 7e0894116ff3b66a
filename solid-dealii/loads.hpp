// SPDX-License-Identifier: MIT
// Loads as nodal forces on all displacement components, and their sums.
#pragma once

#include "solid-dealii/discretisation.hpp"

namespace sluice::solid {

/// Pressure [Pa] of water at rest up to `level` [m]; zero above it.
struct Hydrostatic {
  double density = 1000; ///< [kg/m^3]
  double gravity = 9.81; ///< [m/s^2]
  double level = 0;      ///< [m]
  double operator()(double height) const {
    return height < level ? density * gravity * (level - height) : 0;
  }
};

/// Nodal forces [N] of a pressure on one side: f_a = -int p(X) N_a cof(F) N dA. The pressure stays
/// with the material point X; its direction and area follow `displacement`: zero for a dead load,
/// the current one for a follower load. Source: Nanson's formula, n da = cof(F) N dA.
template <int dim>
Eigen::VectorXd pressure_forces(const Discretisation<dim> &discretisation,
                                const std::vector<int> &faces, const Hydrostatic &pressure,
                                const Eigen::VectorXd &displacement);
template <int dim>
Eigen::VectorXd pressure_forces(const Discretisation<dim> &discretisation, Side side,
                                const Hydrostatic &pressure, const Eigen::VectorXd &displacement) {
  return pressure_forces(discretisation, discretisation.boundary(name_of(side)), pressure,
                         displacement);
}

/// Nodal forces [N] of a dead traction [Pa] per reference area on some faces, as a function of the
/// reference position [m].
template <int dim>
Eigen::VectorXd traction_forces(const Discretisation<dim> &discretisation,
                                const std::vector<int> &faces,
                                const std::function<Vec<dim>(const Vec<dim> &)> &traction);

/// Sums of a nodal load over the nodes, with the sums of magnitudes against which a difference is
/// judged. Two dimensions: per metre of depth.
template <int dim> struct LoadSums {
  Vec<dim> force = Vec<dim>::Zero(); ///< [N]
  Vec<3> moment = Vec<3>::Zero();    ///< [N m] about the origin, at positions X + `end`
  double work = 0;                   ///< [J] load . (end - start)
  double force_magnitude = 0;        ///< [N] sum |f|
  double moment_magnitude = 0;       ///< [N m] sum |x| |f|
  double work_magnitude = 0;         ///< [J] sum |f . (end - start)|
};

/// `start` and `end` are the displacements [m] of the step in which the load acted.
template <int dim>
LoadSums<dim> sum_loads(const Discretisation<dim> &discretisation, const Eigen::VectorXd &load,
                        const Eigen::VectorXd &start, const Eigen::VectorXd &end);

} // namespace sluice::solid
