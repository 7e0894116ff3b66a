// SPDX-License-Identifier: MIT
// Voronoi cells in the plane whose neighbours are known from the last step. A cell is cut by few
// neighbours, and these rarely change from one step to the next. Given them in their order around
// the point, the corners are the circumcentres of consecutive ones; the polygon is the cell if it
// is convex and no other point in sight cuts a corner off. Both are checked for every cell, so that
// nothing is assumed; where the check fails the cell is cut anew. Eight at a time.
//
// An edge shorter than `shortest_edge` counts as none and a corner that is cut off by less stays:
// volume and centroid are those of one set of neighbours, whether it was remembered or found, and a
// run that starts from a file has the same bits.
#pragma once

#include "fluid/packed_stencil.hpp"

#include <array>
#include <cstdint>
#include <limits>
#include <vector>

namespace sluice::fluid {

/// Eight cells; where `is_known` does not hold the others mean nothing.
struct PackedCells {
  PackMask is_known{};
  Pack reach2{}; // [m^2], square of the distance of the farthest corner
  Pack volume{}; // [m^2]
  PackVec<2> centroid{};
};

/// In spacings; far above the rounding of a corner, far below anything that is seen.
inline constexpr double shortest_edge = 1e-10;

/// Notes where each point stands.
void number_points(const Points<2> &points, CellMemory &memory);

/// The cells of the points of a stencil as far as their neighbours are still those of the memory.
PackedCells known_cells(const PackedStencil<2> &s, const Points<2> &points, const Cloud<2> &cloud,
                        const CellMemory &memory);

} // namespace sluice::fluid
