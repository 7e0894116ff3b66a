// SPDX-License-Identifier: MIT
#include "fluid/cloud.hpp"

#include "fluid/parallel.hpp"
#include "fluid/voronoi_cell.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

namespace sluice::fluid {

namespace {

// Radius of an empty ball through a point that counts as air, in spacings. A lattice has 0.71 in
// the plane and 0.87 in space, a well kept cloud less than 0.9 and 1.0. The lower value holds for
// points that were open before: a flag that would flicker between them keeps its state.
constexpr double open_ratio = 1.2;
constexpr double close_ratio = 1.0;
// Distance to which an open cell is followed into the air, in spacings.
constexpr double horizon = 1.5;
// A cell that is open on both sides has its centroid near the point; on one side 0.5 spacings off.
constexpr double thin_ratio = 0.2;

template <int dim>
void find_walls(const Points<dim> &points, const Walls<dim> &walls, Cloud<dim> &cloud) {
  find_near_faces(walls, cloud.grid, cloud.radius, cloud.near_faces);
  const int n = points.size();
  cloud.wall_slot.assign(n, -1);
  cloud.wall_points.clear();
  for (int c = 0; c < cloud.grid.n_cells(); ++c)
    if (!cloud.near_faces.near(c).empty())
      for (int i = cloud.ranges.start[c]; i < cloud.ranges.start[c + 1]; ++i) {
        cloud.wall_slot[i] = static_cast<int>(cloud.wall_points.size());
        cloud.wall_points.push_back(i);
      }
  cloud.point_walls.resize(cloud.wall_points.size());
  for_each_index(static_cast<int>(cloud.wall_points.size()), [&](int k) {
    const Vec<dim> &x = points.position[cloud.wall_points[k]];
    const auto candidates = cloud.near_faces.near(cloud.grid.cell(x));
    cloud.point_walls[k] = project_on_walls(walls, candidates, x, cloud.radius);
  });
}

template <int dim>
void drop_hidden_neighbours(const Points<dim> &points, const Walls<dim> &walls, Cloud<dim> &cloud) {
  for_each_index(static_cast<int>(cloud.wall_points.size()), [&](int k) {
    const int i = cloud.wall_points[k];
    const Vec<dim> &x = points.position[i];
    const auto candidates = cloud.near_faces.near(cloud.grid.cell(x));
    int *const first = cloud.neighbours.first(i);
    int *const last = std::remove_if(first, first + cloud.neighbours.count[i], [&](int j) {
      return is_hidden(walls, candidates, x, points.position[j]);
    });
    cloud.neighbours.count[i] = static_cast<int>(last - first);
  });
}

// Unit vectors along which a box is cut to come near a ball: an octagon, and in space a body of 26
// faces.
template <int dim> std::vector<Vec<dim>> directions_between_axes() {
  if constexpr (dim == 2) {
    const double s = std::numbers::sqrt2 / 2;
    return {{s, s}, {-s, s}, {-s, -s}, {s, -s}};
  } else {
    std::vector<Vec<3>> directions;
    for (int x = -1; x <= 1; ++x)
      for (int y = -1; y <= 1; ++y)
        for (int z = -1; z <= 1; ++z)
          if (const Vec<3> n(x, y, z); n.squaredNorm() > 1)
            directions.push_back(n.normalized());
    return directions;
  }
}

template <int dim> VoronoiCell<dim> ball_like_cell(double apothem) {
  VoronoiCell<dim> cell(apothem);
  for (const Vec<dim> &n : directions_between_axes<dim>())
    cell.cut(n, apothem);
  return cell;
}

/// Builds the cells of one cloud.
template <int dim> class CellBuilder {
public:
  CellBuilder(Points<dim> &points, Cloud<dim> &cloud)
      : points_(points), cloud_(cloud), free_(ball_like_cell<dim>(horizon * cloud.spacing)),
        lone_apothem_(cloud.spacing * lone_ratio()) {
    if constexpr (dim == 2) {
      for (int k = 0; k < 8; ++k)
        directions_.emplace_back(std::cos(k * std::numbers::pi / 4),
                                 std::sin(k * std::numbers::pi / 4));
    } else {
      directions_ = directions_between_axes<3>();
      for (int d = 0; d < 3; ++d)
        directions_.insert(directions_.end(), {Vec<3>::Unit(d), -Vec<3>::Unit(d)});
    }
  }

  void update(int i) const {
    const VoronoiCell<dim> cell = cell_of(i);
    const bool was_open = points_.at_surface[i] == SurfaceMemory::open;
    const double limit = cloud_.has_air ? (was_open ? close_ratio : open_ratio) * cloud_.spacing
                                        : std::numeric_limits<double>::infinity();
    cloud_.surface_normal[i] = Vec<dim>::Zero();
    cloud_.kind[i] = PointKind::interior;
    const bool is_open = cell.reach() > limit;
    const Vec<dim> offset = cell.centroid();
    cloud_.centroid_offset[i] = offset;
    if (!is_open) {
      cloud_.cell_volume[i] = cell.volume();
      return;
    }
    points_.at_surface[i] = SurfaceMemory::open;
    const bool is_thin = offset.norm() < thin_ratio * cloud_.spacing;
    cloud_.kind[i] = is_thin ? PointKind::thin : PointKind::surface;
    cloud_.surface_normal[i] = is_thin ? Vec<dim>(Vec<dim>::Zero()) : Vec<dim>(offset.normalized());
    cloud_.cell_volume[i] = enveloped_volume(cell, cloud_.surface_normal[i], cloud_.kind[i]);
  }

private:
  VoronoiCell<dim> cell_of(int i) const {
    VoronoiCell<dim> cell = free_;
    const Vec<dim> &x = points_.position[i];
    const double near2 = std::pow(1.3 * cloud_.spacing, 2);
    const auto neighbours = cloud_.neighbours.of(i);
    for (const int j : neighbours)
      if (const Vec<dim> r = points_.position[j] - x; r.squaredNorm() < near2)
        cut_towards(cell, r);
    if (const PointWalls<dim> *walls = cloud_.walls_of(i))
      for (const Projection<dim> &p : *walls)
        cell.cut(p.normal, std::max(p.distance, 1e-3 * cloud_.spacing));
    for (const int j : neighbours)
      if (const Vec<dim> r = points_.position[j] - x; r.squaredNorm() >= near2)
        cut_towards(cell, r);
    return cell;
  }

  // The part of an open cell that counts as fluid: up to half a spacing outside the point.
  double enveloped_volume(VoronoiCell<dim> cell, const Vec<dim> &normal, PointKind kind) const {
    const double limit = kind == PointKind::thin ? lone_apothem_ : cloud_.spacing;
    for (const Vec<dim> &n : directions_)
      cell.cut(n, limit);
    if (kind == PointKind::surface)
      cell.cut(normal, 0.5 * cloud_.spacing);
    return cell.volume();
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
  std::vector<Vec<dim>> directions_;
};

} // namespace

template <int dim>
void update_walls(Points<dim> &points, const Walls<dim> &walls, double spacing, Cloud<dim> &cloud) {
  cloud.spacing = spacing;
  cloud.radius = kernel_radius_ratio * spacing;
  cloud.grid = grid_over(points, cloud.radius);
  sort_by_cell(points, cloud.grid, cloud.ranges);
  find_walls(points, walls, cloud);
}

template <int dim>
void update_neighbours(const Points<dim> &points, const Walls<dim> &walls, Cloud<dim> &cloud) {
  find_neighbours(points, cloud.grid, cloud.ranges, cloud.radius, cloud.neighbours);
  drop_hidden_neighbours(points, walls, cloud);
}

template <int dim> void update_cells(Points<dim> &points, Cloud<dim> &cloud) {
  const int n = points.size();
  cloud.kind.resize(n);
  cloud.surface_normal.resize(n);
  cloud.cell_volume.resize(n);
  cloud.centroid_offset.resize(n);
  const CellBuilder<dim> cells(points, cloud);
  for_each_index(n, [&](int i) { cells.update(i); });
}

template void update_walls(Points<2> &, const Walls<2> &, double, Cloud<2> &);
template void update_neighbours(const Points<2> &, const Walls<2> &, Cloud<2> &);
template void update_cells(Points<2> &, Cloud<2> &);
template void update_walls(Points<3> &, const Walls<3> &, double, Cloud<3> &);
template void update_neighbours(const Points<3> &, const Walls<3> &, Cloud<3> &);
template void update_cells(Points<3> &, Cloud<3> &);

} // namespace sluice::fluid
