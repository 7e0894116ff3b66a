// SPDX-License-Identifier: MIT
#include "bridge/run_summary.hpp"

#include <nlohmann/json.hpp>

namespace sluice::bridge {

nlohmann::json summary_of(const Statistics &statistics) {
  const double steps = static_cast<double>(std::max(statistics.windows, 1L));
  nlohmann::json summary = {{"windows", statistics.windows},
                            {"failed_windows", statistics.failed_windows},
                            {"halved_windows", statistics.halved_windows},
                            {"coupling_iterations_mean", statistics.iterations_mean()},
                            {"coupling_iterations_max", statistics.iterations_max},
                            {"ms_per_step_bridge", 1e3 * statistics.bridge_s / steps},
                            {"wait_s", statistics.wait_s},
                            {"bridge_bytes_sent", statistics.bytes_sent},
                            {"bridge_bytes_received", statistics.bytes_received}};
  if (statistics.force_balance_max >= 0) {
    summary["force_balance_max"] = statistics.force_balance_max;
    summary["moment_balance_max"] = statistics.moment_balance_max;
    summary["work_balance_max"] = statistics.work_balance_max;
  }
  return summary;
}

nlohmann::json summary_of(const MapReport &report) {
  return {{"map_coverage", report.coverage()},
          {"map_largest_distance_m", report.largest_distance},
          {"map_row_sum_error", report.row_sum_error},
          {"map_largest_offset_m", report.largest_offset},
          {"map_area_covered", report.area_covered},
          {"map_nodes_beyond", report.fluid_nodes_beyond}};
}

} // namespace sluice::bridge
