// SPDX-License-Identifier: MIT
// Interface balance from independent ends: the fluid's own sums against the solid's, window by
// window. Writes balance.csv, and keeps the largest relative difference for the run's statistics.
#pragma once

#include "bridge/base/csv.hpp"
#include "bridge/message.hpp"
#include "bridge/statistics.hpp"

#include <filesystem>
#include <map>
#include <optional>

namespace sluice::bridge {

/// One side's totals of one window, as they travel.
struct WindowTotals {
  long window = 0;
  InterfaceTotals totals;
  template <class Archive> void archive(Archive &a) { a(window, totals); }
};
void write_totals(PayloadWriter &write, const std::optional<WindowTotals> &totals);
std::optional<WindowTotals> read_totals(PayloadReader &read);

class BalanceLog {
public:
  explicit BalanceLog(std::filesystem::path file) : file_(std::move(file)) {}
  /// A window is compared as soon as both sides have reported it; the file appears with the first.
  void add_fluid(const WindowTotals &totals, Statistics &statistics);
  void add_solid(const WindowTotals &totals, Statistics &statistics);
  /// The reports that wait for the other side's.
  template <class Archive> void archive(Archive &a) { a(fluid_, solid_); }

private:
  void compare(long window, const InterfaceTotals &fluid, const InterfaceTotals &solid,
               Statistics &statistics);
  std::filesystem::path file_;
  std::optional<CsvWriter> csv_;
  std::map<long, InterfaceTotals> fluid_, solid_; // reported by one side only, so far
};

} // namespace sluice::bridge
