// SPDX-License-Identifier: MIT
#include "fluid/motion.hpp"

#include "fluid/packed_stencil.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numbers>

namespace sluice::fluid {

template <int dim> void move_points(Points<dim> &points, double dt, double lead) {
  for_each_point(points.size(), [&](int i) {
    Vec<dim> &u = points.velocity[i], &old = points.previous_velocity[i];
    points.position[i] += dt * (u + lead * (u - old)) + points.shift[i];
    u += points.shift_velocity[i];
    old += points.shift_velocity[i];
    points.shift[i].setZero();
    points.shift_velocity[i].setZero();
  });
}

namespace {

// Two walls on opposite sides of a point leave each at most 0.45 of the gap as clearance.
template <int dim> double clearance_between(const PointWalls<dim> &walls, double clearance) {
  for (int k = 1; k < walls.count; ++k)
    if (walls.projection[0].normal.dot(walls.projection[k].normal) < -0.5)
      clearance = std::min(
          clearance,
          0.45 * std::max(walls.projection[0].distance + walls.projection[k].distance, 0.0));
  return clearance;
}

struct Contact {
  bool was_behind = false;
  bool moved = false;
};

template <int dim>
Contact resolve_contact(Vec<dim> &x, Vec<dim> &u, const Walls<dim> &walls,
                        const FaceTree<dim> &tree, double reach, double clearance, bool is_held) {
  Contact contact;
  constexpr int sweeps = 4;
  for (int sweep = 0; sweep < sweeps; ++sweep) {
    const PointWalls<dim> near = project_on_walls(walls, tree, x, reach);
    const double limit = clearance_between(near, clearance);
    bool touched = false;
    for (const Projection<dim> &p : near) {
      if (p.distance >= limit * (1 - 1e-9))
        continue;
      contact.was_behind = contact.was_behind || (sweep == 0 && p.distance < 0);
      touched = contact.moved = true;
      x -= (limit - p.distance) * p.normal;
      if (is_held && p.distance >= 0)
        continue;
      const double approach = p.normal.dot(u - wall_velocity(walls, p));
      u -= std::max(approach, 0.0) * p.normal;
    }
    if (!touched)
      break;
  }
  return contact;
}

} // namespace

template <int dim>
ContactCounts<dim> keep_clear_of_walls(Points<dim> &points, const Walls<dim> &walls,
                                       const MotionParams &params, const Cloud<dim> &cloud) {
  const double clearance = params.wall_clearance * cloud.spacing;
  const int n = static_cast<int>(cloud.wall_points.size());
  const auto sums = block_sums<2 + dim>(
      n,
      [&](IndexRange range) {
        std::array<double, 2 + dim> part{};
        for (int k = range.begin; k < range.end; ++k) {
          const PointWalls<dim> &near = cloud.point_walls[k];
          if (near.count == 0 || near.projection[0].distance >= clearance * (1 - 1e-9))
            continue;
          const int i = cloud.wall_points[k];
          const Vec<dim> before = points.velocity[i];
          const Contact contact = resolve_contact(points.position[i], points.velocity[i], walls,
                                                  cloud.face_tree, cloud.radius, clearance,
                                                  points.at_surface[i] == SurfaceMemory::enclosed);
          const Vec<dim> change = points.velocity[i] - before;
          part[0] += contact.moved;
          part[1] += contact.was_behind;
          for (int d = 0; d < dim; ++d)
            part[2 + d] += change[d];
        }
        return part;
      },
      Work::heavy);
  return {static_cast<int>(sums[0]), static_cast<int>(sums[1]), Vec<dim>(&sums[2])};
}

template <int dim> Pace pace_of(const Points<dim> &points, double gravity, double spacing) {
  if (gravity > 0) {
    const double shortest_wave = std::sqrt(gravity / spacing);
    return {shortest_wave, shortest_wave};
  }
  const int n = std::max(points.size(), 1);
  const double speed2 = sum(points.size(), [&](int i) { return points.velocity[i].squaredNorm(); });
  const double speed = std::sqrt(speed2 / n), size = spacing * std::pow(n, 1.0 / dim);
  return {0.1 * speed / spacing, 2 * std::numbers::pi * speed / size};
}

namespace {

// The mean of a value over the interior points around each one, itself among them.
template <int dim>
void average(const Points<dim> &points, const Cloud<dim> &cloud, std::span<const double> value,
             std::span<double> mean) {
  for_each_pack(points.size(), [&](int first) {
    const PackedStencil<dim> s(first, points, cloud);
    Pack sum = gathered(s.self(), value.data()), total = Pack{} + 1;
    for (int k = 0; k < s.width(); ++k) {
      const int *j = s.neighbours(k);
      const PackMask counts =
          s.has_neighbour(k) & gathered_equal(j, cloud.kind.data(), PointKind::interior);
      const Pack w = counts ? s.weight_at(s.offset(k)) : Pack{};
      sum += w * gathered(j, value.data());
      total += w;
    }
    for (int l = 0; l < s.count(); ++l)
      mean[first + l] = sum[l] / total[l];
  });
}

} // namespace

template <int dim>
void volume_restoring_divergence(const Points<dim> &points, const Cloud<dim> &cloud,
                                 const MotionParams &params, double pace,
                                 std::vector<double> &memory, std::span<double> divergence) {
  const double volume = volume_of_point<dim>(cloud.spacing);
  constexpr double largest_error = 0.3;
  memory.resize(points.size());
  average(points, cloud, cloud.cell_volume, memory);
  average<dim>(points, cloud, memory, divergence);
  for_each_point(points.size(), [&](int i) {
    const double error = std::clamp(1 - divergence[i] / volume, -largest_error, largest_error);
    const double rate = params.volume_rate * std::max(pace, points.strain_rate[i]);
    const bool is_interior = cloud.kind[i] == PointKind::interior;
    divergence[i] = is_interior ? (1 - cloud.openness[i]) * rate * error : 0.0;
  });
}

namespace {

template <int dim>
Vec<dim> push_apart(int i, const Points<dim> &points, const Cloud<dim> &cloud, double closest) {
  Vec<dim> push = Vec<dim>::Zero();
  for (const int j : cloud.neighbours.of(i)) {
    const Vec<dim> r = points.position[i] - points.position[j];
    const double distance = r.norm();
    if (distance < closest && distance > 1e-12)
      push += 0.5 * (closest / distance - 1) * r;
  }
  return push;
}

// Half of what a point lies too far from the middle of its cell.
template <int dim> Vec<dim> closing_move(const Vec<dim> &offset, double widest) {
  const double length = offset.norm();
  return length > widest ? Vec<dim>(0.5 * (1 - widest / length) * offset)
                         : Vec<dim>(Vec<dim>::Zero());
}

// Which of the points first .. first + 7 may have a neighbour closer than `closest`.
template <int dim>
unsigned crowded_points(int first, const Points<dim> &points, const Cloud<dim> &cloud,
                        double closest) {
  const PackedStencil<dim> s(first, points, cloud);
  const double limit = 1.0001 * closest / cloud.radius;
  PackMask crowded{};
  for (int k = 0; k < s.width(); ++k)
    crowded |= (s.squared_norm(s.offset(k)) < limit * limit) & s.has_neighbour(k);
  return bits_of(crowded);
}

// Numbers in [-1, 1] that depend on the point alone (SplitMix64 by S. Vigna), two from each draw.
template <int dim> Vec<dim> own_direction(std::int32_t id) {
  std::uint64_t state = static_cast<std::uint64_t>(id) * ((dim + 1) / 2);
  constexpr double scale = 1.0 / 2147483648.0;
  Vec<dim> direction;
  for (int d = 0; d < dim; d += 2) {
    std::uint64_t z = ++state * 0x9e3779b97f4a7c15u;
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9u;
    z = (z ^ (z >> 27)) * 0x94d049bb133111ebu;
    z ^= z >> 31;
    direction[d] = static_cast<double>(z & 0xffffffffu) * scale - 1;
    if (d + 1 < dim)
      direction[d + 1] = static_cast<double>(z >> 32) * scale - 1;
  }
  return direction;
}

} // namespace

template <int dim>
void plan_shift(Points<dim> &points, const Cloud<dim> &cloud, const MotionParams &params,
                MatView<dim> velocity_gradient, double dt) {
  const double closest = params.closest_pair * cloud.spacing;
  const double widest = params.widest_offset * cloud.spacing;
  const double longest = 0.1 * cloud.spacing;
  const auto shift_of = [&](int i, bool is_crowded) {
    const Mat<dim> &g = velocity_gradient[i];
    points.strain_rate[i] = (g + g.transpose()).norm() / std::sqrt(2.0);
    const double strain = std::min(points.strain_rate[i] * dt, 0.25);
    Vec<dim> shift = strain * (params.regularity * cloud.centroid_offset[i] +
                               params.agitation * cloud.spacing * own_direction<dim>(points.id[i]));
    shift += closing_move<dim>(cloud.centroid_offset[i], widest);
    const Vec<dim> &n = cloud.surface_normal[i];
    shift -= cloud.openness[i] * n.dot(shift) * n;
    if (cloud.kind[i] == PointKind::thin)
      shift.setZero();
    if (is_crowded)
      shift += push_apart(i, points, cloud, closest);
    const double length = shift.norm();
    return length > longest ? Vec<dim>(longest / length * shift) : shift;
  };
  for_each_pack(points.size(), [&](int first) {
    const unsigned crowded = crowded_points(first, points, cloud, closest);
    for (int i = first; i < std::min(first + pack_size, points.size()); ++i) {
      points.shift[i] = shift_of(i, (crowded >> (i - first) & 1) != 0);
      points.shift_velocity[i] = cloud.kind[i] == PointKind::interior
                                     ? Vec<dim>(velocity_gradient[i] * points.shift[i])
                                     : Vec<dim>(Vec<dim>::Zero());
    }
  });
}

template void move_points(Points<2> &, double, double);
template Pace pace_of(const Points<2> &, double, double);
template ContactCounts<2> keep_clear_of_walls(Points<2> &, const Walls<2> &, const MotionParams &,
                                              const Cloud<2> &);
template void volume_restoring_divergence(const Points<2> &, const Cloud<2> &, const MotionParams &,
                                          double, std::vector<double> &, std::span<double>);
template void plan_shift(Points<2> &, const Cloud<2> &, const MotionParams &, MatView<2>, double);
template void move_points(Points<3> &, double, double);
template Pace pace_of(const Points<3> &, double, double);
template ContactCounts<3> keep_clear_of_walls(Points<3> &, const Walls<3> &, const MotionParams &,
                                              const Cloud<3> &);
template void volume_restoring_divergence(const Points<3> &, const Cloud<3> &, const MotionParams &,
                                          double, std::vector<double> &, std::span<double>);
template void plan_shift(Points<3> &, const Cloud<3> &, const MotionParams &, MatView<3>, double);

} // namespace sluice::fluid
