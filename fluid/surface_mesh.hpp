// SPDX-License-Identifier: MIT
// A surface of triangles, and what can be wrong with one.
#pragma once

#include "fluid/walls.hpp"

#include <array>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

namespace sluice::fluid {

/// A surface as a file holds it; quadrilaterals are cut in two.
struct SurfaceMesh {
  std::vector<Vec<3>> position;              // [m]
  std::vector<std::array<int, 3>> triangles; // counter-clockwise seen from the front
  std::vector<int> face;                     // the file's number of each triangle's face, from 0
};

/// Reads a file; a library without a reader of files has none.
using SurfaceReader = std::function<SurfaceMesh(const std::filesystem::path &)>;

/// Throws UserError, with the number of the face, if an edge of the wall belongs to one face only.
/// `walls` must be linked.
void check_closed(const Walls<3> &walls, int wall);

/// Throws UserError, with the numbers of both faces, if an edge of one face of the wall goes
/// through another that it shares no corner with.
void check_free_of_crossings(const Walls<3> &walls, int wall);

} // namespace sluice::fluid
