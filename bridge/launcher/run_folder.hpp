// SPDX-License-Identifier: MIT
// The folder that a run leaves: which files are ours, a clean start, and one ParaView collection
// for the whole scene.
#pragma once

#include <filesystem>
#include <span>
#include <string>

namespace sluice::launcher {

/// Makes `folder`, removes what an earlier run left there (only files of a run, nothing else: a
/// failed run must not be judged by the series of the one before), and keeps a copy of the case
/// file as `case.toml`. Throws UserError when the folder cannot be written.
void prepare_run_folder(const std::filesystem::path &folder, const std::string &name,
                        const std::filesystem::path &case_file);

/// Writes `<folder>/<name>.pvd` from the collections fluid.pvd, wall.pvd and solid.pvd that are
/// there; each becomes one part. Returns the file, or an empty path when there is no collection.
std::filesystem::path combine_collections(const std::filesystem::path &folder,
                                          const std::string &name);

} // namespace sluice::launcher
