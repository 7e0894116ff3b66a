// SPDX-License-Identifier: MIT
// What a run leaves behind: series window by window, fields, and the summary.
//
//   tip.csv           displacement of a box's free end: middle, front corner, back corner
//   probes.csv        displacement of every [[solid.probe]]
//   reactions.csv     force and moment of the supports on the body
//   solid_loads.csv   sums of the load vector of the window, at the accepted end of the window
//   solid_energy.csv  kinetic and strain energy, work of the loads since the start
//   solid.pvd         fields for ParaView, every output_interval
//   solid_state.h5    the state at the last output, to go on from
//   solid_summary.json
#pragma once

#include "bridge/base/csv.hpp"
#include "bridge/base/timer.hpp"
#include "solid-dealii/interface.hpp"
#include "solid-dealii/output_vtk.hpp"
#include "solid-dealii/solid_solver.hpp"

#include <nlohmann/json_fwd.hpp>

#include <optional>

namespace sluice::solid {

/// A series that the root writes; elsewhere, and without a file, nothing.
class Series {
public:
  Series() = default;
  Series(const Ranks &ranks, const std::filesystem::path &file, const std::string &header) {
    if (ranks.is_root())
      writer_.emplace(file, header);
  }
  void row(std::initializer_list<double> values) { row(std::span(values.begin(), values.size())); }
  void row(std::span<const double> values) {
    if (writer_)
      writer_->row(values);
  }

private:
  std::optional<CsvWriter> writer_;
};

template <int dim> class History {
public:
  /// Fields are written every `output_interval` [s]; 0: none. Writes the state at rest at once, or
  /// `first` at `time` [s] when a run goes on from it.
  History(const SolidSolver<dim> &solver, std::filesystem::path folder, double output_interval,
          const SolidState *first = nullptr, double time = 0);

  /// The window that led from `start` to `state` at `time` [s] under nodal forces `load` [N].
  void record(const SolidState &start, const SolidState &state, const Eigen::VectorXd &load,
              double time);
  /// Short text for the progress line.
  std::string note() const;
  /// Renews solid_summary.json. `message` is empty for a complete run; `extra` adds keys.
  void write_summary(std::string_view message, const nlohmann::json &extra) const;

private:
  void record_state(const SolidState &state, double time);
  void record_tip(const SolidState &state, double time);
  void record_probes(const SolidState &state, double time);
  void record_loads(const SolidState &start, const SolidState &state, const Eigen::VectorXd &load,
                    double time);
  void write_fields(const SolidState &state, double time);

  const SolidSolver<dim> &solver_;
  std::filesystem::path folder_;
  double output_interval_;
  std::optional<FreeEnd<dim>> end_; // of a box
  std::vector<int> probe_nodes_;
  Series tip_, probes_, loads_, energy_, reactions_;
  std::optional<OutputVtk<dim>> fields_;
  long n_elements_ = 0, n_unknowns_ = 0; // of the body
  long fields_written_ = 0;
  long windows_ = 0;
  double output_seconds_ = 0;
  double last_time_ = 0;
  Vec<dim> last_tip_ = Vec<dim>::Zero(); // of the free end, or of the first probe
  Stopwatch watch_;
};

} // namespace sluice::solid
