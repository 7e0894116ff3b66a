// SPDX-License-Identifier: MIT
// Walls that move by a prescribed law.
#pragma once

#include "fluid/formula.hpp"
#include "fluid/walls.hpp"

#include <vector>

namespace sluice::fluid {

/// The displacement of one wall's vertices as a function of their place at t = 0 and of the time.
template <int dim> struct PrescribedWall {
  int first = 0;                 // of its vertices
  std::vector<Vec<dim>> at_rest; // [m], without displacement
  Formula<dim> displacement;     // [m]
  std::vector<Vec<dim>> sliding; // [m/s], on top: a belt that runs along itself
};

/// Puts the prescribed walls where they are at `time` + `dt`, with the mean velocity of that step.
template <int dim>
void move_walls(const std::vector<PrescribedWall<dim>> &prescribed, double time, double dt,
                Walls<dim> &walls);

} // namespace sluice::fluid
