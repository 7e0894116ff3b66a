// SPDX-License-Identifier: MIT
// The adapter: runs the solid against its partner through the bridge. The only file here that
// knows the bridge's participant.
#pragma once

#include "bridge/base/config.hpp"
#include "solid-dealii/ranks.hpp"

#include <filesystem>

namespace sluice::bridge {
class Participant;
}

namespace sluice::solid {

/// Runs the case to its end, writing into `folder` once the partner is met. Throws UserError on any
/// failure, after the partner has been told and the summary of what was computed has been written.
/// On several ranks all of them call it, and the root speaks to the partner.
/// `restart`, unless empty: the restart file that the run goes on from, on as many ranks.
void run(const Config &config, const std::filesystem::path &folder,
         const std::filesystem::path &restart = {}, const Ranks &ranks = {});

/// The same with a participant that is already made (tests: one that speaks to a thread); null on
/// other ranks than the root.
void run(bridge::Participant *bridge, const Config &config, const std::filesystem::path &folder,
         const std::filesystem::path &restart = {}, const Ranks &ranks = {});

} // namespace sluice::solid
