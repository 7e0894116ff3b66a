// SPDX-License-Identifier: MIT
// summary.json of a run, made from the participants' own summaries (fluid_summary.json and
// solid_summary.json) and what only the launcher knows: how each program
// ended, wall and CPU time. Scripts rely on its keys; one that does not apply to a run is null.
#pragma once

#include "bridge/launcher/supervisor.hpp"

#include <filesystem>
#include <string>
#include <vector>

namespace sluice::launcher {

struct RunDescription {
  std::string case_name;
  std::string case_file;
  std::vector<std::string> overrides;
  int threads = 0;
  std::string started; ///< UTC, ISO 8601
};

/// Writes DIR/summary.json; returns whether the run is complete: every participant ended with
/// status 0 and none of the partial summaries says otherwise or is broken (participants.X.note).
bool write_summary(const std::filesystem::path &folder, const RunDescription &description,
                   const RunOutcome &outcome);

} // namespace sluice::launcher
