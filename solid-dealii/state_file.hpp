// SPDX-License-Identifier: MIT
// The solid's state as an HDF5 file, from which a run goes on with the same bits.
//
//   /            attributes: format, version, ranks, time_s, step, load_work_j
//   /state/      one dataset per vector of SolidState, in its numbering, SI units; the internal
//                modes of the elements and the viscous stresses among them; of a body on several
//                ranks their parts, one after the other
//   /bridge      in the restart file of a coupled run: the participant's state, as it gave it
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

/// Writes the file whole or not at all: under another name first, which is then changed. All ranks
/// call it, each with its part of the body; the root writes, and `saved.bridge` is the root's.
/// Throws UserError if the folder cannot be written or the disk is full.
void write_state(const std::filesystem::path &file, const SavedState &saved,
                 const Ranks &ranks = {});

/// This rank's part; `bridge` on the root. Throws UserError on all ranks if the file is missing,
/// damaged or of another kind, was written by another number of ranks, or if its vectors have other
/// sizes than those of `like`: the state of the body that is to go on.
SavedState read_state(const std::filesystem::path &file, const SolidState &like,
                      const Ranks &ranks = {});

} // namespace sluice::solid
