// SPDX-License-Identifier: MIT
#include "fluid/scene.hpp"

#include "bridge/base/check.hpp"
#include "fluid/coordinates.hpp"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <numbers>
#include <set>

namespace sluice::fluid {

namespace {

// --- walls ----------------------------------------------------------------------------------

// Places along z where what is given in the plane is repeated: both ends, and in between so that no
// coupled triangle is wider than its segments are long. One list for all walls: their triangles
// meet.
template <int dim>
std::vector<double> swept_places(const std::vector<WallParams<dim>> &tables, double depth) {
  double longest = depth;
  for (const WallParams<dim> &wall : tables)
    if (wall.segment_length > 0)
      longest = std::min(longest, wall.segment_length);
  const int pieces = std::max(1, static_cast<int>(std::ceil(depth / longest - 1e-9)));
  std::vector<double> z;
  for (int k = 0; k <= pieces; ++k)
    z.push_back(depth * k / pieces);
  return z;
}

/// Adds the walls of the case file to the scene's.
template <int dim> class WallBuilder {
public:
  WallBuilder(const std::vector<WallParams<dim>> &tables, double depth, Walls<dim> &walls)
      : walls_(walls) {
    if constexpr (dim == 3)
      z_ = swept_places(tables, depth);
    else
      z_ = {0};
  }

  void add(const WallParams<dim> &wall, const SurfaceMesh &surface) {
    check(!wall.coupled || wall.velocity.isZero(),
          "wall '{}': a coupled wall moves as its partner says, not with velocity_m_s", wall.name);
    start(wall.name, wall.condition);
    const int first = static_cast<int>(walls_.position.size());
    const int first_face = static_cast<int>(walls_.faces.size());
    if (wall.file.empty())
      sweep(wall);
    else
      add_surface(surface, wall.reversed);
    walls_.velocity.resize(walls_.position.size(), place(wall.velocity, 0));
    if (!wall.coupled)
      return;
    for (int v = first; v < static_cast<int>(walls_.position.size()); ++v)
      walls_.coupled_vertices.push_back(v);
    for (int f = first_face; f < static_cast<int>(walls_.faces.size()); ++f)
      walls_.coupled_faces.push_back(f);
  }

  /// Rectangles at both ends of the sweep, around all that has been added.
  void add_sides(const std::string &condition) requires(dim == 3) {
    Vec<3> low = walls_.position.front(), high = low;
    for (const Vec<3> &x : walls_.position) {
      low = low.cwiseMin(x);
      high = high.cwiseMax(x);
    }
    start("sides", condition);
    for (const double z : {z_.front(), z_.back()}) {
      const int a = static_cast<int>(walls_.position.size());
      for (const Vec<2> &x : {Vec<2>(low.x(), low.y()), Vec<2>(high.x(), low.y()),
                              Vec<2>(high.x(), high.y()), Vec<2>(low.x(), high.y())})
        walls_.position.push_back(place(x, z));
      const bool is_low = z == z_.front(); // seen from the fluid, counter-clockwise
      add_face(is_low ? std::array{a, a + 1, a + 2} : std::array{a, a + 2, a + 1});
      add_face(is_low ? std::array{a, a + 2, a + 3} : std::array{a, a + 3, a + 2});
    }
    walls_.velocity.resize(walls_.position.size(), Vec<3>::Zero());
  }

private:
  void sweep(const WallParams<dim> &wall) {
    const int first = static_cast<int>(walls_.position.size());
    const int first_face = static_cast<int>(walls_.faces.size());
    const std::vector<Vec<2>> outline = cut_into_segments(wall);
    for (const Vec<2> &x : outline)
      for (const double z : z_)
        walls_.position.push_back(place(x, z));
    for (int k = 1; k < static_cast<int>(outline.size()); ++k)
      add_segment(first + (k - 1) * n_z(), first + k * n_z());
    for (int f = first_face; f < static_cast<int>(walls_.faces.size()); ++f)
      walls_.faces[f].number = f - first_face;
  }

  void add_surface([[maybe_unused]] const SurfaceMesh &surface, [[maybe_unused]] bool reversed) {
    if constexpr (dim == 3) {
      const int first = static_cast<int>(walls_.position.size());
      walls_.position.insert(walls_.position.end(), surface.position.begin(),
                             surface.position.end());
      for (std::size_t k = 0; k < surface.triangles.size(); ++k) {
        auto [a, b, c] = surface.triangles[k];
        if (reversed)
          std::swap(b, c);
        add_face({first + a, first + b, first + c});
        walls_.faces.back().number = surface.face[k];
      }
    }
  }

  int n_z() const { return static_cast<int>(z_.size()); }

  static Vec<dim> place(const Vec<2> &x, [[maybe_unused]] double z) {
    if constexpr (dim == 2)
      return x;
    else
      return {x.x(), x.y(), z};
  }

  void start(const std::string &name, const std::string &condition) {
    walls_.names.push_back(name);
    walls_.slip.push_back(condition == "free-slip" ? Slip::free : Slip::none);
  }

  void add_face(const std::array<int, dim> &vertex) {
    walls_.faces.push_back({vertex, static_cast<int>(walls_.names.size()) - 1});
  }

  // The segment between two vertices, or the triangles between two rows of vertices along z.
  void add_segment(int a, int b) {
    if constexpr (dim == 2)
      add_face({a, b});
    else
      for (int k = 0; k + 1 < n_z(); ++k) {
        add_face({a + k, a + k + 1, b + k});
        add_face({b + k, a + k + 1, b + k + 1});
      }
  }

  static std::vector<Vec<2>> cut_into_segments(const WallParams<dim> &wall) {
    std::vector<Vec<2>> outline{wall.points.front()};
    for (std::size_t k = 1; k < wall.points.size(); ++k) {
      check((wall.points[k] - wall.points[k - 1]).norm() > 1e-9,
            "wall '{}': points {} and {} coincide at {} m", wall.name, k - 1, k,
            text_of(wall.points[k]));
      const Vec<2> leg = (wall.points[k] - wall.points[k - 1]).normalized();
      check(std::abs(cross(leg, wall.velocity)) <= 1e-9 * wall.velocity.norm(),
            "wall '{}': velocity_m_s = [{}, {}] points across the leg from point {} to {}; it may "
            "only slide along itself",
            wall.name, wall.velocity.x(), wall.velocity.y(), k - 1, k);
      cut_leg(wall, wall.points[k], outline);
    }
    return outline;
  }

  static void cut_leg(const WallParams<dim> &wall, const Vec<2> &to, std::vector<Vec<2>> &outline) {
    const Vec<2> from = outline.back();
    const double length = (to - from).norm();
    constexpr double most_pieces = 1e6;
    const double wanted =
        wall.segment_length > 0 ? std::ceil(length / wall.segment_length - 1e-9) : 1;
    check(wanted <= most_pieces,
          "wall '{}': segment_length_m = {} m cuts a leg of {} m into {:.3g} "
          "pieces, at most {:.0e} are handled",
          wall.name, wall.segment_length, length, wanted, most_pieces);
    const int pieces = std::max(1, static_cast<int>(wanted));
    for (int k = 1; k <= pieces; ++k) {
      const double t = static_cast<double>(k) / pieces;
      outline.push_back(k == pieces ? to : Vec<2>((1 - t) * from + t * to));
    }
  }

  Walls<dim> &walls_;
  std::vector<double> z_; // [m]
};

// Names become columns and groups of the output.
template <class Named> void check_names(const std::vector<Named> &all, std::string_view kind) {
  std::set<std::string> seen;
  for (const Named &one : all) {
    const bool is_plain =
        !one.name.empty() && std::all_of(one.name.begin(), one.name.end(), [](unsigned char c) {
          return std::isalnum(c) || c == '_' || c == '-';
        });
    check(is_plain, "{} '{}': a name has letters, digits, '_' and '-' only", kind, one.name);
    check(seen.insert(one.name).second, "two {}s are called '{}'", kind, one.name);
  }
}

template <int dim>
SurfaceMesh surface_of(const WallParams<dim> &wall, const Config &config,
                       const SurfaceReader &read_surface) {
  if (wall.file.empty())
    return {};
  check(read_surface != nullptr, "wall '{}': this program was built without a reader of files",
        wall.name);
  return read_surface(std::filesystem::path(config.file_name()).parent_path() / wall.file);
}

void check_surfaces(const std::vector<WallParams<2>> &, const Walls<2> &) {}
void check_surfaces(const std::vector<WallParams<3>> &tables, const Walls<3> &walls) {
  for (int w = 0; w < static_cast<int>(tables.size()); ++w) {
    if (tables[w].file.empty())
      continue;
    if (!tables[w].open)
      check_closed(walls, w);
    check_free_of_crossings(walls, w);
  }
}

template <int dim>
Walls<dim> read_walls(const Config &config, const FluidParams<dim> &params,
                      const SurfaceReader &read_surface) {
  Walls<dim> walls;
  const auto tables = config.read_all<WallParams<dim>>("fluid.wall");
  check(!tables.empty(), "{}: the scene has no [[fluid.wall]]", config.file_name());
  check_names(tables, "wall");
  WallBuilder<dim> builder(tables, params.depth, walls);
  for (const WallParams<dim> &wall : tables)
    builder.add(wall, surface_of(wall, config, read_surface));
  if constexpr (dim == 3)
    if (params.side_walls != "none")
      builder.add_sides(params.side_walls);
  link_faces(walls);
  check_surfaces(tables, walls);
  return walls;
}

// --- water ----------------------------------------------------------------------------------

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

template <int dim> void check_hole(const Scene<dim> &scene, const Vec<dim> &x) {
  const double nearest = distance_to_walls(scene.walls, x);
  check(nearest < 0.5 * scene.params.spacing,
        "hole in the walls below the water line at {} m: the nearest wall is {:.3g} m "
        "away; close the wall there, or set open_sides = true if the water is meant to run out",
        text_of(x), nearest);
}

// Every edge of the water that does not face upwards must lie on a wall, and both ends of the
// sweep.
template <int dim> void check_holes(const Scene<dim> &scene) {
  const std::vector<Vec<2>> &water = scene.params.water;
  const double orientation = signed_area(water) > 0 ? 1 : -1;
  const Vec<2> up = -scene.params.gravity.template head<2>().normalized();
  for (std::size_t k = 0; k < water.size(); ++k) {
    const Vec<2> a = water[k], e = water[(k + 1) % water.size()] - a;
    const Vec<2> outward = -orientation * rotated_left(e).normalized();
    if (outward.dot(up) > 0.1)
      continue;
    const int samples = std::max(2, static_cast<int>(e.norm() / scene.params.spacing));
    for (int m = 0; m < samples; ++m)
      for (const double z : layers(scene.params))
        check_hole(scene, at_depth<dim>(a + (m + 0.5) / samples * e, z));
  }
  if constexpr (dim == 3)
    for (const Vec<3> &x : scene.initial.points.position)
      for (const double z : {0.0, scene.params.depth})
        if (std::abs(x.z() - z) < scene.params.spacing)
          check_hole(scene, Vec<3>(x.x(), x.y(), z));
}

// Below the highest corner of the water: what is shown at t = 0, and the first guess of the solver.
template <int dim>
std::vector<double> hydrostatic_pressure(const FluidParams<dim> &params,
                                         const std::vector<Vec<dim>> &positions) {
  double at_surface = 1e300;
  for (const Vec<2> &corner : params.water)
    for (const double z : {0.0, params.depth})
      at_surface = std::min(at_surface, params.gravity.dot(at_depth<dim>(corner, z)));
  std::vector<double> pressure;
  for (const Vec<dim> &x : positions)
    pressure.push_back(params.density * (params.gravity.dot(x) - at_surface));
  return pressure;
}

template <int dim> void check_water(const FluidParams<dim> &params) {
  const double area = std::abs(signed_area(params.water));
  const Box box = bounding_box(params.water);
  Vec<dim> size = at_depth<dim>(box.high - box.low, params.depth) / params.spacing;
  constexpr double most_points = 2e8;
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

template <int dim> Points<dim> fill(const FluidParams<dim> &params) {
  check_water(params);
  Points<dim> points;
  const std::vector<Vec<2>> section =
      params.lattice == "edges"
          ? lattice_along_edges(params.water, params.spacing)
          : lattice_in(params.water, params.spacing, params.lattice_angle * std::numbers::pi / 180);
  for (const double z : layers(params))
    for (const Vec<2> &x : section)
      points.position.push_back(at_depth<dim>(x, z));
  const std::size_t n = points.position.size();
  check(n >= 4, "water_m holds {} points at a spacing of {} m; use a smaller spacing_m", n,
        params.spacing);
  for (auto *v :
       {&points.velocity, &points.previous_velocity, &points.shift, &points.shift_velocity})
    v->assign(n, Vec<dim>::Zero());
  points.pressure_gradient.assign(n, params.density * params.gravity);
  points.pressure = hydrostatic_pressure(params, points.position);
  points.at_surface.assign(n, SurfaceMemory::enclosed);
  points.id.resize(n);
  for (std::size_t i = 0; i < n; ++i)
    points.id[i] = static_cast<std::int32_t>(i);
  return points;
}

} // namespace

template <int dim> double volume_error(const Scene<dim> &scene) {
  const FluidParams<dim> &params = scene.params;
  const double spacing = params.spacing, area = std::abs(signed_area(params.water));
  if constexpr (dim == 2)
    return scene.initial.points.size() * spacing * spacing / area - 1;
  else
    return scene.initial.points.size() * volume_of_point<3>(spacing) / (area * params.depth) - 1;
}

template <int dim> void check_clear_of_walls(const Scene<dim> &scene, double tolerance) {
  const double spacing = scene.params.spacing;
  const auto &position = scene.initial.points.position;
  const Grid<dim> grid = grid_over(scene.initial.points, 4 * spacing);
  FaceGrid near;
  find_near_faces(scene.walls, grid, spacing, near);
  for (const Vec<dim> &x : position)
    for (const Projection<dim> &p :
         project_on_walls(scene.walls, near.near(grid.cell(x)), x, spacing))
      check(p.distance > -tolerance,
            "the water overlaps wall '{}': a point at {} m lies {:.3g} m behind it; "
            "correct water_m or the wall (the fluid lies on the left of its points_m)",
            scene.walls.names[scene.walls.faces[p.face].wall], text_of(x), -p.distance);
}

namespace {

struct Dimension {
  int value = 2;
  template <class Reader> void describe(Reader &read) {
    read("dimension", value, "2: per metre of depth; 3: in space")
        .check(value == 2 || value == 3, "must be 2 or 3");
  }
};

} // namespace

int dimension_of(const Config &config) { return config.peek<Dimension>("fluid").value; }

template <int dim> Scene<dim> read_scene(const Config &config, const SurfaceReader &read_surface) {
  Scene<dim> scene;
  scene.params = config.read<FluidParams<dim>>("fluid");
  scene.params.rheology =
      Rheology(config.read<RheologyParams>("fluid.rheology"), scene.params.viscosity);
  scene.walls = read_walls(config, scene.params, read_surface);
  scene.gauges = config.read_all<GaugeParams<dim>>("fluid.gauge");
  check_names(scene.gauges, "gauge");
  for (GaugeParams<dim> &gauge : scene.gauges)
    if (std::isnan(gauge.z))
      gauge.z = 0.5 * scene.params.depth;
  scene.probes = config.read_all<ProbeParams<dim>>("fluid.probe");
  check_names(scene.probes, "probe");
  scene.initial.points = fill(scene.params);
  check_clear_of_walls(scene, 0);
  if (!scene.params.open_sides && scene.params.gravity.norm() > 0)
    check_holes(scene);
  return scene;
}

template double volume_error(const Scene<2> &);
template void check_clear_of_walls(const Scene<2> &, double);
template Scene<2> read_scene(const Config &, const SurfaceReader &);
template double volume_error(const Scene<3> &);
template void check_clear_of_walls(const Scene<3> &, double);
template Scene<3> read_scene(const Config &, const SurfaceReader &);

} // namespace sluice::fluid
