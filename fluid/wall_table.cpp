// SPDX-License-Identifier: MIT
#include "fluid/wall_table.hpp"

#include "bridge/base/check.hpp"
#include "fluid/coordinates.hpp"
#include "fluid/names.hpp"

#include <algorithm>
#include <cmath>

namespace sluice::fluid {

namespace {

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
    check(!wall.coupled || wall.displacement.empty(),
          "wall '{}': a coupled wall moves as its partner says, not by displacement_m", wall.name);
    start(wall.name, wall.condition);
    const int first = static_cast<int>(walls_.position.size());
    const int first_face = static_cast<int>(walls_.faces.size());
    if (wall.file.empty())
      sweep(wall);
    else
      add_surface(surface, wall.reversed, place(wall.velocity, 0));
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
  /// A point of an outline, and the share of the wall's velocity that it has.
  struct OutlinePoint {
    Vec<2> position;
    double velocity_share;
  };

  void sweep(const WallParams<dim> &wall) {
    const int first = static_cast<int>(walls_.position.size());
    const int first_face = static_cast<int>(walls_.faces.size());
    check(dim == 2 || z_.back() > 0,
          "wall '{}': points_m are swept along z over depth_m, which is 0", wall.name);
    const std::vector<OutlinePoint> outline = cut_into_segments(wall);
    for (const OutlinePoint &p : outline)
      for (const double z : z_) {
        walls_.position.push_back(place(p.position, z));
        walls_.velocity.push_back(place(p.velocity_share * wall.velocity, 0));
      }
    for (int k = 1; k < static_cast<int>(outline.size()); ++k)
      add_segment(first + (k - 1) * n_z(), first + k * n_z());
    for (int f = first_face; f < static_cast<int>(walls_.faces.size()); ++f)
      walls_.faces[f].number = f - first_face;
  }

  void add_surface([[maybe_unused]] const SurfaceMesh &surface, [[maybe_unused]] bool reversed,
                   [[maybe_unused]] const Vec<dim> &velocity) {
    if constexpr (dim == 3) {
      const int first = static_cast<int>(walls_.position.size());
      walls_.position.insert(walls_.position.end(), surface.position.begin(),
                             surface.position.end());
      walls_.velocity.resize(walls_.position.size(), velocity);
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

  static double velocity_share(const WallParams<dim> &wall, std::size_t k) {
    return wall.velocity_shares.empty() ? 1.0 : wall.velocity_shares[k];
  }

  static std::vector<OutlinePoint> cut_into_segments(const WallParams<dim> &wall) {
    std::vector<OutlinePoint> outline{{wall.points.front(), velocity_share(wall, 0)}};
    for (std::size_t k = 1; k < wall.points.size(); ++k) {
      check((wall.points[k] - wall.points[k - 1]).norm() > 1e-9,
            "wall '{}': points {} and {} coincide at {} m", wall.name, k - 1, k,
            text_of(wall.points[k]));
      const Vec<2> leg = (wall.points[k] - wall.points[k - 1]).normalized();
      const bool slides = velocity_share(wall, k - 1) != 0 || velocity_share(wall, k) != 0;
      check(!slides || std::abs(cross(leg, wall.velocity)) <= 1e-9 * wall.velocity.norm(),
            "wall '{}': velocity_m_s = [{}, {}] points across the leg from point {} to {}; it may "
            "only slide along itself",
            wall.name, wall.velocity.x(), wall.velocity.y(), k - 1, k);
      cut_leg(wall, {wall.points[k], velocity_share(wall, k)}, outline);
    }
    return outline;
  }

  static void cut_leg(const WallParams<dim> &wall, const OutlinePoint &to,
                      std::vector<OutlinePoint> &outline) {
    const OutlinePoint from = outline.back();
    const double length = (to.position - from.position).norm();
    constexpr double most_pieces = 1e6;
    const double wanted =
        wall.segment_length > 0 ? std::ceil(length / wall.segment_length - 1e-9) : 1;
    check(wanted <= most_pieces,
          "wall '{}': segment_length_m = {} m cuts a leg of {} m into {:.3g} "
          "pieces, at most {:.0e} are handled",
          wall.name, wall.segment_length, length, wanted, most_pieces);
    const int pieces = std::max(1, static_cast<int>(wanted));
    for (int k = 1; k < pieces; ++k) {
      const double t = static_cast<double>(k) / pieces;
      outline.push_back({(1 - t) * from.position + t * to.position,
                         (1 - t) * from.velocity_share + t * to.velocity_share});
    }
    outline.push_back(to);
  }

  Walls<dim> &walls_;
  std::vector<double> z_; // [m]
};

template <int dim>
SurfaceMesh surface_of(const WallParams<dim> &wall, const Config &config,
                       const SurfaceReader &read_surface) {
  if (wall.file.empty())
    return {};
  check(read_surface != nullptr, "wall '{}': this program was built without a reader of files",
        wall.name);
  return read_surface(std::filesystem::path(config.file_name()).parent_path() / wall.file);
}

// The wall's vertices, from `first` on, go to where its law has them at t = 0.
template <int dim>
PrescribedWall<dim> prescribe(const WallParams<dim> &wall, int first, Walls<dim> &walls) {
  PrescribedWall<dim> law;
  law.first = first;
  law.at_rest.assign(walls.position.begin() + first, walls.position.end());
  law.displacement = Formula<dim>(wall.displacement);
  law.sliding.assign(walls.velocity.begin() + first, walls.velocity.end());
  for (std::size_t k = 0; k < law.at_rest.size(); ++k)
    walls.position[first + k] += law.displacement(law.at_rest[k], 0);
  return law;
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

} // namespace

namespace {

// Surfaces from files close themselves: side walls are for what is swept.
template <int dim> bool has_swept_wall(const std::vector<WallParams<dim>> &tables) {
  return std::any_of(tables.begin(), tables.end(),
                     [](const WallParams<dim> &wall) { return wall.file.empty(); });
}

} // namespace

template <int dim>
Walls<dim> read_walls(const Config &config, const Sweep &sweep, const SurfaceReader &read_surface,
                      std::vector<PrescribedWall<dim>> &prescribed) {
  Walls<dim> walls;
  const auto tables = config.read_all<WallParams<dim>>("fluid.wall");
  check(!tables.empty(), "{}: the scene has no [[fluid.wall]]", config.file_name());
  check_names(tables, "wall");
  WallBuilder<dim> builder(tables, sweep.depth, walls);
  for (const WallParams<dim> &wall : tables) {
    const int first = static_cast<int>(walls.position.size());
    builder.add(wall, surface_of(wall, config, read_surface));
    if (!wall.displacement.empty())
      prescribed.push_back(prescribe(wall, first, walls));
  }
  if constexpr (dim == 3)
    if (sweep.side_walls != "none" && has_swept_wall(tables))
      builder.add_sides(sweep.side_walls);
  link_faces(walls);
  check_surfaces(tables, walls);
  return walls;
}

template Walls<2> read_walls(const Config &, const Sweep &, const SurfaceReader &,
                             std::vector<PrescribedWall<2>> &);
template Walls<3> read_walls(const Config &, const Sweep &, const SurfaceReader &,
                             std::vector<PrescribedWall<3>> &);

} // namespace sluice::fluid
