// SPDX-License-Identifier: MIT
// Starts the participants of a run as child processes and watches them until the last one has
// ended.
//
// When one fails, the others are left alone for a grace period: the bridge notices within its own
// deadline and a participant then ends with a message of its own, which is worth more than ours.
// After that they get SIGTERM, then SIGKILL. A signal to this process is passed on to all of them,
// and if this process dies the kernel sends them SIGTERM: no participant outlives its run.
#pragma once

#include "bridge/launcher/log_relay.hpp"

#include <filesystem>
#include <span>
#include <string>
#include <vector>

namespace sluice::launcher {

struct Command {
  std::string participant;
  std::filesystem::path program;
  std::vector<std::string> arguments;
  std::filesystem::path log;
  Shown shown = Shown::no;
};

struct Outcome {
  std::string participant;
  int exit_status = 0;      ///< of the program; 128 + signal when a signal ended it
  int signal = 0;           ///< that ended it, or 0
  bool was_stopped = false; ///< by us, because another participant failed or we were told to
  double cpu_time_s = 0;
  double peak_memory_mb = 0;
  std::string message; ///< what it said last
  bool ok() const { return exit_status == 0; }
  /// "exit status 1", "ended by signal 11 (Segmentation fault)", ...
  std::string how_it_ended() const;
};

struct RunOutcome {
  std::vector<Outcome> participants; ///< in the order in which they ended
  int signal = 0;                    ///< that this process was told to stop with, or 0
  double wall_time_s = 0;
  bool ok() const;
};

struct Deadlines {
  double grace_s = 10; ///< between the first failure and SIGTERM to the others
  double kill_s = 5;   ///< between SIGTERM and SIGKILL
};

/// Runs all commands at the same time, with this process's environment. Throws UserError when one
/// cannot be started; those already started are ended first.
RunOutcome run_together(std::span<const Command> commands, const Deadlines &deadlines);

} // namespace sluice::launcher
