// SPDX-License-Identifier: MIT
#include "fluid/surface_mesh.hpp"

#include "bridge/base/check.hpp"
#include "fluid/coordinates.hpp"

#include <algorithm>

namespace sluice::fluid {

namespace {

std::vector<int> faces_of(const Walls<3> &walls, int wall) {
  std::vector<int> faces;
  for (int f = 0; f < static_cast<int>(walls.faces.size()); ++f)
    if (walls.faces[f].wall == wall)
      faces.push_back(f);
  return faces;
}

struct Box {
  Vec<3> low, high;
  bool meets(const Box &other) const {
    return (low.array() <= other.high.array()).all() && (other.low.array() <= high.array()).all();
  }
};

Box box_of(const Corners<3> &c) {
  return {c[0].cwiseMin(c[1]).cwiseMin(c[2]), c[0].cwiseMax(c[1]).cwiseMax(c[2])};
}

// Corners of vertices at one place count as shared.
bool share_corner(const Walls<3> &walls, int f, int g) {
  const Corners<3> a = walls.corners(walls.faces[f]), b = walls.corners(walls.faces[g]);
  return std::any_of(a.begin(), a.end(), [&](const Vec<3> &x) {
    return std::any_of(b.begin(), b.end(), [&](const Vec<3> &y) { return (x - y).norm() < 1e-9; });
  });
}

bool cross_each_other(const Corners<3> &a, const Corners<3> &b) {
  for (int k = 0; k < 3; ++k)
    if (is_crossed(b, a[k], a[(k + 1) % 3]) || is_crossed(a, b[k], b[(k + 1) % 3]))
      return true;
  return false;
}

} // namespace

void check_closed(const Walls<3> &walls, int wall) {
  int open_sides = 0, first = -1, side = 0;
  for (const int f : faces_of(walls, wall))
    for (int k = 0; k < 3; ++k)
      if (walls.faces[f].beyond[k] < 0) {
        if (open_sides++ == 0) {
          first = f;
          side = k;
        }
      }
  if (open_sides == 0)
    return;
  const WallFace<3> &face = walls.faces[first];
  fail("wall '{}' is open: face {} has no neighbour at its edge from {} to {} m ({} such edges in "
       "all); close the surface, or set open = true if it is meant to have a border",
       walls.names[wall], face.number, text_of(walls.position[face.vertex[side]]),
       text_of(walls.position[face.vertex[(side + 1) % 3]]), open_sides);
}

// Faces sorted by the lower end of their boxes: only those that overlap along x are compared.
void check_free_of_crossings(const Walls<3> &walls, int wall) {
  std::vector<int> faces = faces_of(walls, wall);
  std::vector<Box> box(walls.faces.size());
  for (const int f : faces)
    box[f] = box_of(walls.corners(walls.faces[f]));
  std::sort(faces.begin(), faces.end(),
            [&](int f, int g) { return box[f].low.x() < box[g].low.x(); });
  for (std::size_t k = 0; k < faces.size(); ++k)
    for (std::size_t m = k + 1; m < faces.size(); ++m) {
      const int f = faces[k], g = faces[m];
      if (box[g].low.x() > box[f].high.x())
        break;
      if (!box[f].meets(box[g]) || share_corner(walls, f, g))
        continue;
      check(!cross_each_other(walls.corners(walls.faces[f]), walls.corners(walls.faces[g])),
            "wall '{}' goes through itself: faces {} and {} cross near {} m; mend the surface",
            walls.names[wall], walls.faces[f].number, walls.faces[g].number,
            text_of(walls.position[walls.faces[f].vertex[0]]));
    }
}

} // namespace sluice::fluid
