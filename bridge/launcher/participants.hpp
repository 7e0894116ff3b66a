// SPDX-License-Identifier: MIT
// Which programs a case needs. The tables of the case file decide: [fluid] starts sluice-fluid,
// [solid] starts sluice-solid where the fluid has a wall that it moves; the key `program` in a
// table names another one, such as "sluice-calculix". Every program is called twice:
//
//   PROGRAM CASE.toml [--set TABLE.KEY=VALUE]... --check   (reads all, computes and writes nothing)
//   PROGRAM CASE.toml [--set ...]... [--restart FILE] --out DIR
//
// --set and --restart are passed on only where the user gives them.
#pragma once

#include "bridge/base/config.hpp"

#include <filesystem>
#include <string>
#include <vector>

namespace sluice::launcher {

struct Participant {
  std::string name;              ///< the table in the case file, the stem of its log and summary
  std::filesystem::path program; ///< absolute path of an executable file
};

/// What the launcher itself needs from the case file.
struct Case {
  std::string name; ///< names the run folder and the ParaView file
};

/// The tables and the case's name; throws UserError for an unknown table or a missing name.
Case read_case(const Config &config);

/// The participants of the case in starting order. Programs are looked for in `folder` when it is
/// given, otherwise beside this executable and in the build tree that it lies in.
/// Throws UserError when the case has no fluid or a program is not there.
std::vector<Participant> participants_of(const Config &config, const std::filesystem::path &folder);

} // namespace sluice::launcher
