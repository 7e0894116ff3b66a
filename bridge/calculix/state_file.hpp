// SPDX-License-Identifier: MIT
// The solid's restart file where ccx is the solver: ccx's own, and the participant's state, in one
// HDF5 file.
//
//   /        attributes: format, version, time_s, windows
//   /ccx     bytes of window.rin, from which ccx goes on
//   /bridge  bytes of the participant's state, as it gave it
#pragma once

#include <cstddef>
#include <filesystem>
#include <vector>

namespace sluice::calculix {

struct SavedState {
  double time = 0;  ///< [s]
  long windows = 0; ///< accepted since the start
  std::vector<std::byte> ccx, bridge;
};

/// Writes the file whole or not at all: under another name first, which is then changed. Throws
/// UserError if the folder cannot be written or the disk is full.
void write_state(const std::filesystem::path &file, const SavedState &saved);

/// Throws UserError if the file is missing, damaged or of another kind.
SavedState read_state(const std::filesystem::path &file);

} // namespace sluice::calculix
