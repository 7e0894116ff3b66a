// SPDX-License-Identifier: MIT
// What a participant counts while it runs, and the interface totals that both ends report.
#pragma once

#include <array>
#include <cstdint>

namespace sluice::bridge {

/// Sums over the interface at the end of a window, computed by each participant from its own data
/// (the fluid's traction integral, the solid's assembled load vector). The magnitudes are the sums
/// of absolute contributions, against which a difference is judged. In 2-D: per metre of depth,
/// force[2] = moment[0] = moment[1] = 0.
struct InterfaceTotals {
  std::array<double, 3> force{};  ///< [N]
  std::array<double, 3> moment{}; ///< [N m] about the origin, accepted (current) configuration
  double work = 0;                ///< [J] force times the window's accepted displacement increment
  double force_magnitude = 0;     ///< [N]
  double moment_magnitude = 0;    ///< [N m]
  /// [J] of force times either displacement: their difference keeps the rounding of both
  double work_magnitude = 0;
  template <class Archive> void archive(Archive &a) {
    a(force, moment, work, force_magnitude, moment_magnitude, work_magnitude);
  }
};

struct Statistics {
  long windows = 0;        ///< accepted
  long failed_windows = 0; ///< not converged within max_iterations
  long halved_windows = 0; ///< given up and tried again at half their length
  long iterations = 0;     ///< all accepted windows together
  long iterations_max = 0; ///< of one window
  double wait_s = 0;       ///< [s] blocked on the partner (its computing time included)
  double bridge_s = 0;     ///< [s] spent in the bridge itself: map, acceleration, messages
  double initialize_s = 0; ///< [s] connecting, exchanging meshes, building the map
  std::uint64_t bytes_sent = 0;
  std::uint64_t bytes_received = 0;
  // Largest relative difference between the two ends over all windows; -1: not reported.
  double force_balance_max = -1;
  double moment_balance_max = -1;
  double work_balance_max = -1;

  /// What describes the run as a whole, also of one that goes on from another.
  template <class Archive> void archive(Archive &a) {
    a(windows, failed_windows, halved_windows, iterations, iterations_max, force_balance_max,
      moment_balance_max, work_balance_max);
  }
  double iterations_mean() const {
    return windows > 0 ? static_cast<double>(iterations) / static_cast<double>(windows) : 0;
  }
};

} // namespace sluice::bridge
