// SPDX-License-Identifier: MIT
// The adapter: runs ccx against its partner through the bridge. The only file here that knows the
// bridge's participant.
#pragma once

#include "bridge/base/config.hpp"

#include <filesystem>

namespace sluice::bridge {
class Participant;
}

namespace sluice::calculix {

/// Runs the case to its end, writing into `folder` once the partner is met. Throws UserError on any
/// failure, after the partner has been told and the summary of what was computed has been written.
/// `restart`, unless empty: the restart file that the run goes on from.
void run(const Config &config, const std::filesystem::path &folder,
         const std::filesystem::path &restart = {});

/// The same with a participant that is already made (tests: one that speaks to a thread).
void run(bridge::Participant &bridge, const Config &config, const std::filesystem::path &folder,
         const std::filesystem::path &restart = {});

} // namespace sluice::calculix
