// SPDX-License-Identifier: MIT
// Runs the program ccx on one input file and finds out whether it did what it was asked for.
//
// Its exit status says little: 2.20 ends with 0 when its input cannot be opened. A run counts
// as good when it ended with status 0, wrote no *ERROR, said "Job finished", and left a restart
// file.
#pragma once

#include "bridge/base/check.hpp"

#include <filesystem>
#include <string>

namespace sluice::calculix {

/// ccx found no equilibrium: under another load, or in a shorter window, it may. `what()` has its
/// words.
class Diverged : public UserError {
public:
  using UserError::UserError;
};

struct CcxCost {
  long runs = 0;
  double seconds = 0;     ///< [s] wall time
  double cpu_seconds = 0; ///< [s] CPU time of ccx, its start included
};

class Ccx {
public:
  /// `program` is a path, or a name that is looked for on PATH; ccx runs in `folder` with `threads`
  /// threads. Throws UserError when there is no such program.
  Ccx(const std::string &program, int threads, std::filesystem::path folder);

  /// Runs `job`.inp; its output goes to `job`.log, its state to `job`.rout. Throws Diverged, or
  /// UserError for any other failure, naming `task` ("window 3 (t = 4e-4 to 6e-4 s)"), what ccx
  /// said, and its files.
  void run(const std::string &job, const std::string &task);

  const CcxCost &cost() const { return cost_; }
  const std::filesystem::path &program() const { return program_; }
  const std::filesystem::path &folder() const { return folder_; }

private:
  std::filesystem::path program_;
  int threads_;
  std::filesystem::path folder_;
  CcxCost cost_;
};

} // namespace sluice::calculix
