// SPDX-License-Identifier: MIT
#include "fluid/diagnostics.hpp"

#include "fluid/parallel.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace sluice::fluid {

Integrals integrate(const FluidState &state, const FluidParams &params) {
  const Points &points = state.points;
  const double area = params.spacing * params.spacing, mass = params.density * area;
  std::array<double, Blocks::max_count> fastest{};
  const auto sums = block_sums<4>(points.size(), [&](IndexRange range) {
    std::array<double, 4> part{};
    double &speed2 = fastest[Blocks(points.size()).of(range.begin)];
    for (int i = range.begin; i < range.end; ++i) {
      const Vec<2> &u = points.velocity[i];
      const Vec<2> x =
          points.position[i] + 0.5 * state.step_size * (u - points.previous_velocity[i]);
      part[0] += u.squaredNorm();
      part[1] -= params.gravity.dot(x);
      part[2] += u.x();
      part[3] += u.y();
      speed2 = std::max(speed2, u.squaredNorm());
    }
    return part;
  });
  Integrals total;
  total.kinetic = 0.5 * mass * sums[0];
  total.potential = mass * sums[1];
  total.momentum = mass * Vec<2>(sums[2], sums[3]);
  total.point_volume = points.size() * area;
  total.max_speed = std::sqrt(*std::max_element(fastest.begin(), fastest.end()));
  return total;
}

Integrals integrate(const FluidSolver &solver) {
  const Points &points = solver.state.points;
  const Cloud &cloud = solver.cloud();
  const CentreLine line(solver.walls);
  Integrals total = integrate(solver.state, solver.params());
  for (int i = 0; i < points.size(); ++i) {
    total.volume += cloud.cell_area[i];
    if (!line.exists() || !line.is_past(points.position[i])) {
      total.tank_volume += cloud.cell_area[i];
      total.tank_point_volume += cloud.spacing * cloud.spacing;
    }
    total.min_pressure = std::min(total.min_pressure, points.pressure[i]);
    total.max_pressure = std::max(total.max_pressure, points.pressure[i]);
  }
  return total;
}

bridge::InterfaceTotals interface_totals(const FluidSolver &solver, std::span<const Vec<2>> start,
                                         std::span<const Vec<2>> end) {
  const Walls &walls = solver.walls;
  bridge::InterfaceTotals total;
  const auto &samples = solver.quadrature().samples;
  for (std::size_t k = 0; k < samples.size(); ++k) {
    const auto &s = samples[k];
    const WallSegment &segment = walls.segments[s.segment];
    const auto at = [&](std::span<const Vec<2>> v) -> Vec<2> {
      return (1 - s.t) * v[segment.a] + s.t * v[segment.b];
    };
    const Vec<2> f = s.length * solver.tractions()[k];
    const Vec<2> x = at(walls.position), from = at(start), to = at(end);
    total.force[0] += f.x();
    total.force[1] += f.y();
    total.force_magnitude += f.norm();
    total.moment[2] += cross(x, f);
    total.moment_magnitude += x.norm() * f.norm();
    total.work += f.dot(to - from);
    total.work_magnitude += f.norm() * (from.norm() + to.norm());
  }
  return total;
}

CentreLine::CentreLine(const Walls &walls) {
  const auto &outline = walls.coupled_vertices;
  const std::size_t n = outline.size();
  const auto at = [&](std::size_t k) { return walls.position[outline[k]]; };
  if (n < 4)
    return;
  const double middle = at(n / 2).y();
  if (middle >= at(0).y() || middle >= at(n - 1).y())
    return;
  for (std::size_t k = 0; k < n / 2; ++k)
    line_.push_back(0.5 * (at(k) + at(n - 1 - k)));
}

bool CentreLine::is_past(const Vec<2> &x) const {
  if (x.y() < tip().y())
    return x.x() > tip().x();
  for (std::size_t k = 1; k < line_.size(); ++k) {
    const Vec<2> &a = line_[k - 1], &b = line_[k];
    if (x.y() <= a.y() && x.y() >= b.y() && a.y() > b.y())
      return x.x() > b.x() + (x.y() - b.y()) / (a.y() - b.y()) * (a.x() - b.x());
  }
  return x.x() > line_.front().x();
}

std::optional<double> floor_at(const Walls &walls, double x) {
  std::optional<double> floor;
  for (const WallSegment &s : walls.segments) {
    const Vec<2> &a = walls.position[s.a], &b = walls.position[s.b];
    if (!(a.x() <= x && x <= b.x() && a.x() < b.x())) // the fluid lies on the left: above
      continue;
    const double y = a.y() + (x - a.x()) / (b.x() - a.x()) * (b.y() - a.y());
    floor = std::min(floor.value_or(y), y);
  }
  return floor;
}

double water_level(const Points &points, double x, double spacing, std::optional<double> floor) {
  std::vector<double> heights;
  for (const Vec<2> &p : points.position)
    if (std::abs(p.x() - x) <= spacing)
      heights.push_back(p.y());
  std::sort(heights.begin(), heights.end());
  if (heights.empty() && !floor)
    return std::numeric_limits<double>::quiet_NaN();
  const double bottom = floor ? *floor : heights.front();
  double level = bottom;
  for (const double y : heights) {
    if (y - level > 2 * spacing)
      break;
    level = y;
  }
  return level > bottom || !floor ? level + 0.5 * spacing : bottom;
}

} // namespace sluice::fluid
