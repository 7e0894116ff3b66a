// SPDX-License-Identifier: MIT
// Iterations per window of every scheme on the added-mass tube, as a Markdown table: mean
// (largest). A run that does not converge ends with the scheme's error, shown as "failed" with its
// window. Usage: implicit_benchmark
#include "tests/support/tube_run.hpp"

#include <fmt/format.h>

#include <cmath>

using namespace sluice::bridge;

namespace {

BridgeSettings parallel(BridgeSettings settings) {
  settings.scheme = "parallel-implicit";
  settings.force_measure = "value";
  settings.force_tolerance = 1e-6;
  return settings;
}

std::string cell(const TubeResult &result, double reference) {
  if (!result.error.empty())
    return "failed, " + result.error.substr(0, result.error.find(' ', 7));
  const double error = std::abs(result.sum_y - reference) / std::abs(reference);
  return fmt::format("{:.2f} ({}){}", result.mean, result.most,
                     error < 1e-5 ? "" : fmt::format(", off by {:.0e}", error));
}

} // namespace

int main() {
  const std::vector<std::pair<std::string, BridgeSettings>> schemes{
      {"no acceleration", tube_settings("constant", 1, 0)},
      {"constant 0.5", tube_settings("constant", 0.5, 0)},
      {"constant 0.1", tube_settings("constant", 0.1, 0)},
      {"Aitken 0.5", tube_settings("aitken", 0.5, 0)},
      {"Aitken 0.1", tube_settings("aitken", 0.1, 0)},
      {"IQN-ILS, no reuse", tube_settings("iqn-ils", 0.1, 0)},
      {"IQN-ILS, 8 windows", tube_settings("iqn-ils", 0.1, 8)},
      {"IQN-ILS, 8 windows, filter 1e-2", tube_settings("iqn-ils", 0.1, 8, 1e-2)},
      {"IQN-ILS, 8 windows, filter 1e-6", tube_settings("iqn-ils", 0.1, 8, 1e-6)},
      {"IQN-IMVJ, 8 windows", tube_settings("iqn-imvj", 0.1, 8)},
      {"IQN-IMVJ, 40 windows, filter 1e-6", tube_settings("iqn-imvj", 0.1, 40, 1e-6)},
      {"parallel, IQN-ILS, 8 windows", parallel(tube_settings("iqn-ils", 0.1, 8))},
      {"parallel, IQN-IMVJ, 8 windows", parallel(tube_settings("iqn-imvj", 0.1, 8))}};
  fmt::print("| scheme |");
  for (const auto &[ratio, reference] : Tube::references())
    fmt::print(" R = {} |", ratio);
  fmt::print("\n|---|---|---|---|---|---|---|\n");
  for (const auto &[name, settings] : schemes) {
    fmt::print("| {} |", name);
    for (const auto &[ratio, reference] : Tube::references())
      fmt::print(" {} |", cell(run_tube(ratio, settings), reference));
    fmt::print("\n");
  }
}
