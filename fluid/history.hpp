// SPDX-License-Identifier: MIT
// What a run leaves behind: one row per step in fluid.csv and fluid_loads.csv, fields and the state
// (fluid_state.h5, the latest) at intervals, and fluid_summary.json at the end, also of a run that
// failed.
#pragma once

#include "bridge/base/csv.hpp"
#include "fluid/diagnostics.hpp"
#include "fluid/output_vtk.hpp"
#include "fluid/probe.hpp"
#include "fluid/step_limit.hpp"

#include <filesystem>
#include <nlohmann/json_fwd.hpp>
#include <string>

namespace sluice::fluid {

template <int dim> class History {
public:
  /// Opens the files in `folder` and records the first state, whose time is `time` [s].
  History(const Scene<dim> &scene, const FluidSolver<dim> &solver, std::filesystem::path folder,
          double output_interval, double time = 0);

  /// Records the step that has just ended at `time` [s]; `loads` are those on the coupled walls.
  void record(const FluidSolver<dim> &solver, const bridge::InterfaceTotals &loads, double time);
  /// Counts what held the last step back.
  void count(const LimitedStep &step);
  /// Writes fluid_summary.json, and of a complete run the state; `message` is empty for such a run.
  void write_summary(const FluidSolver<dim> &solver, const std::string &message,
                     const nlohmann::json &bridge_summary) const;
  /// Short text for the progress line.
  std::string note() const;

private:
  void record_loads(const FluidSolver<dim> &solver, const bridge::InterfaceTotals &loads,
                    double time);
  void write_fields(const FluidSolver<dim> &solver, double time);
  void write_state_file(const FluidSolver<dim> &solver, double time) const;
  Vec<dim> force_on_all_walls(const FluidSolver<dim> &solver); // contact included [N]
  double energy_gain(const Integrals<dim> &now) const;         // since the start [J]
  void update_extremes(const FluidSolver<dim> &solver, const Integrals<dim> &now);

  std::filesystem::path folder_;
  std::vector<GaugeParams<dim>> gauges_;
  CsvWriter series_, loads_;
  std::vector<ProbeOutput<dim>> probes_;
  PointOutput points_;
  WallOutput walls_;
  double output_interval_, next_output_ = 0;
  Stopwatch watch_;

  // running sums
  double work_on_walls_ = 0, outlet_energy_ = 0, start_outlet_energy_ = 0, last_time_ = 0;
  EnergyChanges energy_changes_;
  Integrals<dim> start_, last_;
  long viscous_passes_ = 0, viscous_iterations_ = 0, viscosity_skipped_ = 0, near_walls_ = 0;
  long cells_ = 0, cells_cut_ = 0;
  long guarded_rows_ = 0, steps_ = 0, pressure_iterations_ = 0, pressure_solves_ = 0;
  double energy_scale_ = 0; // [J], kinetic and potential above the lowest point at the start
  double volume_drift_max_ = 0, energy_gain_max_ = -1e300;
  double initial_volume_ = 0;
  std::array<long, step_limit_names.size()> limits_{};
  double smallest_step_ = 1e300;
  WallQuadrature<dim> all_walls_;
  std::vector<Vec<dim>> all_tractions_;
};

} // namespace sluice::fluid
