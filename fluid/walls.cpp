// SPDX-License-Identifier: MIT
#include "fluid/walls.hpp"

#include "bridge/base/check.hpp"
#include "fluid/coordinates.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

namespace sluice::fluid {

template <int dim> Corners<dim> Walls<dim>::corners(const WallFace<dim> &f) const {
  if constexpr (dim == 2)
    return {position[f.vertex[0]], position[f.vertex[1]]};
  else
    return {position[f.vertex[0]], position[f.vertex[1]], position[f.vertex[2]]};
}

namespace {

constexpr double cos_30_degrees = 0.866;

template <int dim> Foot<dim> foot_on(const Walls<dim> &walls, int face, const Vec<dim> &x) {
  return nearest_on_face(walls.corners(walls.faces[face]), x);
}

std::span<const int> faces_around(const Walls<3> &walls, int vertex) {
  return {walls.around.data() + walls.around_start[vertex],
          walls.around.data() + walls.around_start[vertex + 1]};
}

// --- a place that several faces share -----------------------------------------------------------

// It is reported by one of them: a side by the segment that ends in it, or the first of two
// triangles.
template <int dim> bool owns_side(const Walls<dim> &walls, int face, int side) {
  const int other = walls.faces[face].beyond[side];
  return other < 0 || (dim == 2 ? side == 1 : face < other);
}

template <int dim> int side_towards(const WallFace<dim> &face, int other) {
  return static_cast<int>(std::find(face.beyond.begin(), face.beyond.end(), other) -
                          face.beyond.begin());
}

// A foot is a local minimum of the distance over the surface unless it lies on a side or corner
// from which a neighbouring face comes nearer.
template <int dim>
bool is_side_minimum(const Walls<dim> &walls, int face, int side, const Vec<dim> &x) {
  const int other = walls.faces[face].beyond[side];
  return other < 0 ||
         foot_on(walls, other, x).part == FacePart::side(side_towards(walls.faces[other], face));
}

bool is_corner_minimum(const Walls<3> &walls, int face, const Foot<3> &foot, const Vec<3> &x) {
  const auto around = faces_around(walls, walls.faces[face].vertex[foot.part.number()]);
  if (around.front() != face) // the first reports it
    return false;
  const double distance2 = (foot.point - x).squaredNorm();
  return std::all_of(around.begin(), around.end(), [&](int other) {
    return other == face || (foot_on(walls, other, x).point - x).squaredNorm() >= distance2;
  });
}

template <int dim>
bool is_local_minimum(const Walls<dim> &walls, int face, const Foot<dim> &foot, const Vec<dim> &x) {
  if (foot.part.is_inside())
    return true;
  if (foot.part.is_side())
    return owns_side(walls, face, foot.part.number()) &&
           is_side_minimum(walls, face, foot.part.number(), x);
  if constexpr (dim == 3)
    return is_corner_minimum(walls, face, foot, x);
  return false;
}

int corner_at(const Corners<3> &c, const Vec<3> &x) {
  const auto distance2 = [&](int k) { return (c[k] - x).squaredNorm(); };
  int nearest = 0;
  for (int k = 1; k < 3; ++k)
    nearest = distance2(k) < distance2(nearest) ? k : nearest;
  return nearest;
}

// Sum of the normals of the faces around a corner, weighted by their angles there: tells the side
// of any point whose foot it is. Source: J. A. Baerentzen, H. Aanaes, IEEE Trans. Vis. Comput.
// Graph. 11 (2005) 243.
Vec<3> corner_normal(const Walls<3> &walls, int vertex) {
  Vec<3> sum = Vec<3>::Zero();
  for (const int f : faces_around(walls, vertex)) {
    const Corners<3> c = walls.corners(walls.faces[f]);
    const int k = corner_at(c, walls.position[vertex]);
    const Vec<3> e = c[(k + 1) % 3] - c[k], g = c[(k + 2) % 3] - c[k];
    sum += std::atan2(cross(e, g).norm(), e.dot(g)) * face_normal(c);
  }
  return sum;
}

// Side of the wall at a foot: the face's normal inside it, the mean normal where faces meet.
template <int dim> Vec<dim> fluid_side(const Walls<dim> &walls, int face, const Foot<dim> &foot) {
  const WallFace<dim> &f = walls.faces[face];
  if constexpr (dim == 3)
    if (!foot.part.is_inside() && !foot.part.is_side())
      return corner_normal(walls, f.vertex[foot.part.number()]);
  if (foot.part.is_side() && f.beyond[foot.part.number()] >= 0)
    return walls.normal(f) + walls.normal(walls.faces[f.beyond[foot.part.number()]]);
  return walls.normal(f);
}

template <int dim> bool is_sharp_side(const Walls<dim> &walls, const WallFace<dim> &f, int side) {
  const int other = f.beyond[side];
  return other < 0 || walls.normal(f).dot(walls.normal(walls.faces[other])) < cos_30_degrees;
}

template <int dim> bool is_sharp(const Walls<dim> &walls, int face, const FacePart &part) {
  if (part.is_inside())
    return false;
  if (part.is_side())
    return is_sharp_side(walls, walls.faces[face], part.number());
  if constexpr (dim == 3) {
    const int vertex = walls.faces[face].vertex[part.number()];
    for (const int f : faces_around(walls, vertex)) {
      const WallFace<3> &other = walls.faces[f];
      const int k = corner_at(walls.corners(other), walls.position[vertex]);
      if (is_sharp_side(walls, other, k) || is_sharp_side(walls, other, (k + 2) % 3))
        return true;
    }
  }
  return false;
}

template <int dim>
Projection<dim> make_projection(const Walls<dim> &walls, int face, const Foot<dim> &foot,
                                const Vec<dim> &x) {
  const Vec<dim> side = fluid_side(walls, face, foot);
  const Vec<dim> offset = x - foot.point;
  const double length = offset.norm();
  const double sign = offset.dot(side) >= 0 ? 1.0 : -1.0;
  const Vec<dim> normal = !foot.part.is_inside() && length > 1e-12
                              ? Vec<dim>(-sign * offset / length)
                              : Vec<dim>(-side.normalized());
  return {foot.point,
          normal,
          sign * length,
          foot.shape,
          face,
          walls.slips(face),
          is_sharp(walls, face, foot.part)};
}

// Candidates of one point, nearest first, of two as far away the one of the first face: the order
// in which they come has no influence.
template <int dim> class NearestFirst {
public:
  void insert(const Projection<dim> &p) {
    if (count_ == most && !is_before(p, all_[most - 1]))
      return;
    int k = count_ < most ? count_++ : most - 1;
    for (; k > 0 && is_before(p, all_[k - 1]); --k)
      all_[k] = all_[k - 1];
    all_[k] = p;
  }
  /// True when no place farther than all that have come changes by_direction().
  bool is_settled() const {
    return count_ == most || by_direction().count == most_projections<dim>;
  }
  /// The nearest of each direction.
  PointWalls<dim> by_direction() const {
    PointWalls<dim> found;
    for (int k = 0; k < count_ && found.count < static_cast<int>(found.projection.size()); ++k) {
      const bool is_new = std::none_of(found.begin(), found.end(), [&](const Projection<dim> &p) {
        return p.normal.dot(all_[k].normal) > cos_30_degrees;
      });
      if (is_new)
        found.projection[found.count++] = all_[k];
    }
    return found;
  }

private:
  static bool is_before(const Projection<dim> &p, const Projection<dim> &q) {
    const double a = std::abs(p.distance), b = std::abs(q.distance);
    return a < b || (a == b && p.face < q.face);
  }

  static constexpr int most = 4 * most_projections<dim>;
  int count_ = 0;
  std::array<Projection<dim>, most> all_;
};

// The far face of a plate is behind its near face: not a wall of this point.
template <int dim> void drop_far_faces(PointWalls<dim> &found) {
  int kept = 0;
  for (int k = 0; k < found.count; ++k) {
    const Projection<dim> &p = found.projection[k];
    bool is_far_face = false;
    for (int m = 0; m < kept; ++m) {
      const Projection<dim> &near = found.projection[m];
      is_far_face = is_far_face || (p.distance < 0 && near.distance >= 0 &&
                                    near.normal.dot(p.point - near.point) > 0);
    }
    if (!is_far_face)
      found.projection[kept++] = p;
  }
  found.count = kept;
}

// Local minima within reach on the faces for which for_each_candidate(visit) calls visit(face).
template <int dim, class ForEach>
NearestFirst<dim> local_minima(const Walls<dim> &walls, const Vec<dim> &x, double reach,
                               ForEach &&for_each_candidate) {
  NearestFirst<dim> nearest;
  for_each_candidate([&](int f) {
    const Foot<dim> foot = foot_on(walls, f, x);
    if ((x - foot.point).squaredNorm() <= reach * reach && is_local_minimum(walls, f, foot, x))
      nearest.insert(make_projection(walls, f, foot, x));
  });
  return nearest;
}

template <int dim> PointWalls<dim> projections(const NearestFirst<dim> &nearest) {
  PointWalls<dim> found = nearest.by_direction();
  drop_far_faces(found);
  return found;
}

// Walls of more faces than this are searched in balls that grow: next to a rough surface the
// directions that a point can have are found before its whole reach is searched.
constexpr std::size_t many_faces = 256;

} // namespace

template <int dim>
PointWalls<dim> project_on_walls(const Walls<dim> &walls, const FaceTree<dim> &tree,
                                 const Vec<dim> &x, double reach) {
  const auto within = [&](double radius) {
    return local_minima(walls, x, radius,
                        [&](auto &&visit) { tree.for_each_facing(x, radius, visit); });
  };
  if (walls.faces.size() > many_faces)
    for (const double part : {0.25, 0.5})
      if (const NearestFirst<dim> nearest = within(part * reach); nearest.is_settled())
        return projections(nearest);
  return projections(within(reach));
}

template <int dim>
PointWalls<dim> project_on_walls(const Walls<dim> &walls, std::span<const int> candidates,
                                 const Vec<dim> &x, double reach) {
  return projections(local_minima(walls, x, reach, [&](auto &&visit) {
    std::for_each(candidates.begin(), candidates.end(), visit);
  }));
}

template <int dim>
bool is_near_walls(const Walls<dim> &walls, const FaceTree<dim> &tree, const Vec<dim> &x,
                   double reach) {
  return tree.any_near(x, reach, [&](int f) {
    return (foot_on(walls, f, x).point - x).squaredNorm() <= reach * reach;
  });
}

template <int dim> double distance_to_walls(const Walls<dim> &walls, const Vec<dim> &x) {
  double nearest = std::numeric_limits<double>::infinity();
  for (int f = 0; f < static_cast<int>(walls.faces.size()); ++f)
    nearest = std::min(nearest, (foot_on(walls, f, x).point - x).norm());
  return nearest;
}

template <int dim>
bool is_hidden(const Walls<dim> &walls, const FaceTree<dim> &tree, const Vec<dim> &from,
               const Vec<dim> &to) {
  return tree.any_along(from, to,
                        [&](int f) { return is_crossed(walls.corners(walls.faces[f]), from, to); });
}

template <int dim>
bool is_hidden(const Walls<dim> &walls, std::span<const int> candidates, const Vec<dim> &from,
               const Vec<dim> &to) {
  return std::any_of(candidates.begin(), candidates.end(),
                     [&](int f) { return is_crossed(walls.corners(walls.faces[f]), from, to); });
}

// --- links --------------------------------------------------------------------------------------

namespace {

// Vertices closer than this are one [m].
constexpr double same_place = 1e-9;

// Numbers of the places of the vertices, equal for vertices at one place.
template <int dim> std::vector<int> places_of_vertices(const Walls<dim> &walls) {
  const int n = static_cast<int>(walls.position.size());
  // Along a direction that no wall of a scene has by design: few vertices fall on one spot.
  Vec<dim> direction;
  if constexpr (dim == 2)
    direction = {0.5403, 0.8415};
  else
    direction = {0.5403, 0.7081, 0.4546};
  std::vector<int> order(n), place(n);
  std::iota(order.begin(), order.end(), 0);
  std::iota(place.begin(), place.end(), 0);
  const auto along = [&](int v) { return direction.dot(walls.position[v]); };
  std::stable_sort(order.begin(), order.end(), [&](int a, int b) { return along(a) < along(b); });
  for (int k = 0; k < n; ++k)
    for (int m = k + 1; m < n && along(order[m]) - along(order[k]) <= 1.01 * same_place; ++m)
      if ((walls.position[order[m]] - walls.position[order[k]]).norm() < same_place)
        place[order[m]] = place[order[k]];
  return place;
}

template <int dim> struct Side {
  std::array<int, dim - 1> place; // sorted
  int face, number;
  bool forward; // in which way the face runs along it: two faces must differ
};

template <int dim>
std::vector<Side<dim>> sides_of_faces(const Walls<dim> &walls, const std::vector<int> &place) {
  std::vector<Side<dim>> sides;
  for (int f = 0; f < static_cast<int>(walls.faces.size()); ++f)
    for (int k = 0; k < dim; ++k) {
      const int a = place[walls.faces[f].vertex[k]];
      if constexpr (dim == 2) {
        sides.push_back({{a}, f, k, k == 0});
      } else {
        const int b = place[walls.faces[f].vertex[(k + 1) % 3]];
        check(a != b, "wall '{}': face {} has two corners at {} m; remove the face",
              walls.names[walls.faces[f].wall], walls.faces[f].number,
              text_of(walls.position[walls.faces[f].vertex[k]]));
        sides.push_back({{std::min(a, b), std::max(a, b)}, f, k, a < b});
      }
    }
  std::stable_sort(sides.begin(), sides.end(),
                   [](const auto &a, const auto &b) { return a.place < b.place; });
  return sides;
}

[[noreturn]] void refuse_opposed(const Walls<2> &walls, const Side<2> &p, const Side<2> &q) {
  const WallFace<2> &s = walls.faces[p.face], &t = walls.faces[q.face];
  fail("walls '{}' and '{}' run against each other at {} m; reverse the points_m of one: the "
       "fluid lies on the left of both",
       walls.names[s.wall], walls.names[t.wall], text_of(walls.position[s.vertex[p.number]]));
}

[[noreturn]] void refuse_opposed(const Walls<3> &walls, const Side<3> &p, const Side<3> &q) {
  const WallFace<3> &s = walls.faces[p.face], &t = walls.faces[q.face];
  fail(
      "face {} of wall '{}' and face {} of wall '{}' are turned against each other at their common "
      "edge from {} to {} m; turn one round: the fluid sees the corners of both counter-clockwise",
      s.number, walls.names[s.wall], t.number, walls.names[t.wall],
      text_of(walls.position[s.vertex[p.number]]),
      text_of(walls.position[s.vertex[(p.number + 1) % 3]]));
}

template <int dim>
[[noreturn]] void refuse_branch(const Walls<dim> &walls, const Side<dim> &p, const Side<dim> &q) {
  const WallFace<dim> &s = walls.faces[p.face], &t = walls.faces[q.face];
  const std::string place = text_of(walls.position[s.vertex[p.number]]);
  if constexpr (dim == 2)
    fail("walls '{}' and '{}': more than two segments meet at {} m; "
         "walls must be simple outlines with the fluid on their left",
         walls.names[s.wall], walls.names[t.wall], place);
  else
    fail(
        "more than two faces meet at the edge from {} to {} m, among them face {} of wall '{}' and "
        "face {} of wall '{}'; a surface must not branch",
        place, text_of(walls.position[s.vertex[(p.number + 1) % 3]]), s.number, walls.names[s.wall],
        t.number, walls.names[t.wall]);
}

void list_faces_around(Walls<3> &walls, const std::vector<int> &place) {
  const int n = static_cast<int>(place.size());
  std::vector<std::vector<int>> at(n);
  for (int f = 0; f < static_cast<int>(walls.faces.size()); ++f)
    for (const int v : walls.faces[f].vertex)
      at[place[v]].push_back(f);
  walls.around_start.assign(1, 0);
  walls.around.clear();
  for (int v = 0; v < n; ++v) {
    walls.around.insert(walls.around.end(), at[place[v]].begin(), at[place[v]].end());
    walls.around_start.push_back(static_cast<int>(walls.around.size()));
  }
}

} // namespace

template <int dim> void link_faces(Walls<dim> &walls) {
  const std::vector<int> place = places_of_vertices(walls);
  const std::vector<Side<dim>> sides = sides_of_faces(walls, place);
  for (std::size_t k = 0; k + 1 < sides.size(); ++k) {
    const Side<dim> &p = sides[k], &q = sides[k + 1];
    if (p.place != q.place)
      continue;
    if (k + 2 < sides.size() && sides[k + 2].place == p.place)
      refuse_branch(walls, p, sides[k + 2]);
    if (p.forward == q.forward)
      refuse_opposed(walls, p, q);
    walls.faces[p.face].beyond[p.number] = q.face;
    walls.faces[q.face].beyond[q.number] = p.face;
  }
  if constexpr (dim == 3)
    list_faces_around(walls, place);
}

template struct Walls<2>;
template struct Walls<3>;
template PointWalls<2> project_on_walls(const Walls<2> &, const FaceTree<2> &, const Vec<2> &,
                                        double);
template PointWalls<2> project_on_walls(const Walls<2> &, std::span<const int>, const Vec<2> &,
                                        double);
template bool is_near_walls(const Walls<2> &, const FaceTree<2> &, const Vec<2> &, double);
template double distance_to_walls(const Walls<2> &, const Vec<2> &);
template bool is_hidden(const Walls<2> &, const FaceTree<2> &, const Vec<2> &, const Vec<2> &);
template bool is_hidden(const Walls<2> &, std::span<const int>, const Vec<2> &, const Vec<2> &);
template void link_faces(Walls<2> &);
template PointWalls<3> project_on_walls(const Walls<3> &, const FaceTree<3> &, const Vec<3> &,
                                        double);
template PointWalls<3> project_on_walls(const Walls<3> &, std::span<const int>, const Vec<3> &,
                                        double);
template bool is_near_walls(const Walls<3> &, const FaceTree<3> &, const Vec<3> &, double);
template double distance_to_walls(const Walls<3> &, const Vec<3> &);
template bool is_hidden(const Walls<3> &, const FaceTree<3> &, const Vec<3> &, const Vec<3> &);
template bool is_hidden(const Walls<3> &, std::span<const int>, const Vec<3> &, const Vec<3> &);
template void link_faces(Walls<3> &);

} // namespace sluice::fluid
