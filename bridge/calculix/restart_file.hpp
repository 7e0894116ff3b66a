// SPDX-License-Identifier: MIT
// The restart file of ccx (.rout): the only result file with all digits. What ccx prints has 7
// (.dat) or 6 (.frd), a binary .frd is in single precision; a coupling that is converged to 1e-4
// of a window's small increment needs more.
//
// The file is a sequence of Fortran records, each between two 4-byte lengths. The sizes of the
// model come first; displacements and velocities are found as the pair of records whose lengths,
// together with those of the two records before them (names of materials, materials of elements),
// no others have. Source: restartwrite.f of CalculiX 2.20.
#pragma once

#include "bridge/calculix/interface.hpp"

#include <filesystem>

namespace sluice::calculix {

struct Motion {
  NodeField displacement; ///< [m]
  NodeField velocity;     ///< [m/s]
  double time = 0;        ///< [s] since the start of the first step
};

/// The state at the end of the only step in `file`. Throws UserError when the file is cut short, is
/// not laid out as described, or holds a value that is not finite (naming the node).
Motion read_restart_file(const std::filesystem::path &file);

} // namespace sluice::calculix
