// SPDX-License-Identifier: MIT
// The folder that a run leaves: one run at a time, which files are ours, a clean start, and one
// ParaView collection for the whole scene.
#pragma once

#include <filesystem>
#include <span>
#include <string>

namespace sluice::launcher {

/// The right to write into a folder, held against other launchers while this object lives. The
/// file `.sluice-lock` stays afterwards: it marks the folder as one that a run has made.
class FolderLock {
public:
  /// Throws UserError when another run holds the folder or the file cannot be written.
  explicit FolderLock(const std::filesystem::path &folder);
  ~FolderLock();
  FolderLock(FolderLock &&other) noexcept;
  FolderLock &operator=(FolderLock &&) = delete;

private:
  int file_;
};

/// Makes `folder` and locks it, removes what an earlier run left there (only files of a run,
/// nothing else: a failed run must not be judged by the series of the one before), and keeps a copy
/// of the case file as `case.toml`. The case file itself is never touched. Throws UserError when
/// the folder cannot be written, is in use, or holds files with a run's names that no run has put
/// there.
[[nodiscard]] FolderLock prepare_run_folder(const std::filesystem::path &folder,
                                            const std::string &name,
                                            const std::filesystem::path &case_file);

/// Writes `<folder>/<name>.pvd` from the collections fluid.pvd, wall.pvd and solid.pvd that are
/// there; each becomes one part. Returns the file, or an empty path when there is no collection.
std::filesystem::path combine_collections(const std::filesystem::path &folder,
                                          const std::string &name);

} // namespace sluice::launcher
