// SPDX-License-Identifier: MIT
// Where restart files lie: OUT/restart_fluid_000120.h5 and OUT/restart_solid_000120.h5 belong to
// the end of window 120. Of each participant the last two are kept: whenever the run is killed, two
// of them belong together. A run removes at its start what another one left in its folder.
#pragma once

#include <filesystem>
#include <map>
#include <span>
#include <string>

namespace sluice {

/// The file of `participant` for the end of `window`.
std::filesystem::path restart_file(const std::filesystem::path &folder,
                                   const std::string &participant, long window);

/// Removes the restart files of `participant` in `folder` but the last two.
void remove_older_restart_files(const std::filesystem::path &folder,
                                const std::string &participant);

/// At the start of a run in `folder`, which another one may have used: its restart files would be
/// taken for this run's.
void remove_restart_files(const std::filesystem::path &folder, const std::string &participant);

/// Throws UserError where the run that left `file` wrote into `folder`: the run that goes on from
/// it would remove it.
void check_is_elsewhere(const std::filesystem::path &file, const std::filesystem::path &folder);

/// For each of `participants` its file, all of the last window of which all have one. Throws
/// UserError where there is none, with what is there.
std::map<std::string, std::filesystem::path>
last_restart_files(const std::filesystem::path &folder, std::span<const std::string> participants);

} // namespace sluice
