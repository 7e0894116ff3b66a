// SPDX-License-Identifier: MIT
// Surfaces from files of other programs, through VTK.
#pragma once

#include "fluid/surface_mesh.hpp"

namespace sluice::fluid {

/// Reads .stl, .obj, .ply or .vtp, in metres. Throws UserError if there is no such file, its kind
/// is another, it holds no faces, or a face has neither three nor four corners.
SurfaceMesh read_surface_file(const std::filesystem::path &file);

} // namespace sluice::fluid
