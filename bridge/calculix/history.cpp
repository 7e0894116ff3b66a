// SPDX-License-Identifier: MIT
#include "bridge/calculix/history.hpp"

#include <nlohmann/json.hpp>

#include <cmath>

namespace sluice::calculix {

History::History(const Deck &deck, std::vector<int> probe, std::filesystem::path folder,
                 double output_interval, const Motion &start, long windows)
    : folder_(std::move(folder)), output_interval_(output_interval), probe_(std::move(probe)),
      n_elements_(deck.elements.size()),
      loads_(folder_ / "solid_loads.csv",
             "window,time_s,fx_n,fy_n,moment_nm,magnitude_n,moment_magnitude_nm,work_j,"
             "work_magnitude_j"),
      windows_(windows) {
  if (!probe_.empty())
    tip_.emplace(folder_ / "tip.csv", "time_s,ux_m,uy_m,uz_m");
  if (output_interval > 0)
    fields_.emplace(deck, folder_);
  record_state(start, start.time);
}

void History::record(const Motion &motion, const bridge::InterfaceTotals &loads, double time) {
  ++windows_;
  loads_.row({static_cast<double>(windows_), time, loads.force[0], loads.force[1], loads.moment[2],
              loads.force_magnitude, loads.moment_magnitude, loads.work, loads.work_magnitude});
  record_state(motion, time);
}

void History::record_state(const Motion &motion, double time) {
  last_time_ = time;
  if (tip_) {
    last_tip_.setZero();
    for (const int node : probe_)
      last_tip_ += motion.displacement.col(node - 1) / static_cast<double>(probe_.size());
    tip_->row({time, last_tip_.x(), last_tip_.y(), last_tip_.z()});
  }
  // Counted, not summed: sample k is written at the first window that ends at or after k intervals.
  if (!fields_ || time < (1 - 1e-9) * static_cast<double>(fields_written_) * output_interval_)
    return;
  const Stopwatch watch;
  fields_->write(time, motion);
  fields_written_ = std::lround(std::floor(time / output_interval_ * (1 + 1e-9))) + 1;
  output_seconds_ += watch.seconds();
}

std::string History::note() const {
  if (!tip_)
    return fmt::format("t = {:.4f} s", last_time_);
  return fmt::format("t = {:.4f} s, tip {:.2f} mm", last_time_, 1e3 * last_tip_.x());
}

void History::write_summary(std::string_view message, const CcxCost &cost,
                            const nlohmann::json &extra) const {
  const double windows = static_cast<double>(std::max(1L, windows_));
  const double runs = static_cast<double>(std::max(1L, cost.runs));
  nlohmann::json summary{
      {"completed", message.empty()},
      {"message", message},
      {"time_s", last_time_},
      {"wall_time_s", watch_.seconds()},
      {"cpu_time_s", process_cpu_time() + cost.cpu_seconds},
      {"ms_per_step_solid", 1e3 * cost.seconds / windows},
      {"cpu_ms_per_step_solid", 1e3 * cost.cpu_seconds / windows},
      {"phases_ms",
       {{"ccx", 1e3 * cost.seconds / windows}, {"output", 1e3 * output_seconds_ / windows}}},
      {"ccx_runs", cost.runs},
      {"cpu_ms_per_ccx_run", 1e3 * cost.cpu_seconds / runs},
      {"cpu_ms_per_step_adapter", 1e3 * process_cpu_time() / windows},
      {"solid_elements", n_elements_}};
  summary.update(extra);
  const auto file = folder_ / "solid_summary.json";
  std::ofstream out(file);
  out << summary.dump(2, ' ', false, nlohmann::json::error_handler_t::replace) << '\n'
      << std::flush;
  check(out.good(), "{}: writing failed; is the disk full?", file.string());
}

} // namespace sluice::calculix
