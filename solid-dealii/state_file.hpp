// SPDX-License-Identifier: MIT
// The solid's state as an HDF5 file, from which a run goes on with the same bits.
//
//   /            attributes: format, version, time_s, step, load_work_j
//   /state/      one dataset per vector of SolidState, in its numbering, SI units; the internal
//   modes
//                of the elements and the viscous stresses among them
#pragma once

#include "solid-dealii/ranks.hpp"
#include "solid-dealii/solid_state.hpp"

#include <cstddef>
#include <filesystem>
#include <vector>

namespace sluice::solid {

/// A state and the moment it belongs to.
struct SavedState {
  SolidState state;
  double time = 0;                 ///< [s]
  std::vector<std::byte> bridge{}; ///< of the participant, in the restart file of a coupled run
};

/// The file of this rank: `whole` for one, for several a name with rank and ranks, as the parts of
/// a body are read by as many ranks as wrote them.
std::filesystem::path state_file(const std::filesystem::path &whole, const Ranks &ranks);

/// Writes the file whole or not at all: under another name first, which is then changed.
/// Throws UserError if the folder cannot be written or the disk is full.
void write_state(const std::filesystem::path &file, const SavedState &saved);

/// Throws UserError if the file is missing, damaged or of another kind, or if its vectors have
/// other sizes than those of `like`: the state of the body that is to go on.
SavedState read_state(const std::filesystem::path &file, const SolidState &like);

} // namespace sluice::solid
