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

// Radius of an empty circle through a point that counts as air, in spacings. A square lattice has
// 0.71, a well kept cloud less than 0.9. The lower value holds for points that were open before:
// a flag that would flicker between them keeps its state.
constexpr double open_ratio = 1.2;
constexpr double close_ratio = 1.0;
// Distance to which an open cell is followed into the air, in spacings.
constexpr double horizon = 1.5;
// A cell that is open on both sides has its centroid near the point; on one side 0.5 spacings off.
constexpr double thin_ratio = 0.2;

void find_walls(const Points &points, const Walls &walls, Cloud &cloud) {
  find_near_segments(walls, cloud.grid, cloud.radius, cloud.near_segments);
  const int n = points.size();
  cloud.wall_slot.assign(n, -1);
  cloud.wall_points.clear();
  for (int c = 0; c < cloud.grid.n_cells(); ++c)
    if (!cloud.near_segments.near(c).empty())
      for (int i = cloud.ranges.start[c]; i < cloud.ranges.start[c + 1]; ++i) {
        cloud.wall_slot[i] = static_cast<int>(cloud.wall_points.size());
        cloud.wall_points.push_back(i);
      }
  cloud.point_walls.resize(cloud.wall_points.size());
  for_each_index(static_cast<int>(cloud.wall_points.size()), [&](int k) {
    const Vec<2> &x = points.position[cloud.wall_points[k]];
    const auto candidates = cloud.near_segments.near(cloud.grid.cell(x));
    cloud.point_walls[k] = project_on_walls(walls, candidates, x, cloud.radius);
  });
}

void drop_hidden_neighbours(const Points &points, const Walls &walls, Cloud &cloud) {
  for_each_index(static_cast<int>(cloud.wall_points.size()), [&](int k) {
    const int i = cloud.wall_points[k];
    const Vec<2> &x = points.position[i];
    const auto candidates = cloud.near_segments.near(cloud.grid.cell(x));
    int *const first = cloud.neighbours.first(i);
    int *const last = std::remove_if(first, first + cloud.neighbours.count[i], [&](int j) {
      return is_hidden(walls, candidates, x, points.position[j]);
    });
    cloud.neighbours.count[i] = static_cast<int>(last - first);
  });
}

VoronoiCell octagon(double apothem) {
  VoronoiCell cell(apothem);
  const double s = std::numbers::sqrt2 / 2;
  for (const Vec<2> &n : {Vec<2>(s, s), Vec<2>(-s, s), Vec<2>(-s, -s), Vec<2>(s, -s)})
    cell.cut(n, apothem);
  return cell;
}

VoronoiCell cell_of(int i, const Points &points, const Cloud &cloud) {
  VoronoiCell cell = octagon(horizon * cloud.spacing);
  const Vec<2> &x = points.position[i];
  const double near2 = std::pow(1.3 * cloud.spacing, 2);
  const auto neighbours = cloud.neighbours.of(i);
  for (const int j : neighbours)
    if (const Vec<2> r = points.position[j] - x; r.squaredNorm() < near2)
      cell.cut_towards(r);
  if (const PointWalls *walls = cloud.walls_of(i))
    for (const Projection &p : *walls)
      cell.cut(p.normal, std::max(p.distance, 1e-3 * cloud.spacing));
  for (const int j : neighbours)
    if (const Vec<2> r = points.position[j] - x; r.squaredNorm() >= near2)
      cell.cut_towards(r);
  return cell;
}

// The part of an open cell that counts as fluid: up to half a spacing outside the point.
double enveloped_area(VoronoiCell cell, const Vec<2> &normal, PointKind kind, double spacing) {
  const double half = 0.5 * spacing;
  // An octagon of this apothem has the area of one point, spacing^2.
  const double lone = spacing / std::sqrt(8 * std::tan(std::numbers::pi / 8));
  const double limit = kind == PointKind::thin ? lone : spacing;
  for (int k = 0; k < 8; ++k) {
    const double angle = k * std::numbers::pi / 4;
    cell.cut({std::cos(angle), std::sin(angle)}, limit);
  }
  if (kind == PointKind::surface)
    cell.cut(normal, half);
  return cell.area();
}

void update_cell(int i, Points &points, Cloud &cloud) {
  const VoronoiCell cell = cell_of(i, points, cloud);
  const bool was_open = points.at_surface[i] == SurfaceMemory::open;
  const double limit = cloud.has_air ? (was_open ? close_ratio : open_ratio) * cloud.spacing
                                     : std::numeric_limits<double>::infinity();
  cloud.surface_normal[i] = Vec<2>::Zero();
  cloud.kind[i] = PointKind::interior;
  const bool is_open = cell.reach() > limit;
  const Vec<2> offset = cell.centroid();
  cloud.centroid_offset[i] = offset;
  if (!is_open) {
    cloud.cell_area[i] = cell.area();
    return;
  }
  points.at_surface[i] = SurfaceMemory::open;
  const bool is_thin = offset.norm() < thin_ratio * cloud.spacing;
  cloud.kind[i] = is_thin ? PointKind::thin : PointKind::surface;
  cloud.surface_normal[i] = is_thin ? Vec<2>(Vec<2>::Zero()) : Vec<2>(offset.normalized());
  cloud.cell_area[i] =
      enveloped_area(cell, cloud.surface_normal[i], cloud.kind[i], cloud.spacing);
}

} // namespace

void update_walls(Points &points, const Walls &walls, double spacing, Cloud &cloud) {
  cloud.spacing = spacing;
  cloud.radius = kernel_radius_ratio * spacing;
  cloud.grid = grid_over(points, cloud.radius);
  sort_by_cell(points, cloud.grid, cloud.ranges);
  find_walls(points, walls, cloud);
}

void update_neighbours(const Points &points, const Walls &walls, Cloud &cloud) {
  find_neighbours(points, cloud.grid, cloud.ranges, cloud.radius, cloud.neighbours);
  drop_hidden_neighbours(points, walls, cloud);
}

void update_cells(Points &points, Cloud &cloud) {
  const int n = points.size();
  cloud.kind.resize(n);
  cloud.surface_normal.resize(n);
  cloud.cell_area.resize(n);
  cloud.centroid_offset.resize(n);
  for_each_index(n, [&](int i) { update_cell(i, points, cloud); });
}

} // namespace sluice::fluid
