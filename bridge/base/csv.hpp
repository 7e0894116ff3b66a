// SPDX-License-Identifier: MIT
// A time series on disk: one header line, one row per sample. A run which is cut short leaves what
// it has computed; only a row that came within a tenth of a second of an earlier one may be
// missing.
#pragma once

#include "bridge/base/check.hpp"

#include <chrono>
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
  /// Appends one row, with as many digits as it takes to read the same doubles back.
  void row(std::initializer_list<double> values) { row(std::span(values.begin(), values.size())); }
  void row(std::span<const double> values) {
    std::string line;
    for (const double v : values)
      fmt::format_to(std::back_inserter(line), "{}{}", line.empty() ? "" : ",", v);
    out_ << line << '\n';
    if (const auto now = Clock::now(); now - flushed_ > std::chrono::milliseconds(100)) {
      out_.flush();
      flushed_ = now;
    }
    check(out_.good(), "{}: writing failed; is the disk full?", name_);
  }

private:
  using Clock = std::chrono::steady_clock;
  std::string name_;
  std::ofstream out_;
  Clock::time_point flushed_; // the epoch: the first row is seen at once
};

} // namespace sluice
