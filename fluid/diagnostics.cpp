// SPDX-License-Identifier: MIT
#include "fluid/diagnostics.hpp"

#include "fluid/parallel.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace sluice::fluid {

template <int dim>
Integrals<dim> integrate(const FluidState<dim> &state, const FluidParams<dim> &params) {
  const Points<dim> &points = state.points;
  const double volume = volume_of_point<dim>(params.spacing), mass = params.density * volume;
  std::array<double, Blocks::max_count> fastest{};
  const auto sums = block_sums<2 + dim>(points.size(), [&](IndexRange range) {
    std::array<double, 2 + dim> part{};
    double &speed2 = fastest[Blocks(points.size()).of(range.begin)];
    for (int i = range.begin; i < range.end; ++i) {
      const Vec<dim> &u = points.velocity[i];
      const Vec<dim> x =
          points.position[i] + 0.5 * state.step_size * (u - points.previous_velocity[i]);
      part[0] += u.squaredNorm();
      part[1] -= params.gravity.dot(x);
      for (int d = 0; d < dim; ++d)
        part[2 + d] += u[d];
      speed2 = std::max(speed2, u.squaredNorm());
    }
    return part;
  });
  Integrals<dim> total;
  total.kinetic = 0.5 * mass * sums[0];
  total.potential = mass * sums[1];
  total.momentum = mass * Vec<dim>(&sums[2]);
  total.point_volume = points.size() * volume;
  total.max_speed = std::sqrt(*std::max_element(fastest.begin(), fastest.end()));
  return total;
}

template <int dim> Integrals<dim> integrate(const FluidSolver<dim> &solver) {
  const Points<dim> &points = solver.state.points;
  const Cloud<dim> &cloud = solver.cloud();
  const CentreLine line(solver.walls);
  const int n = points.size();
  std::array<double, Blocks::max_count> lowest{}, highest{};
  const auto sums = block_sums<3>(n, [&](IndexRange range) {
    std::array<double, 3> part{};
    double low = 0, high = 0;
    for (int i = range.begin; i < range.end; ++i) {
      const bool is_in_tank = !line.exists() || !line.is_past(points.position[i]);
      part[0] += cloud.cell_volume[i];
      part[1] += is_in_tank ? cloud.cell_volume[i] : 0.0;
      part[2] += is_in_tank;
      low = std::min(low, points.pressure[i]);
      high = std::max(high, points.pressure[i]);
    }
    lowest[Blocks(n).of(range.begin)] = low;
    highest[Blocks(n).of(range.begin)] = high;
    return part;
  });
  Integrals<dim> total = integrate(solver.state, solver.params());
  total.volume = sums[0];
  total.tank_volume = sums[1];
  total.tank_point_volume = sums[2] * volume_of_point<dim>(cloud.spacing);
  total.min_pressure = *std::min_element(lowest.begin(), lowest.end());
  total.max_pressure = *std::max_element(highest.begin(), highest.end());
  return total;
}

namespace {

void add_moment(double moment, bridge::InterfaceTotals &total) { total.moment[2] += moment; }
void add_moment(const Vec<3> &moment, bridge::InterfaceTotals &total) {
  for (int d = 0; d < 3; ++d)
    total.moment[d] += moment[d];
}

} // namespace

template <int dim>
bridge::InterfaceTotals interface_totals(const FluidSolver<dim> &solver, VecView<dim> start,
                                         VecView<dim> end) {
  const Walls<dim> &walls = solver.walls;
  bridge::InterfaceTotals total;
  const auto &samples = solver.quadrature().samples;
  for (std::size_t k = 0; k < samples.size(); ++k) {
    const auto &s = samples[k];
    const auto at = [&](VecView<dim> v) { return value_at<dim>(v, walls.faces[s.face], s.shape); };
    const Vec<dim> f = s.measure * solver.tractions()[k];
    const Vec<dim> x = at(walls.position), from = at(start), to = at(end);
    for (int d = 0; d < dim; ++d)
      total.force[d] += f[d];
    total.force_magnitude += f.norm();
    add_moment(cross(x, f), total);
    total.moment_magnitude += x.norm() * f.norm();
    total.work += f.dot(to - from);
    total.work_magnitude += f.norm() * (from.norm() + to.norm());
  }
  return total;
}

CentreLine::CentreLine(const Walls<2> &walls) {
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

bool CentreLine::is_past(double x, double y) const {
  if (y < tip().y())
    return x > tip().x();
  for (std::size_t k = 1; k < line_.size(); ++k) {
    const Vec<2> &a = line_[k - 1], &b = line_[k];
    if (y <= a.y() && y >= b.y() && a.y() > b.y())
      return x > b.x() + (y - b.y()) / (a.y() - b.y()) * (a.x() - b.x());
  }
  return x > line_.front().x();
}

namespace {

/// Height at which the vertical line meets a face with the fluid above it.
std::optional<double> height_on(const Walls<2> &walls, const WallFace<2> &face,
                                const Vec<1> &line) {
  const auto [a, b] = walls.corners(face);
  const double x = line[0];
  if (!(a.x() <= x && x <= b.x() && a.x() < b.x())) // the fluid lies on the left: above
    return {};
  return a.y() + (x - a.x()) / (b.x() - a.x()) * (b.y() - a.y());
}

std::optional<double> height_on(const Walls<3> &walls, const WallFace<3> &face,
                                const Vec<2> &line) {
  const auto [a, b, c] = walls.corners(face);
  const auto across = [](const Vec<3> &p, const Vec<3> &q, const Vec<2> &x) { // z before x: y is up
    return (q.z() - p.z()) * (x[0] - p.x()) - (q.x() - p.x()) * (x[1] - p.z());
  };
  const double in_c = across(a, b, line), in_a = across(b, c, line), in_b = across(c, a, line);
  const double sum = in_a + in_b + in_c;
  if (!(in_a >= 0 && in_b >= 0 && in_c >= 0 && sum > 0))
    return {};
  return (in_a * a.y() + in_b * b.y() + in_c * c.y()) / sum;
}

template <int dim> bool is_near(const Vec<dim> &x, const VerticalLine<dim> &line, double distance) {
  for (int d = 0; d < dim - 1; ++d)
    if (std::abs(x[2 * d] - line[d]) > distance)
      return false;
  return true;
}

} // namespace

template <int dim>
std::optional<double> floor_at(const Walls<dim> &walls, const VerticalLine<dim> &line) {
  std::optional<double> floor;
  for (const WallFace<dim> &face : walls.faces)
    if (const auto y = height_on(walls, face, line))
      floor = std::min(floor.value_or(*y), *y);
  return floor;
}

template <int dim>
double water_level(const Points<dim> &points, const VerticalLine<dim> &line, double spacing,
                   std::optional<double> floor) {
  std::vector<double> heights;
  for (const Vec<dim> &p : points.position)
    if (is_near<dim>(p, line, spacing))
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

template <int dim> double front(const Points<dim> &points, double y, double spacing) {
  double farthest = std::numeric_limits<double>::quiet_NaN();
  for (const Vec<dim> &x : points.position)
    if (std::abs(x.y() - y) < spacing)
      farthest = std::fmax(farthest, x.x() + 0.5 * spacing);
  return farthest;
}

template Integrals<2> integrate(const FluidState<2> &, const FluidParams<2> &);
template Integrals<2> integrate(const FluidSolver<2> &);
template bridge::InterfaceTotals interface_totals(const FluidSolver<2> &, VecView<2>, VecView<2>);
template std::optional<double> floor_at(const Walls<2> &, const VerticalLine<2> &);
template double water_level(const Points<2> &, const VerticalLine<2> &, double,
                            std::optional<double>);
template Integrals<3> integrate(const FluidState<3> &, const FluidParams<3> &);
template Integrals<3> integrate(const FluidSolver<3> &);
template bridge::InterfaceTotals interface_totals(const FluidSolver<3> &, VecView<3>, VecView<3>);
template std::optional<double> floor_at(const Walls<3> &, const VerticalLine<3> &);
template double water_level(const Points<3> &, const VerticalLine<3> &, double,
                            std::optional<double>);
template double front(const Points<2> &, double, double);
template double front(const Points<3> &, double, double);

} // namespace sluice::fluid
