// SPDX-License-Identifier: MIT
// The bridge's part of a participant's DIR/<name>_summary.json.
#pragma once

#include "bridge/map_report.hpp"
#include "bridge/statistics.hpp"

#include <nlohmann/json_fwd.hpp>

namespace sluice::bridge {

/// Keys windows, failed_windows, halved_windows, coupling_iterations_mean, coupling_iterations_max,
/// ms_per_step_bridge, wait_s, bridge_bytes_sent, bridge_bytes_received; and, when both sides
/// reported totals, force_balance_max, moment_balance_max, work_balance_max.
nlohmann::json summary_of(const Statistics &statistics);
/// Keys map_coverage, map_largest_distance_m, map_row_sum_error, map_largest_offset_m,
/// map_area_covered, map_nodes_beyond.
nlohmann::json summary_of(const MapReport &report);

} // namespace sluice::bridge
