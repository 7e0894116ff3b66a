// SPDX-License-Identifier: MIT
#include "fluid/filling.hpp"

#include "bridge/base/check.hpp"
#include "fluid/coordinates.hpp"
#include "fluid/formula.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>

namespace sluice::fluid {

namespace {

constexpr double most_points = 2e8;

bool is_inside(const std::vector<Vec<2>> &polygon, const Vec<2> &x) {
  bool inside = false;
  for (std::size_t k = 0, m = polygon.size() - 1; k < polygon.size(); m = k++) {
    const Vec<2> &a = polygon[k], &b = polygon[m];
    if ((a.y() > x.y()) != (b.y() > x.y()) &&
        x.x() < (b.x() - a.x()) * (x.y() - a.y()) / (b.y() - a.y()) + a.x())
      inside = !inside;
  }
  return inside;
}

double signed_area(const std::vector<Vec<2>> &polygon) {
  double twice = 0;
  for (std::size_t k = 0, m = polygon.size() - 1; k < polygon.size(); m = k++)
    twice += cross(polygon[m], polygon[k]);
  return 0.5 * twice;
}

struct Box {
  Vec<2> low = Vec<2>::Constant(1e300), high = Vec<2>::Constant(-1e300);
};

Box bounding_box(const std::vector<Vec<2>> &points) {
  Box box;
  for (const Vec<2> &x : points) {
    box.low = box.low.cwiseMin(x);
    box.high = box.high.cwiseMax(x);
  }
  return box;
}

// Square lattice over the box, half a spacing inside its edges, turned about the box's corner.
std::vector<Vec<2>> lattice_in(const std::vector<Vec<2>> &polygon, double spacing, double angle) {
  const Vec<2> corner = bounding_box(polygon).low;
  Mat<2> turn;
  turn << std::cos(angle), -std::sin(angle), std::sin(angle), std::cos(angle);
  std::vector<Vec<2>> in_lattice; // the polygon in coordinates along the rows, in spacings
  for (const Vec<2> &x : polygon)
    in_lattice.push_back(turn.transpose() * (x - corner) / spacing);
  const Box extent = bounding_box(in_lattice);
  std::vector<Vec<2>> points;
  for (double j = std::floor(extent.low.y()) + 0.5; j < extent.high.y(); ++j)
    for (double i = std::floor(extent.low.x()) + 0.5; i < extent.high.x(); ++i)
      if (const Vec<2> x = corner + spacing * (turn * Vec<2>(i, j)); is_inside(polygon, x))
        points.push_back(x);
  return points;
}

// Centres of the layers of points along z.
template <int dim> std::vector<double> layers(const FluidParams<dim> &params) {
  std::vector<double> z;
  if constexpr (dim == 2)
    z = {0};
  else
    for (double k = 0.5; k * params.spacing < params.depth; ++k)
      z.push_back(k * params.spacing);
  return z;
}

template <int dim> Vec<dim> at_depth(const Vec<2> &x, [[maybe_unused]] double z) {
  if constexpr (dim == 2)
    return x;
  else
    return {x.x(), x.y(), z};
}

template <int dim>
void check_hole(const FluidParams<dim> &params, const Walls<dim> &walls, const Vec<dim> &x) {
  const double nearest = distance_to_walls(walls, x);
  check(nearest < 0.5 * params.spacing,
        "hole in the walls below the water line at {} m: the nearest wall is {:.3g} m "
        "away; close the wall there, or set open_sides = true if the water is meant to run out",
        text_of(x), nearest);
}

// Below the highest corner of the water, or the level of the flood: what is shown at t = 0, and the
// first guess of the solver.
template <int dim>
std::vector<double> hydrostatic_pressure(const FluidParams<dim> &params,
                                         const std::vector<Vec<dim>> &positions) {
  double at_surface = 1e300;
  for (const Vec<2> &corner : params.water)
    for (const double z : {0.0, params.depth})
      at_surface = std::min(at_surface, params.gravity.dot(at_depth<dim>(corner, z)));
  if (params.is_flooded())
    at_surface = params.gravity[1] * params.fill_level;
  std::vector<double> pressure;
  for (const Vec<dim> &x : positions)
    pressure.push_back(params.density * (params.gravity.dot(x) - at_surface));
  return pressure;
}

template <int dim> void check_water(const FluidParams<dim> &params) {
  const double area = std::abs(signed_area(params.water));
  const Box box = bounding_box(params.water);
  Vec<dim> size = at_depth<dim>(box.high - box.low, params.depth) / params.spacing;
  check(area > 0, "water_m: the corners enclose no area; is an edge missing?");
  check(size.prod() <= most_points,
        "water_m spans {} points at a spacing of {} m, at most {:.0e} are handled; use "
        "a larger spacing_m",
        text_of_size(size), params.spacing, most_points);
  for (const Vec<2> &corner : params.water)
    check(corner.x() < params.outlet_x,
          "the corner {} m of water_m lies beyond the outlet at outlet_x_m = {}", text_of(corner),
          params.outlet_x);
}

// Rows along two edges, half a distance inside; a rhombus of 60 degrees gets a triangular lattice.
std::vector<Vec<2>> lattice_along_edges(const std::vector<Vec<2>> &polygon, double spacing) {
  check(polygon.size() == 4 &&
            (polygon[0] + polygon[2] - polygon[1] - polygon[3]).norm() < 1e-6 * spacing,
        "lattice = \"edges\" needs a parallelogram as water_m");
  const Vec<2> a = polygon[1] - polygon[0], b = polygon[3] - polygon[0];
  const double widening = std::sqrt(a.norm() * b.norm() / std::abs(cross(a, b)));
  const auto count = [&](const Vec<2> &edge) {
    return std::max(1, static_cast<int>(std::lround(edge.norm() / (widening * spacing))));
  };
  const int na = count(a), nb = count(b);
  std::vector<Vec<2>> points;
  for (int j = 0; j < nb; ++j)
    for (int i = 0; i < na; ++i)
      points.push_back(polygon[0] + (i + 0.5) / na * a + (j + 0.5) / nb * b);
  return points;
}

template <int dim> std::vector<Vec<dim>> points_in_outline(const FluidParams<dim> &params) {
  check_water(params);
  const std::vector<Vec<2>> section =
      params.lattice == "edges"
          ? lattice_along_edges(params.water, params.spacing)
          : lattice_in(params.water, params.spacing, params.lattice_angle * std::numbers::pi / 180);
  std::vector<Vec<dim>> points;
  for (const double z : layers(params))
    for (const Vec<2> &x : section)
      points.push_back(at_depth<dim>(x, z));
  check(points.size() >= 4, "water_m holds {} points at a spacing of {} m; use a smaller spacing_m",
        points.size(), params.spacing);
  return points;
}

// --- flood ------------------------------------------------------------------------------------

/// Fluid that rises from a place: cells of a grid over the walls, one point in the middle of each.
template <int dim> class Flood {
public:
  Flood(const FluidParams<dim> &params, const Walls<dim> &walls)
      : params_(params), walls_(walls), grid_(grid_over_walls()) {
    tree_.update(walls_);
  }

  std::vector<Vec<dim>> points() const {
    const Vec<dim> &from = params_.fill_from;
    check((from.array() >= grid_.origin.array()).all() &&
              (from.array() <= grid_.top().array()).all(),
          "fill_from_m = {} m lies outside of all walls, which reach from {} to {} m",
          text_of(from), text_of(grid_.origin), text_of(grid_.top()));
    const Place start = grid_.place(params_.fill_from);
    check(is_free(start),
          "fill_from_m = {} m is above fill_level_m = {} m or closer than {} m to a wall",
          text_of(params_.fill_from), params_.fill_level, clearance());
    std::vector<char> seen(grid_.n_cells(), 0);
    std::vector<Place> wet{start};
    seen[grid_.cell(centre(start))] = 1;
    for (std::size_t k = 0; k < wet.size(); ++k) { // grows while it is read
      check_border(wet[k]);
      for (int d = 0; d < dim; ++d)
        for (const int step : {-1, 1}) {
          Place next = wet[k];
          next[d] += step;
          if (next[d] < 0 || next[d] >= grid_.size[d])
            continue;
          char &known = seen[grid_.cell(centre(next))];
          if (known != 0 || is_crossing(wet[k], next))
            continue;
          check_in_front(next);
          known = is_free(next);
          if (known != 0)
            wet.push_back(next);
        }
    }
    std::vector<Vec<dim>> points;
    for (const Place &at : wet)
      points.push_back(centre(at));
    return points;
  }

private:
  using Place = typename Grid<dim>::Place;

  // Points nearer to a wall would be put back at the first step.
  double clearance() const { return params_.motion.wall_clearance * params_.spacing; }

  Grid<dim> grid_over_walls() const {
    Vec<dim> low = walls_.position.front(), high = low;
    for (const Vec<dim> &x : walls_.position) {
      low = low.cwiseMin(x);
      high = high.cwiseMax(x);
    }
    const Vec<dim> cells = (high - low) / params_.spacing;
    check(cells.prod() <= most_points,
          "the walls span {} points at a spacing of {} m, at most {:.0e} are handled; use a larger "
          "spacing_m",
          text_of_size(cells), params_.spacing, most_points);
    Grid<dim> grid{low, params_.spacing, {}};
    for (int d = 0; d < dim; ++d)
      grid.size[d] = std::max(1, static_cast<int>(std::lround(cells[d])));
    return grid;
  }

  Vec<dim> centre(const Place &at) const {
    Vec<dim> x = grid_.origin;
    for (int d = 0; d < dim; ++d)
      x[d] += (at[d] + 0.5) * grid_.cell_size;
    return x;
  }

  bool is_free(const Place &at) const {
    const Vec<dim> x = centre(at);
    if (x[1] > params_.fill_level)
      return false;
    const auto walls = project_on_walls(walls_, tree_, x, params_.spacing);
    return std::all_of(walls.begin(), walls.end(),
                       [&](const Projection<dim> &p) { return p.distance >= clearance(); });
  }

  bool is_crossing(const Place &from, const Place &to) const {
    return is_hidden(walls_, tree_, centre(from), centre(to));
  }

  void check_in_front(const Place &at) const {
    const Vec<dim> x = centre(at);
    for (const Projection<dim> &p : project_on_walls(walls_, tree_, x, params_.spacing))
      check(p.distance >= 0,
            "the fluid from fill_from_m lies behind wall '{}' at {} m; turn the wall round: its "
            "fluid "
            "is on the left of points_m, in front of the faces of a file (or set reversed = true)",
            walls_.names[walls_.faces[p.face].wall], text_of(x));
  }

  void check_border(const Place &at) const {
    for (int d = 0; d < dim; ++d)
      if ((at[d] == 0 || at[d] == grid_.size[d] - 1) &&
          !is_near_walls(walls_, tree_, centre(at), params_.spacing + grid_.half_diagonal()))
        fail("the fluid runs out of the scene at {} m, where no wall is within {} m; close the "
             "walls below fill_level_m = {} m",
             text_of(centre(at)), params_.spacing, params_.fill_level);
  }

  const FluidParams<dim> &params_;
  const Walls<dim> &walls_;
  Grid<dim> grid_;
  FaceTree<dim> tree_;
};

// --- start ------------------------------------------------------------------------------------

// Random displacements of every coordinate by up to `amplitude` [m]; next to a wall by up to half
// of what keeps the point off it.
template <int dim> void disturb(double amplitude, const Walls<dim> &walls, Points<dim> &points) {
  std::mt19937_64 random(1); // always the same points
  const auto between = [&] { // -1 and 1, the same on every platform
    return static_cast<double>(random() >> 11) * 0x1p-52 - 1;
  };
  const double reach = 4 * amplitude;
  FaceTree<dim> tree;
  tree.update(walls);
  for (Vec<dim> &x : points.position) {
    double largest = amplitude;
    for (const Projection<dim> &p : project_on_walls(walls, tree, x, reach))
      largest = std::min(largest, 0.5 * std::max(p.distance, 0.0) / std::sqrt(double{dim}));
    for (double &coordinate : x)
      coordinate += largest * between();
  }
}

} // namespace

template <int dim> double outlined_volume(const FluidParams<dim> &params) {
  const double area = params.is_flooded() ? 0 : std::abs(signed_area(params.water));
  return dim == 2 ? area : area * params.depth;
}

template <int dim> Points<dim> fill(const FluidParams<dim> &params, const Walls<dim> &walls) {
  Points<dim> points;
  points.position =
      params.is_flooded() ? Flood<dim>(params, walls).points() : points_in_outline(params);
  if (params.start_jitter > 0)
    disturb(params.start_jitter * params.spacing, walls, points);
  const std::size_t n = points.position.size();
  const Formula<dim> start_velocity(params.start_velocity);
  for (const Vec<dim> &x : points.position)
    points.velocity.push_back(start_velocity(x, 0));
  points.previous_velocity = points.velocity;
  for (auto *v : {&points.shift, &points.shift_velocity})
    v->assign(n, Vec<dim>::Zero());
  points.pressure_gradient.assign(n, params.density * params.gravity);
  points.pressure = hydrostatic_pressure(params, points.position);
  points.surface_pressure.assign(n, 0);
  points.strain_rate.assign(n, 0);
  points.at_surface.assign(n, SurfaceMemory::enclosed);
  points.id.resize(n);
  for (std::size_t i = 0; i < n; ++i)
    points.id[i] = static_cast<std::int32_t>(i);
  return points;
}

// Every edge of the water that does not face upwards must lie on a wall, and both ends of the
// sweep.
template <int dim>
void check_holes(const FluidParams<dim> &params, const Walls<dim> &walls,
                 const Points<dim> &points) {
  const std::vector<Vec<2>> &water = params.water;
  const double orientation = signed_area(water) > 0 ? 1 : -1;
  const Vec<2> up = -params.gravity.template head<2>().normalized();
  for (std::size_t k = 0; k < water.size(); ++k) {
    const Vec<2> a = water[k], e = water[(k + 1) % water.size()] - a;
    const Vec<2> outward = -orientation * rotated_left(e).normalized();
    if (outward.dot(up) > 0.1)
      continue;
    const int samples = std::max(2, static_cast<int>(e.norm() / params.spacing));
    for (int m = 0; m < samples; ++m)
      for (const double z : layers(params))
        check_hole(params, walls, at_depth<dim>(a + (m + 0.5) / samples * e, z));
  }
  if constexpr (dim == 3)
    for (const Vec<3> &x : points.position)
      for (const double z : {0.0, params.depth})
        if (std::abs(x.z() - z) < params.spacing)
          check_hole(params, walls, Vec<3>(x.x(), x.y(), z));
}

template Points<2> fill(const FluidParams<2> &, const Walls<2> &);
template Points<3> fill(const FluidParams<3> &, const Walls<3> &);
template double outlined_volume(const FluidParams<2> &);
template double outlined_volume(const FluidParams<3> &);
template void check_holes(const FluidParams<2> &, const Walls<2> &, const Points<2> &);
template void check_holes(const FluidParams<3> &, const Walls<3> &, const Points<3> &);

} // namespace sluice::fluid
