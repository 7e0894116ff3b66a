// SPDX-License-Identifier: MIT
// A time series on disk: one header line, one row per sample, flushed so that a run which is cut
// short leaves what it has computed.
#pragma once

#include "bridge/base/check.hpp"

#include <filesystem>
#include <fstream>
#include <initializer_list>
#include <span>
#include <string>

namespace sluice {

class CsvWriter {
public:
  /// Throws UserError when the file cannot be written. `header` names the columns with their units.
  CsvWriter(const std::filesystem::path &file, const std::string &header)
      : name_(file.string()), out_(file) {
    check(out_.good(), "{}: cannot be written; give another --out folder", name_);
    out_ << header << '\n' << std::flush;
  }
  /// Appends one row, 17 significant digits: reading it back gives the same doubles.
  void row(std::initializer_list<double> values) { row(std::span(values.begin(), values.size())); }
  void row(std::span<const double> values) {
    std::string line;
    for (const double v : values)
      fmt::format_to(std::back_inserter(line), "{}{:.17g}", line.empty() ? "" : ",", v);
    out_ << line << '\n' << std::flush;
    check(out_.good(), "{}: writing failed; is the disk full?", name_);
  }

private:
  std::string name_;
  std::ofstream out_;
};

} // namespace sluice
