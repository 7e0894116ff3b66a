// SPDX-License-Identifier: MIT
// What a run leaves behind: series window by window, fields, and the summary.
//
//   tip.csv           mean displacement of the probe set, when there is one
//   solid_loads.csv   sums of the forces handed to ccx, at the accepted end of the window
//   solid.pvd         displacement and velocity for ParaView, every output_interval
//   solid_summary.json
#pragma once

#include "bridge/base/csv.hpp"
#include "bridge/base/timer.hpp"
#include "bridge/calculix/ccx.hpp"
#include "bridge/calculix/output_vtu.hpp"
#include "bridge/statistics.hpp"

#include <nlohmann/json_fwd.hpp>

#include <optional>

namespace sluice::calculix {

class History {
public:
  /// Fields are written every `output_interval` [s]; 0: none. Writes `start`, the state before the
  /// first window, at once; `windows` are those that led to it. `probe` are the nodes of the probe
  /// set, empty for none.
  History(const Deck &deck, std::vector<int> probe, std::filesystem::path folder,
          double output_interval, const Motion &start, long windows);

  /// The window that led to `motion` at `time` [s], with the sums of its loads.
  void record(const Motion &motion, const bridge::InterfaceTotals &loads, double time);
  /// Short text for the progress line.
  std::string note() const;
  /// Renews solid_summary.json. `message` is empty for a complete run; `extra` adds keys.
  void write_summary(std::string_view message, const CcxCost &cost,
                     const nlohmann::json &extra) const;

private:
  void record_state(const Motion &motion, double time);

  std::filesystem::path folder_;
  double output_interval_;
  std::vector<int> probe_;
  std::size_t n_elements_;
  std::optional<CsvWriter> tip_;
  CsvWriter loads_;
  std::optional<OutputVtu> fields_;
  long fields_written_ = 0;
  long windows_;
  double output_seconds_ = 0;
  double last_time_ = 0;
  Vec<3> last_tip_ = Vec<3>::Zero();
  Stopwatch watch_;
};

} // namespace sluice::calculix
