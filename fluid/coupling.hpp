// SPDX-License-Identifier: MIT
// The adapter: runs the fluid against its partner through the bridge, or alone with walls at rest.
#pragma once

#include "bridge/base/config.hpp"

#include <filesystem>
#include <string>

namespace sluice::fluid {

/// Reads all that a run would start from and says what that is. Throws UserError like `run`.
std::string describe(const Config &config);

/// Runs the case to its end, writing into `folder`. Throws UserError on any failure, after the
/// summary of what was computed has been written and the partner has been told.
/// `restart`, unless empty: the restart file that a coupled run goes on from.
void run(const Config &config, const std::filesystem::path &folder,
         const std::filesystem::path &restart = {});

} // namespace sluice::fluid
