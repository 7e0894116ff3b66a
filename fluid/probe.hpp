// SPDX-License-Identifier: MIT
// Velocity and pressure at given places, from the points around them: a quadratic weighted
// least-squares fit whose value at the place is unknown too, walls entering with their velocity.
#pragma once

#include "bridge/base/csv.hpp"
#include "fluid/step.hpp"

#include <filesystem>
#include <string>
#include <vector>

namespace sluice::fluid {

/// What a probe reads; not a number where no fluid is near.
struct Reading {
  Vec<2> velocity{0, 0}; // [m/s]
  double pressure = 0;   // [Pa]
};

/// Exact for quadratic fields. Needs a frozen cloud.
Reading read_at(const FluidSolver &solver, const Vec<2> &place);

/// probe_NAME.csv: all places of one line at every output time.
class ProbeOutput {
public:
  ProbeOutput(const ProbeParams &params, const std::filesystem::path &folder);
  void write(const FluidSolver &solver, double time);

private:
  ProbeParams params_;
  CsvWriter csv_;
};

} // namespace sluice::fluid
