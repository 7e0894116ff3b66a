// SPDX-License-Identifier: MIT
// What the map between the two interface meshes looks like, for the log and the run's summary.
#pragma once

#include <cstddef>
#include <string>

namespace sluice::bridge {

/// How well the two interface meshes fit together.
struct MapReport {
  std::size_t fluid_nodes = 0;
  std::size_t solid_nodes = 0;
  std::size_t fluid_nodes_beyond = 0;  ///< projected onto the rim of the solid's surface
  std::size_t solid_nodes_reached = 0; ///< that receive force from at least one fluid node
  double largest_distance = 0;         ///< [m] from a fluid node to its projection
  std::size_t farthest_node = 0;       ///< the fluid node at that distance
  double row_sum_error = 0;            ///< largest |1 - sum of a row|
  double largest_offset = 0; ///< [m] max |x_f - H X_s|: moments change by this times force
  double area_covered = 1;   ///< part of the fluid's surface over the solid's (mortar)

  /// Part of the solid's nodes that receives force.
  double coverage() const {
    return solid_nodes == 0
               ? 0
               : static_cast<double>(solid_nodes_reached) / static_cast<double>(solid_nodes);
  }
  /// One line for a log.
  std::string text() const;
};

} // namespace sluice::bridge
