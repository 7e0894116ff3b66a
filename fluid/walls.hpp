// SPDX-License-Identifier: MIT
// Walls: polylines of straight segments in the plane, surfaces of triangles in space, with the
// fluid on their front, used directly (no ghost points). Points see a wall through projections: the
// locally nearest points of the faces.
#pragma once

#include "bridge/base/vec.hpp"
#include "fluid/face_tree.hpp"
#include "fluid/wall_face.hpp"

#include <array>
#include <span>
#include <string>
#include <vector>

namespace sluice::fluid {

template <int dim> constexpr std::array<int, dim> no_faces() {
  std::array<int, dim> none;
  none.fill(-1);
  return none;
}

template <int dim> struct WallFace {
  std::array<int, dim> vertex{}; // segment: the fluid lies on the left of a -> b; triangle:
                                 // counter-clockwise seen from the fluid
  int wall = 0;                  // index into Walls::names
  int number = 0;                // of the face in its wall, as the user counts
  std::array<int, dim> beyond = no_faces<dim>(); // the face that shares side k, -1 at an open side
};

/// What a wall does to the flow along it.
enum class Slip : std::uint8_t { none, free };

/// Wall surface of a scene: vertices with position and velocity, and the faces between them.
template <int dim> struct Walls {
  std::vector<Vec<dim>> position; // [m]
  std::vector<Vec<dim>> velocity; // [m/s]
  std::vector<WallFace<dim>> faces;
  std::vector<std::string> names;
  std::vector<Slip> slip;            // per name
  std::vector<int> coupled_vertices; // moved by the bridge, in the order of its interface mesh
  std::vector<int> coupled_faces;

  /// In space: the faces around each vertex, those of other vertices at its place included.
  std::vector<int> around_start, around;

  Corners<dim> corners(const WallFace<dim> &f) const;
  /// Unit normal of a face, into the fluid.
  Vec<dim> normal(const WallFace<dim> &f) const { return face_normal(corners(f)); }
  bool slips(int face) const { return slip[faces[face].wall] == Slip::free; }
};

/// Value on a face of a field that is given at the vertices.
template <int dim>
Vec<dim> value_at(std::span<const Vec<dim>> field, const WallFace<dim> &f,
                  const Shape<dim> &shape) {
  if constexpr (dim == 2)
    return interpolated<Vec<2>>(shape, field[f.vertex[0]], field[f.vertex[1]]);
  else
    return interpolated<Vec<3>>(shape, field[f.vertex[0]], field[f.vertex[1]], field[f.vertex[2]]);
}

/// Nearest point of a wall to a fluid point.
template <int dim> struct Projection {
  Vec<dim> point;   // on the wall [m]
  Vec<dim> normal;  // unit, out of the fluid
  double distance;  // [m], negative when the fluid point is behind the wall
  Shape<dim> shape; // of the face's vertices
  int face;
  bool slips;   // the wall lets fluid glide along it
  bool at_edge; // on a sharp edge (turning by more than 30 degrees) or an open one: flow leaves
};

/// Wall velocity at a projection [m/s].
template <int dim> Vec<dim> wall_velocity(const Walls<dim> &walls, const Projection<dim> &p) {
  return value_at<dim>(walls.velocity, walls.faces[p.face], p.shape);
}

/// Walls that a point can see at once: three in the plane; in space a corner between two more
/// walls.
template <int dim> inline constexpr int most_projections = dim == 2 ? 3 : 5;

/// The projections of one point, nearest first: the nearest few directions that differ by more
/// than 30 degrees, of each the nearest wall.
template <int dim> struct PointWalls {
  int count = 0;
  std::array<Projection<dim>, most_projections<dim>> projection;
  auto begin() const { return projection.begin(); }
  auto end() const { return projection.begin() + count; }
};

/// Projections of `x` on the walls within `reach`: local minima of the distance over the surface,
/// nearest first. `tree` is that of the walls.
template <int dim>
PointWalls<dim> project_on_walls(const Walls<dim> &walls, const FaceTree<dim> &tree,
                                 const Vec<dim> &x, double reach);

/// The same by a test of every face in `candidates`.
template <int dim>
PointWalls<dim> project_on_walls(const Walls<dim> &walls, std::span<const int> candidates,
                                 const Vec<dim> &x, double reach);

/// True when a face comes within `reach` of `x`.
template <int dim>
bool is_near_walls(const Walls<dim> &walls, const FaceTree<dim> &tree, const Vec<dim> &x,
                   double reach);

/// Distance from `x` to the nearest of all faces [m].
template <int dim> double distance_to_walls(const Walls<dim> &walls, const Vec<dim> &x);

/// True when the straight line between two points crosses a wall.
template <int dim>
bool is_hidden(const Walls<dim> &walls, const FaceTree<dim> &tree, const Vec<dim> &from,
               const Vec<dim> &to);

/// The same by a test of every face in `candidates`.
template <int dim>
bool is_hidden(const Walls<dim> &walls, std::span<const int> candidates, const Vec<dim> &from,
               const Vec<dim> &to);

/// Links faces that share a side, by the position of their vertices, into surfaces; throws
/// UserError on a side with more than two faces or two faces that are turned against each other.
template <int dim> void link_faces(Walls<dim> &walls);

} // namespace sluice::fluid
