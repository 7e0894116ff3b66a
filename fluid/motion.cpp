// SPDX-License-Identifier: MIT
#include "fluid/motion.hpp"

#include "fluid/parallel.hpp"
#include "fluid/weights.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>

namespace sluice::fluid {

void move_points(Points &points, double dt, double previous_dt) {
  const double ahead = previous_dt > 0 ? 0.5 * dt / previous_dt : 0.5;
  for_each_point(points.size(), [&](int i) {
    Vec<2> &u = points.velocity[i], &old = points.previous_velocity[i];
    points.position[i] += dt * ((1 + ahead) * u - ahead * old) + points.shift[i];
    u += points.shift_velocity[i];
    old += points.shift_velocity[i];
    points.shift[i].setZero();
    points.shift_velocity[i].setZero();
  });
}

namespace {

// Two walls on opposite sides of a point leave each at most 0.45 of the gap as clearance.
double clearance_between(const PointWalls &walls, double clearance) {
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

Contact resolve_contact(Vec<2> &x, Vec<2> &u, const Walls &walls,
                        std::span<const int> candidates, double reach, double clearance) {
  Contact contact;
  constexpr int sweeps = 4;
  for (int sweep = 0; sweep < sweeps; ++sweep) {
    const PointWalls near = project_on_walls(walls, candidates, x, reach);
    const double limit = clearance_between(near, clearance);
    bool touched = false;
    for (const Projection &p : near) {
      if (p.distance >= limit * (1 - 1e-9))
        continue;
      contact.was_behind = contact.was_behind || (sweep == 0 && p.distance < 0);
      touched = contact.moved = true;
      x -= (limit - p.distance) * p.normal;
      const double approach = p.normal.dot(u - wall_velocity(walls, p));
      u -= std::max(approach, 0.0) * p.normal;
    }
    if (!touched)
      break;
  }
  return contact;
}

} // namespace

ContactCounts keep_clear_of_walls(Points &points, const Walls &walls, const MotionParams &params,
                                  const Cloud &cloud) {
  const double clearance = params.wall_clearance * cloud.spacing;
  const int n = static_cast<int>(cloud.wall_points.size());
  const auto sums = block_sums<4>(n, [&](IndexRange range) {
    std::array<double, 4> part{};
    for (int k = range.begin; k < range.end; ++k) {
      const PointWalls &near = cloud.point_walls[k];
      if (near.count == 0 || near.projection[0].distance >= clearance * (1 - 1e-9))
        continue;
      const int i = cloud.wall_points[k];
      const auto candidates = cloud.near_segments.near(cloud.grid.cell(points.position[i]));
      const Vec<2> before = points.velocity[i];
      const Contact contact = resolve_contact(points.position[i], points.velocity[i], walls,
                                              candidates, cloud.radius, clearance);
      const Vec<2> change = points.velocity[i] - before;
      part[0] += contact.moved;
      part[1] += contact.was_behind;
      part[2] += change.x();
      part[3] += change.y();
    }
    return part;
  }, Work::heavy);
  return {static_cast<int>(sums[0]), static_cast<int>(sums[1]), {sums[2], sums[3]}};
}

double pace_of(const Points &points, double gravity, double spacing) {
  if (gravity > 0)
    return std::sqrt(gravity / spacing);
  const double speed2 =
      sum(points.size(), [&](int i) { return points.velocity[i].squaredNorm(); });
  return std::sqrt(speed2 / std::max(points.size(), 1)) / spacing;
}

void volume_restoring_divergence(const Points &points, const Cloud &cloud,
                                 const MotionParams &params, double pace,
                                 std::span<double> divergence) {
  const double volume = cloud.spacing * cloud.spacing;
  const double rate = params.volume_rate * pace;
  constexpr double largest_error = 0.3;
  for_each_point(points.size(), [&](int i) {
    divergence[i] = 0;
    if (cloud.kind[i] != PointKind::interior)
      return;
    double area = cloud.cell_area[i], total = 1;
    for (const int j : cloud.neighbours.of(i)) {
      if (cloud.kind[j] != PointKind::interior)
        continue;
      const double q = (points.position[j] - points.position[i]).norm() / cloud.radius;
      const double w = weight(std::min(q, 1.0));
      area += w * cloud.cell_area[j];
      total += w;
    }
    const double error = 1 - area / (total * volume);
    divergence[i] = rate * std::clamp(error, -largest_error, largest_error);
  });
}

namespace {

Vec<2> push_apart(int i, const Points &points, const Cloud &cloud, double closest) {
  Vec<2> push = Vec<2>::Zero();
  for (const int j : cloud.neighbours.of(i)) {
    const Vec<2> r = points.position[i] - points.position[j];
    const double distance = r.norm();
    if (distance < closest && distance > 1e-12)
      push += 0.5 * (closest / distance - 1) * r;
  }
  return push;
}

// Two numbers in [-1, 1] that depend on the point alone (SplitMix64 by S. Vigna).
Vec<2> own_direction(std::int32_t id) {
  std::uint64_t z = (static_cast<std::uint64_t>(id) + 1) * 0x9e3779b97f4a7c15u;
  z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9u;
  z = (z ^ (z >> 27)) * 0x94d049bb133111ebu;
  z ^= z >> 31;
  const double scale = 1.0 / 2147483648.0;
  return {static_cast<double>(z & 0xffffffffu) * scale - 1, static_cast<double>(z >> 32) * scale - 1};
}

} // namespace

void plan_shift(Points &points, const Cloud &cloud, const MotionParams &params,
                std::span<const Mat<2>> velocity_gradient, double dt) {
  const double closest = params.closest_pair * cloud.spacing;
  const double longest = 0.1 * cloud.spacing;
  for_each_point(points.size(), [&](int i) {
    const Mat<2> &g = velocity_gradient[i];
    const double strain_rate = (g + g.transpose()).norm() / std::sqrt(2.0);
    const double strain = std::min(strain_rate * dt, 0.25);
    Vec<2> shift = strain * (params.regularity * cloud.centroid_offset[i] +
                             params.agitation * cloud.spacing * own_direction(points.id[i]));
    const Vec<2> &n = cloud.surface_normal[i];
    shift -= n.dot(shift) * n;
    if (cloud.kind[i] == PointKind::thin)
      shift.setZero();
    shift += push_apart(i, points, cloud, closest);
    const double length = shift.norm();
    if (length > longest)
      shift *= longest / length;
    points.shift[i] = shift;
    points.shift_velocity[i] =
        cloud.kind[i] == PointKind::interior ? Vec<2>(g * shift) : Vec<2>(Vec<2>::Zero());
  });
}

} // namespace sluice::fluid
