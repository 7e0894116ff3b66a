// SPDX-License-Identifier: MIT
#include "bridge/base/restart_files.hpp"

#include "bridge/base/check.hpp"

#include <algorithm>
#include <fmt/ranges.h>
#include <set>

namespace sluice {

namespace {

constexpr std::size_t kept = 2;

std::string prefix_of(const std::string &participant) { return "restart_" + participant + "_"; }

// The windows of which `participant` has a file.
std::set<long> windows_of(const std::filesystem::path &folder, const std::string &participant) {
  const std::string prefix = prefix_of(participant), suffix = ".h5";
  std::set<long> windows;
  for (const auto &entry : std::filesystem::directory_iterator(folder)) {
    const std::string name = entry.path().filename().string();
    if (name.size() <= prefix.size() + suffix.size() || !name.starts_with(prefix) ||
        !name.ends_with(suffix))
      continue;
    const std::string number =
        name.substr(prefix.size(), name.size() - prefix.size() - suffix.size());
    if (number.size() < 19 && std::all_of(number.begin(), number.end(), ::isdigit))
      windows.insert(std::stol(number));
  }
  return windows;
}

void remove_but_last(std::size_t most, const std::filesystem::path &folder,
                     const std::string &participant) {
  const std::set<long> windows = windows_of(folder, participant);
  std::size_t left = windows.size();
  for (const long window : windows)
    if (left-- > most)
      std::filesystem::remove(restart_file(folder, participant, window));
}

} // namespace

std::filesystem::path restart_file(const std::filesystem::path &folder,
                                   const std::string &participant, long window) {
  return folder / fmt::format("{}{:06d}.h5", prefix_of(participant), window);
}

void remove_older_restart_files(const std::filesystem::path &folder,
                                const std::string &participant) {
  remove_but_last(kept, folder, participant);
}

void remove_restart_files(const std::filesystem::path &folder, const std::string &participant) {
  remove_but_last(0, folder, participant);
}

void check_is_elsewhere(const std::filesystem::path &file, const std::filesystem::path &folder) {
  std::error_code error; // a file that is not there is found missing when it is read
  check(!std::filesystem::equivalent(std::filesystem::absolute(file).parent_path(), folder, error),
        "{}: a run cannot go on in the folder of the run it starts from; choose another --out",
        folder.string());
}

std::map<std::string, std::filesystem::path>
last_restart_files(const std::filesystem::path &folder, std::span<const std::string> participants) {
  check(std::filesystem::is_directory(folder), "{}: there is no such folder to restart from",
        folder.string());
  std::set<long> common;
  std::string present;
  for (const std::string &participant : participants) {
    const std::set<long> windows = windows_of(folder, participant);
    present += fmt::format("{} {}: {}", present.empty() ? "" : ",", participant,
                           windows.empty() ? "none" : fmt::format("{}", fmt::join(windows, " ")));
    std::set<long> both;
    std::set_intersection(common.begin(), common.end(), windows.begin(), windows.end(),
                          std::inserter(both, both.end()));
    common = &participant == participants.data() ? windows : both;
  }
  check(!common.empty(),
        "{}: no window of which every participant has left a restart file (restart_NAME_WINDOW.h5; "
        "windows of{}); the run needs bridge.restart_every_windows",
        folder.string(), present);
  std::map<std::string, std::filesystem::path> files;
  for (const std::string &participant : participants)
    files[participant] = restart_file(folder, participant, *common.rbegin());
  return files;
}

} // namespace sluice
