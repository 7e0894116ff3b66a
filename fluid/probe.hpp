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
template <int dim> struct Reading {
  Vec<dim> velocity = Vec<dim>::Zero(); // [m/s]
  double pressure = 0;                  // [Pa]
};

/// Exact for quadratic fields. Needs a frozen cloud.
template <int dim> Reading<dim> read_at(const FluidSolver<dim> &solver, const Vec<dim> &place);

/// probe_NAME.csv: all places of one line at every output time.
template <int dim> class ProbeOutput {
public:
  ProbeOutput(const ProbeParams<dim> &params, const std::filesystem::path &folder);
  void write(const FluidSolver<dim> &solver, double time);

private:
  ProbeParams<dim> params_;
  CsvWriter csv_;
};

} // namespace sluice::fluid
