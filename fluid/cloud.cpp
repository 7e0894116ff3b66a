// SPDX-License-Identifier: MIT
#include "fluid/cloud.hpp"

#include "fluid/known_cells.hpp"
#include "fluid/parallel.hpp"
#include "fluid/voronoi_cell.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <limits>
#include <numbers>

namespace sluice::fluid {

namespace {

// Radius of an empty ball through a point that counts as air, in spacings. A lattice has 0.71 in
// the plane and 0.87 in space, a well kept cloud less than 0.9 and 1.0. Next to the surface a point
// emerges between the lower value and the upper one.
constexpr double open_ratio = 1.2;
template <int dim> constexpr double emerging_ratio = dim == 2 ? 0.9 : 1.05;
// Distance to which an open cell is followed into the air, in spacings.
constexpr double horizon = 1.5;
// A cell that is open on one side has its centroid 0.5 spacings off; one that is open on both, or
// through a narrow gap, near the point.
constexpr double thin_ratio = 0.2;
// Largest deviation of a surface point's depth from half a spacing, in spacings.
constexpr double shallowest = 0.45;

// Unit vector to the side on which corners lie beyond `limit` [m]; zero where that is not one side.
template <int dim> Vec<dim> open_side(const VoronoiCell<dim> &cell, double limit) {
  Vec<dim> sum = Vec<dim>::Zero();
  for (int k = 0; k < cell.size(); ++k)
    if (cell.corner(k).norm() > limit)
      sum += (1 - limit / cell.corner(k).norm()) * cell.corner(k);
  for (int k = 0; k < cell.size(); ++k)
    if (cell.corner(k).norm() > limit && cell.corner(k).dot(sum) <= 0)
      return Vec<dim>::Zero();
  return sum.normalized();
}

template <int dim>
void find_walls(const Points<dim> &points, const Walls<dim> &walls, Cloud<dim> &cloud) {
  cloud.face_tree.update(walls);
  const double near = cloud.radius + cloud.grid.half_diagonal();
  const int n = points.size();
  cloud.wall_slot.assign(n, -1);
  cloud.wall_points.clear();
  for (int c = 0; c < cloud.grid.n_cells(); ++c)
    if (cloud.ranges.start[c] < cloud.ranges.start[c + 1] &&
        is_near_walls(walls, cloud.face_tree, cloud.grid.centre(c), near))
      for (int i = cloud.ranges.start[c]; i < cloud.ranges.start[c + 1]; ++i) {
        cloud.wall_slot[i] = static_cast<int>(cloud.wall_points.size());
        cloud.wall_points.push_back(i);
      }
  cloud.point_walls.resize(cloud.wall_points.size());
  for_each_index(static_cast<int>(cloud.wall_points.size()), [&](int k) {
    const Vec<dim> &x = points.position[cloud.wall_points[k]];
    cloud.point_walls[k] = project_on_walls(walls, cloud.face_tree, x, cloud.radius);
  });
}

// Distance from a point to the nearest wall, at most the kernel radius [m].
template <int dim> double distance_to_nearest_wall(const Cloud<dim> &cloud, int i) {
  const PointWalls<dim> *const walls = cloud.walls_of(i);
  return walls != nullptr && walls->count > 0 ? std::abs(walls->projection[0].distance)
                                              : cloud.radius;
}

// No wall enters the balls around two points up to their nearest walls: where they overlap they
// hold the line between the points, and else a wall may cross it between them only.
template <int dim>
bool is_hidden(const Points<dim> &points, const Walls<dim> &walls, const Cloud<dim> &cloud, int i,
               int j) {
  constexpr double rounding = 1e-9;
  const double at_i = distance_to_nearest_wall(cloud, i), at_j = distance_to_nearest_wall(cloud, j);
  const Vec<dim> &from = points.position[i], &to = points.position[j], path = to - from;
  const double clear = at_i + at_j, length2 = path.squaredNorm();
  if ((1 - rounding) * clear * clear > length2)
    return false;
  const double part = (1 - rounding) / std::sqrt(length2);
  return cloud.face_tree.any_along(from + part * at_i * path, to - part * at_j * path, [&](int f) {
    return is_crossed(walls.corners(walls.faces[f]), from, to);
  });
}

template <int dim>
void drop_hidden_neighbours(const Points<dim> &points, const Walls<dim> &walls, Cloud<dim> &cloud) {
  for_each_index(static_cast<int>(cloud.wall_points.size()), [&](int k) {
    const int i = cloud.wall_points[k];
    int *const first = cloud.neighbours.first(i);
    int *const last = std::remove_if(first, first + cloud.neighbours.count[i],
                                     [&](int j) { return is_hidden(points, walls, cloud, i, j); });
    cloud.neighbours.count[i] = static_cast<int>(last - first);
  });
}

// Unit vectors along which a plane or space is cut to come near a ball: an octagon, and in space a
// body of 26 faces. Those along the axes come last.
template <int dim> const auto &directions_of_ball() {
  static const auto directions = [] {
    std::array<Vec<dim>, dim == 2 ? 8 : 26> n;
    int count = 0;
    if constexpr (dim == 2) {
      const double s = std::numbers::sqrt2 / 2;
      for (const Vec<2> &diagonal : {Vec<2>(s, s), Vec<2>(-s, s), Vec<2>(-s, -s), Vec<2>(s, -s)})
        n[count++] = diagonal;
    } else {
      for (int x = -1; x <= 1; ++x)
        for (int y = -1; y <= 1; ++y)
          for (int z = -1; z <= 1; ++z)
            if (const Vec<3> v(x, y, z); v.squaredNorm() > 1)
              n[count++] = v.normalized();
    }
    for (int d = 0; d < dim; ++d) {
      n[count++] = Vec<dim>::Unit(d);
      n[count++] = -Vec<dim>::Unit(d);
    }
    return n;
  }();
  return directions;
}

template <int dim> VoronoiCell<dim> ball_like_cell(double apothem) {
  VoronoiCell<dim> cell(apothem);
  for (const Vec<dim> &n : directions_of_ball<dim>())
    cell.cut(n, apothem);
  return cell;
}

/// Builds the cells of one cloud.
template <int dim> class CellBuilder {
public:
  CellBuilder(Points<dim> &points, Cloud<dim> &cloud)
      : points_(points), cloud_(cloud), free_(ball_like_cell<dim>(horizon * cloud.spacing)),
        lone_apothem_(cloud.spacing * lone_ratio()) {}

  /// Cells of the points first .. first + 7; returns how many of them were cut.
  int update(int first) const {
    const int count = std::min(pack_size, points_.size() - first);
    unsigned unknown = (1u << count) - 1;
    if constexpr (dim == 2) {
      const PackedStencil<2> s(first, points_, cloud_);
      const unsigned enclosed = far_from_walls(s);
      unknown &= ~take_known(s, enclosed);
      unsigned found = 0;
      for (unsigned rest = unknown; rest != 0; rest &= rest - 1)
        if (const int l = std::countr_zero(rest); cut(first + l) && (enclosed >> l & 1) != 0)
          found |= 1u << l;
      if (found != 0)
        take_known(s, found);
    } else {
      for (int i = first; i < first + count; ++i)
        cut(i);
    }
    return std::popcount(unknown);
  }

private:
  double limit_of() const {
    return cloud_.has_air ? open_ratio * cloud_.spacing : std::numeric_limits<double>::infinity();
  }

  void set_closed(int i, double volume, const Vec<dim> &centroid) const {
    cloud_.openness[i] = 0;
    cloud_.surface_normal[i] = Vec<dim>::Zero();
    cloud_.surface_depth[i] = 0;
    cloud_.kind[i] = PointKind::interior;
    cloud_.centroid_offset[i] = centroid;
    cloud_.cell_volume[i] = volume;
  }

  /// Cuts one cell; true when it is closed and its neighbours are remembered.
  bool cut(int i) const {
    const VoronoiCell<dim> cell = cell_of(i);
    if (cell.reach() <= limit_of()) {
      const auto [volume, offset] = cell.measures();
      set_closed(i, volume, offset);
      return is_emerging(cell) ? set_emerging(i, cell) : remember(i, cell);
    }
    points_.at_surface[i] = SurfaceMemory::open;
    const Vec<dim> normal = outward(cell);
    const bool is_thin = normal.isZero();
    cloud_.kind[i] = is_thin ? PointKind::thin : PointKind::surface;
    cloud_.openness[i] = 1;
    cloud_.surface_normal[i] = normal;
    const VoronoiCell<dim> layer = limited(cell, is_thin ? lone_apothem_ : cloud_.spacing);
    cloud_.surface_depth[i] = is_thin ? 0 : depth_of(layer, normal);
    const VoronoiCell<dim> inside =
        is_thin ? layer : cut_at(layer, normal, cloud_.surface_depth[i]);
    const auto [volume, centroid] = inside.measures();
    cloud_.centroid_offset[i] = centroid;
    cloud_.cell_volume[i] = volume;
    return false;
  }

  bool is_emerging(const VoronoiCell<dim> &cell) const {
    return cloud_.has_air && cell.reach() > emerging_ratio<dim> * cloud_.spacing;
  }

  /// An interior point whose cell opens: how far it is on the way to a surface point. Its row
  /// passes from the one to the other without a jump of the pressure, which would kick the points
  /// around.
  bool set_emerging(int i, const VoronoiCell<dim> &cell) const {
    const Vec<dim> normal = outward(cell);
    if (normal.isZero())
      return false;
    const double from = emerging_ratio<dim>,
                 x = (cell.reach() / cloud_.spacing - from) / (open_ratio - from);
    cloud_.openness[i] = x * x * (3 - 2 * x);
    cloud_.surface_normal[i] = normal;
    cloud_.surface_depth[i] = depth_of(limited(cell, cloud_.spacing), normal);
    return false;
  }

  // Unit vector out of the fluid; zero where that is on both sides.
  Vec<dim> outward(const VoronoiCell<dim> &cell) const {
    const Vec<dim> offset = cell.centroid();
    const bool is_centred = offset.norm() < thin_ratio * cloud_.spacing;
    return is_centred ? open_side(cell, emerging_ratio<dim> * cloud_.spacing)
                      : Vec<dim>(offset.normalized());
  }

  // --- cells that are known -----------------------------------------------------------------

  unsigned far_from_walls(const PackedStencil<dim> &s) const {
    unsigned lanes = 0;
    for (int l = 0; l < s.count(); ++l) {
      const PointWalls<dim> *walls = cloud_.walls_of(s.first() + l);
      lanes |= static_cast<unsigned>(!walls || walls->count == 0) << l;
    }
    return lanes;
  }

  /// Sets those of the cells in `lanes` that the memory knows and that are closed; returns them.
  unsigned take_known(const PackedStencil<2> &s, unsigned lanes) const {
    const PackedCells cells = known_cells(s, points_, cloud_, cloud_.cell_memory);
    // A corner that far is as far from points in no list; one half as far may be at the surface.
    const double known_limit = std::min(
        0.5 * cloud_.radius, cloud_.has_air ? emerging_ratio<2> * cloud_.spacing : HUGE_VAL);
    lanes &= bits_of(cells.is_known);
    for (unsigned rest = lanes; rest != 0; rest &= rest - 1) {
      const int l = std::countr_zero(rest), i = s.first() + l;
      if (std::sqrt(cells.reach2[l]) <= known_limit)
        set_closed(i, cells.volume[l], {cells.centroid[0][l], cells.centroid[1][l]});
      else
        lanes &= ~(1u << l);
    }
    return lanes;
  }

  bool remember(int, const VoronoiCell<3> &) const { return false; }
  bool remember(int i, const VoronoiCell<2> &cell) const {
    CellGenerators known;
    for (int k = 0; k < cell.size(); ++k) {
      const Vec<2> &a = cell.corner(k), &b = cell.corner(k + 1 == cell.size() ? 0 : k + 1);
      if ((b - a).norm() <= shortest_edge * cloud_.spacing)
        continue;
      if (cell.edge_of(k) == VoronoiCell<2>::nobody || known.count == CellGenerators::most)
        return false;
      known.id[known.count++] = points_.id[cell.edge_of(k)];
    }
    // Sums over the corners begin at the same one, whenever the cell was cut.
    const auto begin = known.id.begin(), end = begin + known.count;
    std::rotate(begin, std::min_element(begin, end), end);
    cloud_.cell_memory.generators[points_.id[i]] = known;
    return known.count >= 3;
  }

  // In space most cells are enclosed, and the corners of a cube are fewer than those of the body
  // that stands for a ball: that is needed only where one of its faces would be left.
  VoronoiCell<dim> cell_of(int i) const {
    VoronoiCell<dim> cell = start();
    cut_out(i, cell);
    if (dim == 3 && cell.reach() > std::min(limit_of(), horizon * cloud_.spacing)) {
      cell = free_;
      cut_out(i, cell);
    }
    return cell;
  }
  VoronoiCell<dim> start() const {
    if constexpr (dim == 3)
      return VoronoiCell<3>(horizon * cloud_.spacing);
    else
      return free_;
  }

  // The nearest neighbours first: they leave little to cut for the others.
  void cut_out(int i, VoronoiCell<dim> &cell) const {
    const Vec<dim> &x = points_.position[i];
    const auto neighbours = cloud_.neighbours.of(i);
    std::array<double, most_neighbours<dim>> distance2; // in spacings
    const double scale = 1 / (cloud_.spacing * cloud_.spacing);
    for (std::size_t k = 0; k < neighbours.size(); ++k)
      distance2[k] = scale * (points_.position[neighbours[k]] - x).squaredNorm();
    const auto cut_between = [&](double nearest, double farthest) {
      for (std::size_t k = 0; k < neighbours.size(); ++k)
        if (distance2[k] >= nearest * nearest && distance2[k] < farthest * farthest)
          cut_towards(cell, Vec<dim>(points_.position[neighbours[k]] - x), neighbours[k]);
    };
    constexpr double near = dim == 2 ? 1.3 : 1.55, nearest = dim == 2 ? 0 : 1.1;
    if constexpr (dim == 3)
      cut_between(0, nearest);
    cut_between(nearest, near);
    if (const PointWalls<dim> *walls = cloud_.walls_of(i))
      for (const Projection<dim> &p : *walls)
        cell.cut(p.normal, std::max(p.distance, 1e-3 * cloud_.spacing));
    cut_between(near, 2 * cell.reach() / cloud_.spacing);
  }

  // The part of a cell within `apothem` [m] of its point.
  static VoronoiCell<dim> limited(VoronoiCell<dim> cell, double apothem) {
    for (const Vec<dim> &n : directions_of_ball<dim>())
      cell.cut(n, apothem);
    return cell;
  }

  static VoronoiCell<dim> cut_at(VoronoiCell<dim> cell, const Vec<dim> &normal, double depth) {
    cell.cut(normal, depth);
    return cell;
  }

  // How far outside its point the surface lies, so that the cell holds the volume of a point: where
  // points stand apart along the surface they form a thinner layer. Exact for cells that are as
  // wide there as between 0.4 and 0.5 spacings outside. Derived here.
  double depth_of(const VoronoiCell<dim> &cell, const Vec<dim> &normal) const {
    const double h = cloud_.spacing, slice = 0.1 * h;
    const double volume = cut_at(cell, normal, 0.5 * h).volume();
    const double width = (volume - cut_at(cell, normal, 0.5 * h - slice).volume()) / slice;
    const double missing = volume_of_point<dim>(h) - volume;
    const double limit = shallowest * h;
    return width * limit > std::abs(missing) ? 0.5 * h + missing / width
           : missing > 0                     ? 0.5 * h + limit
                                             : 0.5 * h - limit;
  }

  // A ball-like cell of this apothem, in spacings, has the volume of one point.
  static double lone_ratio() {
    if constexpr (dim == 2)
      return 1 / std::sqrt(8 * std::tan(std::numbers::pi / 8));
    else
      return 1 / std::cbrt(ball_like_cell<3>(1).volume());
  }

  Points<dim> &points_;
  Cloud<dim> &cloud_;
  VoronoiCell<dim> free_; // of a point with nothing near
  double lone_apothem_;   // [m]
};

} // namespace

template <int dim>
void update_walls(Points<dim> &points, const Walls<dim> &walls, double spacing, Cloud<dim> &cloud) {
  cloud.spacing = spacing;
  cloud.radius = kernel_radius_ratio * spacing;
  cloud.grid = grid_over(points, cloud.radius);
  sort_by_cell(points, cloud.grid, cloud.ranges, cloud.sort_memory);
  find_walls(points, walls, cloud);
}

template <int dim>
void update_neighbours(const Points<dim> &points, const Walls<dim> &walls, Cloud<dim> &cloud) {
  find_neighbours(points, cloud.grid, cloud.ranges, cloud.radius, cloud.neighbours);
  drop_hidden_neighbours(points, walls, cloud);
  slice_lists(cloud.neighbours, cloud.slices);
}

namespace {

// Holes in the interior are no surface: only points next to open ones emerge.
template <int dim> void close_far_from_surface(const Points<dim> &points, Cloud<dim> &cloud) {
  const double near = 1.5 * cloud.spacing;
  for_each_point(points.size(), [&](int i) {
    if (cloud.kind[i] != PointKind::interior || cloud.openness[i] == 0)
      return;
    for (const int j : cloud.neighbours.of(i))
      if (cloud.kind[j] != PointKind::interior &&
          (points.position[j] - points.position[i]).squaredNorm() < near * near)
        return;
    cloud.openness[i] = 0;
    cloud.surface_normal[i] = Vec<dim>::Zero();
    cloud.surface_depth[i] = 0;
  });
}

} // namespace

template <int dim> void update_cells(Points<dim> &points, Cloud<dim> &cloud) {
  const int n = points.size();
  cloud.kind.resize(n);
  cloud.surface_normal.resize(n);
  cloud.openness.resize(n);
  cloud.surface_depth.resize(n);
  cloud.cell_volume.resize(n);
  cloud.centroid_offset.resize(n);
  if constexpr (dim == 2) {
    if (!cloud.remembers_cells)
      cloud.cell_memory.generators.clear();
    number_points(points, cloud.cell_memory);
  }
  const CellBuilder<dim> cells(points, cloud);
  cloud.cells_cut = static_cast<int>(block_sums<1>(
      n,
      [&](IndexRange range) {
        int cut = 0;
        for (int first = range.begin; first < range.end; first += pack_size)
          cut += cells.update(first);
        return std::array<double, 1>{static_cast<double>(cut)};
      },
      Work::heavy)[0]);
  close_far_from_surface(points, cloud);
}

template void update_walls(Points<2> &, const Walls<2> &, double, Cloud<2> &);
template void update_neighbours(const Points<2> &, const Walls<2> &, Cloud<2> &);
template void update_cells(Points<2> &, Cloud<2> &);
template void update_walls(Points<3> &, const Walls<3> &, double, Cloud<3> &);
template void update_neighbours(const Points<3> &, const Walls<3> &, Cloud<3> &);
template void update_cells(Points<3> &, Cloud<3> &);

} // namespace sluice::fluid
