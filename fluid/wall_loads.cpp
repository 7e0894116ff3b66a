// SPDX-License-Identifier: MIT
#include "fluid/wall_loads.hpp"

#include "fluid/parallel.hpp"
#include "fluid/weights.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace sluice::fluid {

namespace {

// A sample takes its pressure from points within this many spacings.
constexpr double load_radius = 2.0;
// It is wet when a point is nearer than the first, dry beyond the second, in between in part.
constexpr double wet_distance = 1.0, dry_distance = 1.5;

double wet_fraction(double nearest, double spacing) {
  return std::clamp((dry_distance - nearest / spacing) / (dry_distance - wet_distance), 0.0, 1.0);
}

class QuadratureBuilder {
public:
  QuadratureBuilder(const Points &points, const Walls &walls, const Cloud &cloud,
                    WallQuadrature &quadrature)
      : points_(points), walls_(walls), cloud_(cloud), quadrature_(quadrature) {}

  // Two Gauss points on pieces no longer than a spacing: exact for linear pressure times shape.
  void add_segment(int k) {
    const WallSegment &s = walls_.segments[k];
    const Vec<2> &a = walls_.position[s.a], &b = walls_.position[s.b];
    const double length = (b - a).norm();
    const int pieces = std::max(1, static_cast<int>(std::ceil(length / cloud_.spacing)));
    const double gauss = 0.5 / std::sqrt(3.0);
    for (int piece = 0; piece < pieces; ++piece)
      for (const double offset : {-gauss, gauss})
        add_sample(k, (piece + 0.5 + offset) / pieces, 0.5 * length / pieces);
  }

private:
  void add_sample(int k, double t, double length) {
    const WallSegment &s = walls_.segments[k];
    const Vec<2> x = (1 - t) * walls_.position[s.a] + t * walls_.position[s.b];
    const Vec<2> inward = walls_.normal(s);
    const int first = static_cast<int>(quadrature_.contributions.size());
    const double nearest = collect(x, inward);
    const int count = static_cast<int>(quadrature_.contributions.size()) - first;
    const double wet = count > 0 ? wet_fraction(nearest, cloud_.spacing) : 0.0;
    if (wet <= 0) {
      quadrature_.contributions.resize(first);
      return;
    }
    normalise(first);
    quadrature_.samples.push_back({k, t, x, Vec<2>(-inward), wet * length, first, count});
  }

  // Adds the points in front of the segment and in sight; returns the distance of the nearest.
  double collect(const Vec<2> &x, const Vec<2> &inward) {
    const double radius = load_radius * cloud_.spacing;
    double nearest = 1e300;
    for_each_point_near(x, [&](int i) {
      const Vec<2> r = points_.position[i] - x;
      const double distance = r.norm();
      if (distance >= radius || r.dot(inward) <= 0 || is_behind_another_wall(x, inward, i))
        return;
      nearest = std::min(nearest, distance);
      quadrature_.contributions.push_back({i, weight(distance / radius)});
    });
    return nearest;
  }

  bool is_behind_another_wall(const Vec<2> &x, const Vec<2> &inward, int i) const {
    const PointWalls *near = cloud_.walls_of(i);
    if (!near || near->count == 0)
      return false;
    const auto candidates = cloud_.near_segments.near(cloud_.grid.cell(points_.position[i]));
    const double off_wall = 1e-6 * cloud_.spacing;
    return is_hidden(walls_, candidates, x + off_wall * inward, points_.position[i]);
  }

  template <class Visit> void for_each_point_near(const Vec<2> &x, Visit &&visit) const {
    const Grid &grid = cloud_.grid;
    const double reach = load_radius * cloud_.spacing;
    const Vec<2> low = x.array() - reach, high = x.array() + reach;
    const Vec<2> top = grid.origin + grid.cell_size * Vec<2>(grid.nx, grid.ny);
    if ((high.array() < grid.origin.array()).any() || (low.array() > top.array()).any())
      return;
    for (int y = grid.row(low.y()); y <= grid.row(high.y()); ++y) {
      const int first = cloud_.ranges.start[y * grid.nx + grid.column(low.x())];
      const int last = cloud_.ranges.start[y * grid.nx + grid.column(high.x()) + 1];
      for (int i = first; i < last; ++i)
        visit(i);
    }
  }

  void normalise(int first) {
    auto begin = quadrature_.contributions.begin() + first, end = quadrature_.contributions.end();
    const double total =
        std::accumulate(begin, end, 0.0, [](double s, const auto &c) { return s + c.weight; });
    for (auto c = begin; c != end; ++c)
      c->weight /= total;
  }

  const Points &points_;
  const Walls &walls_;
  const Cloud &cloud_;
  WallQuadrature &quadrature_;
};

} // namespace

namespace {

// From point numbers to feeder numbers.
void number_feeders(int n_points, WallQuadrature &quadrature) {
  quadrature.feeders.clear();
  quadrature.feeder_of_point.assign(n_points, -1);
  for (WallQuadrature::Contribution &c : quadrature.contributions) {
    int &feeder = quadrature.feeder_of_point[c.feeder];
    if (feeder < 0) {
      feeder = static_cast<int>(quadrature.feeders.size());
      quadrature.feeders.push_back(c.feeder);
    }
    c.feeder = feeder;
  }
}

} // namespace

void build_wall_quadrature(const Points &points, const Walls &walls, const Cloud &cloud,
                           WallPart part, WallQuadrature &quadrature) {
  quadrature.samples.clear();
  quadrature.contributions.clear();
  QuadratureBuilder builder(points, walls, cloud, quadrature);
  if (part == WallPart::coupled)
    for (const int k : walls.coupled_segments)
      builder.add_segment(k);
  else
    for (int k = 0; k < static_cast<int>(walls.segments.size()); ++k)
      builder.add_segment(k);
  number_feeders(points.size(), quadrature);
}

void evaluate_tractions(const Points &points, const Walls &walls, const Cloud &cloud,
                        const PressureProblem &problem, std::span<const double> pressure,
                        std::span<const double> viscosity, const WallQuadrature &quadrature,
                        std::vector<Vec<2>> &traction) {
  std::vector<Vec<2>> gradient(quadrature.feeders.size());
  for_each_index(static_cast<int>(gradient.size()), [&](int f) {
    gradient[f] = pressure_gradient(quadrature.feeders[f], points, cloud, problem, pressure);
  });
  traction.resize(quadrature.samples.size());
  for_each_index(static_cast<int>(traction.size()), [&](int k) {
    const WallQuadrature::Sample &s = quadrature.samples[k];
    const WallSegment &segment = walls.segments[s.segment];
    const Vec<2> wall_velocity =
        (1 - s.t) * walls.velocity[segment.a] + s.t * walls.velocity[segment.b];
    double p = 0;
    Vec<2> shear = Vec<2>::Zero();
    for (int c = s.first; c < s.first + s.count; ++c) {
      const auto &[feeder, w] = quadrature.contributions[c];
      const int i = quadrature.feeders[feeder];
      const Vec<2> r = s.position - points.position[i];
      p += w * (pressure[i] + gradient[feeder].dot(r));
      if (viscosity.empty())
        continue;
      const Vec<2> slip = points.velocity[i] - wall_velocity;
      const double distance = std::max(r.dot(s.normal), 0.25 * cloud.spacing);
      shear += w * viscosity[i] / distance * (slip - slip.dot(s.normal) * s.normal);
    }
    traction[k] = p * s.normal + shear;
  });
}

void integrate_nodal_forces(const Walls &walls, const WallQuadrature &quadrature,
                            std::span<const Vec<2>> traction, std::span<Vec<2>> force) {
  std::fill(force.begin(), force.end(), Vec<2>(Vec<2>::Zero()));
  for (std::size_t k = 0; k < quadrature.samples.size(); ++k) {
    const WallQuadrature::Sample &s = quadrature.samples[k];
    const WallSegment &segment = walls.segments[s.segment];
    force[segment.a] += (1 - s.t) * s.length * traction[k];
    force[segment.b] += s.t * s.length * traction[k];
  }
}

Resultant integrate_resultant(const WallQuadrature &quadrature,
                              std::span<const Vec<2>> traction) {
  Resultant total;
  for (std::size_t k = 0; k < quadrature.samples.size(); ++k) {
    const Vec<2> force = quadrature.samples[k].length * traction[k];
    total.force += force;
    total.moment += cross(quadrature.samples[k].position, force);
  }
  return total;
}

} // namespace sluice::fluid
