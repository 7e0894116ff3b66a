// SPDX-License-Identifier: MIT
// Meshes of quadrilaterals or hexahedra from files, with the parts of their boundary by name.
//
//   .msh  Gmsh 2.2 and 4.1, text; a name is a physical group of lines (quadrilaterals in space)
//   .inp  Abaqus, CalculiX; a name is an *NSET (the faces all of whose nodes are in it), or a
//         *SURFACE, TYPE=ELEMENT of element faces
//   .vtu  VTK; a name is a point array that is not zero on the nodes of the part
// Only the corners of cells of higher order are used.
#pragma once

#include "bridge/base/vec.hpp"

#include <filesystem>
#include <map>
#include <set>
#include <string>
#include <vector>

namespace sluice::solid {

/// A mesh as a file gives it, numbered from zero.
struct MeshFile {
  int dim = 2;
  std::vector<Vec<3>> points;          ///< [m]; in two dimensions z = 0
  std::vector<std::vector<int>> cells; ///< 4 or 8 corners, counter-clockwise (lower side first)
  std::map<std::string, std::set<int>> node_sets;              ///< faces with all nodes in the set
  std::map<std::string, std::set<std::vector<int>>> face_sets; ///< sorted corners of each face
};

/// Throws UserError, with file and line where there is one, for a file that cannot be read, has no
/// cells of that dimension, or has triangles or tetrahedra among them.
MeshFile read_mesh(const std::filesystem::path &file, int dim);

} // namespace sluice::solid
