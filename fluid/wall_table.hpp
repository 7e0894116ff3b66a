// SPDX-License-Identifier: MIT
// From the tables [[fluid.wall]] to the walls of a scene.
#pragma once

#include "bridge/base/config.hpp"
#include "fluid/surface_mesh.hpp"
#include "fluid/wall_motion.hpp"
#include "fluid/walls.hpp"

#include <string>
#include <vector>

namespace sluice::fluid {

/// Table [[fluid.wall]]: a polyline with the fluid on its left, in space swept along z; or, in
/// space, a surface from a file.
template <int dim> struct WallParams {
  std::string name;
  std::string condition = "no-slip";
  std::vector<Vec<2>> points;
  std::string file;
  bool open = false, reversed = false;
  bool coupled = false;
  double segment_length = 0;
  Vec<2> velocity{0, 0};
  std::vector<double> velocity_shares;
  std::vector<std::string> displacement;

  template <class Reader> void describe(Reader &read) {
    read.required("name", name, "name of the wall");
    if constexpr (dim == 2) {
      read.required("points_m", points, "polyline with the fluid on its left")
          .check(points.size() >= 2, "needs at least two points");
    } else {
      read("file", file, "surface of triangles and quadrilaterals: .stl, .obj, .ply or .vtp");
      read("open", open, "the surface of the file may have a border, as a tank without a lid");
      read("reversed", reversed, "the fluid lies behind the faces of the file, not in front");
      read("points_m", points, "polyline with the fluid on its left, swept along z")
          .check(file.empty() ? points.size() >= 2 : points.empty(),
                 "needs at least two points, or none where a file is given");
    }
    read("condition", condition, "what holds for viscous water that flows along the wall")
        .one_of({"no-slip", "free-slip"});
    read("coupled", coupled, "moves with the partner of the bridge");
    read("segment_length_m", segment_length, "longest segment; 0 keeps the given ones").at_least(0);
    read("velocity_m_s", velocity, "of a wall that slides along itself, as a lid does");
    auto shares = read("velocity_shares", velocity_shares,
                       "of velocity_m_s at each of points_m, linear in between; none: all of it");
    shares
        .check(velocity_shares.empty() || velocity_shares.size() == points.size(),
               fmt::format("has {} shares for {} points_m; give one for each",
                           velocity_shares.size(), points.size()))
        .check(velocity_shares.empty() || !velocity.isZero(), "needs velocity_m_s");
    auto law = read("displacement_m", displacement,
                    "formulas in x, y (z) and t of a wall that moves by a law of its own");
    const std::string problem = problem_of<dim>(displacement);
    law.check(problem.empty(), problem);
  }
};

/// Extent along z, from 0, of what is given in the plane [m], and the walls at its ends.
struct Sweep {
  double depth = 0;
  std::string side_walls = "none"; // or their condition
};

/// Reads the walls, where they are at t = 0, and the laws of those that move by one;
/// `read_surface` reads those that are files. Throws UserError, with name, number
/// and place, on a wall that cannot be used.
template <int dim>
Walls<dim> read_walls(const Config &config, const Sweep &sweep, const SurfaceReader &read_surface,
                      std::vector<PrescribedWall<dim>> &prescribed);

} // namespace sluice::fluid
