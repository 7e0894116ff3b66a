// SPDX-License-Identifier: MIT
// One participant's stderr: passed on to the terminal when asked, kept as lines in its log, the
// last ones remembered for the report of a failure.
//
// On a terminal the participant writes into a pseudo-terminal, so that it still draws its progress
// bar; of a line that is redrawn by carriage returns the log keeps the last state only.
#pragma once

#include <deque>
#include <filesystem>
#include <string>

namespace sluice::launcher {

enum class Shown { no, yes };

class LogRelay {
public:
  /// Makes the log file (emptied) and the channel. Throws UserError when the log cannot be written.
  LogRelay(const std::filesystem::path &log, Shown shown);
  ~LogRelay();
  LogRelay(const LogRelay &) = delete;
  LogRelay &operator=(const LogRelay &) = delete;

  int read_end() const { return read_end_; }   ///< poll this; -1 once the writers are gone
  int write_end() const { return write_end_; } ///< the participant's stderr
  int log() const { return log_; }             ///< the participant's stdout
  void close_write_end();                      ///< in this process, after the fork

  /// Reads what is there without waiting; closes the read end at end of file.
  void pump();
  /// The last message: from the last line that starts with "<program>:" on, or else the last line.
  std::string last_message(const std::string &program) const;

private:
  void open_channel();
  void take(char c);
  void finish_line();

  Shown shown_;
  int read_end_ = -1, write_end_ = -1, log_ = -1;
  std::string line_;
  bool restart_line_ = false; ///< a carriage return came: the next character starts over
  std::deque<std::string> recent_;
};

} // namespace sluice::launcher
