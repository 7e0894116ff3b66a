// SPDX-License-Identifier: MIT
// The fluid's state as an HDF5 file, from which a run goes on with the same bits.
//
//   /            attributes: format, version, spacing_m, time_s, and the counters of FluidState
//   /points/     one dataset per array of Points: [n, dim] or [n], SI units
//   /bridge      in the restart file of a coupled run: the participant's state, as it gave it
#pragma once

#include "fluid/points.hpp"

#include <cstddef>
#include <filesystem>
#include <vector>

namespace sluice::fluid {

/// A state, the moment it belongs to and the spacing that it was computed with.
template <int dim> struct SavedState {
  FluidState<dim> state;
  double time = 0;                 // [s]
  double spacing = 0;              // [m]
  std::vector<std::byte> bridge{}; // of the participant, in the restart file of a coupled run
};

/// Writes the file whole or not at all: under another name first, which is then changed.
/// Throws UserError if the folder cannot be written or the disk is full.
template <int dim>
void write_state(const std::filesystem::path &file, const SavedState<dim> &saved);

/// Throws UserError if the file is missing, damaged, of another kind, version or dimension, or if
/// its arrays disagree in length.
template <int dim> SavedState<dim> read_state(const std::filesystem::path &file);

} // namespace sluice::fluid
