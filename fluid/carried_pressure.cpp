// SPDX-License-Identifier: MIT
#include "fluid/carried_pressure.hpp"

#include "fluid/parallel.hpp"
#include "fluid/weights.hpp"

#include <algorithm>
#include <cmath>

namespace sluice::fluid {

namespace {

/// Root of the sum of squares of the sources over their diagonals [Pa].
template <int dim> double size_of_sources(const PressureProblem<dim> &problem) {
  const int n = static_cast<int>(problem.fluid_source.size());
  return std::sqrt(sum(n, [&](int i) {
    const double scaled = problem.fluid_source[i] / problem.matrix.diagonal[i];
    return scaled * scaled;
  }));
}

/// Calls visit(j, weight) for the interior neighbours of a point.
template <int dim, class Visit>
void for_each_interior_neighbour(int i, const Points<dim> &points, const Cloud<dim> &cloud,
                                 Visit &&visit) {
  for (const int j : cloud.neighbours.of(i)) {
    const double q = (points.position[j] - points.position[i]).norm() / cloud.radius;
    if (cloud.kind[j] == PointKind::interior && q < 1)
      visit(j, weight(q));
  }
}

template <int dim>
void add_to_sources(const Points<dim> &points, const Cloud<dim> &cloud,
                    const CarriedPressure<dim> &carried, PressureProblem<dim> &problem) {
  for_each_point(points.size(), [&](int i) {
    // A row that is part of the surface's is no Laplacian: such a point finds its pressure anew.
    if (cloud.kind[i] != PointKind::interior || cloud.openness[i] > 0)
      return;
    double known = 0; // off-diagonal entries are minus the weights of differences
    problem.matrix.for_each_entry(i, [&](int j, double value) {
      const double share = 0.5 * (carried.share[i] + carried.share[j]);
      known += value * share * (points.pressure[j] - points.pressure[i]);
    });
    problem.fluid_source[i] += known;
  });
}

// The Laplacian of beta p_last and that of the unknown hold the same slope at a wall: it enters the
// gradient alone.
template <int dim>
void add_to_wall_data(const Points<dim> &points, const Cloud<dim> &cloud,
                      const CarriedPressure<dim> &carried, PressureProblem<dim> &problem) {
  for_each_index(static_cast<int>(cloud.wall_points.size()), [&](int slot) {
    const int i = cloud.wall_points[slot];
    const PointWalls<dim> &walls = cloud.point_walls[slot];
    for (int m = 0; m < walls.count; ++m)
      problem.wall_rows[slot][m].carried =
          carried.share[i] * walls.projection[m].normal.dot(points.pressure_gradient[i]);
  });
}

template <int dim>
void correct(const Points<dim> &points, const Cloud<dim> &cloud, std::span<const double> viscosity,
             std::span<const double> target_divergence, const PressureProblem<dim> &problem,
             CarriedPressure<dim> &carried) {
  const auto excess = [&](int i) {
    return problem.velocity_gradient[i].trace() - target_divergence[i];
  };
  const int n = points.size();
  const double mean = n / sum(n, [&](int i) { return 1 / viscosity[i]; });
  carried.correction.assign(n, 0);
  for_each_point(points.size(), [&](int i) {
    if (cloud.kind[i] != PointKind::interior)
      return;
    double total = excess(i), weights = 1;
    for_each_interior_neighbour(i, points, cloud, [&](int j, double w) {
      total += w * excess(j);
      weights += w;
    });
    carried.correction[i] = carried.share[i] * std::min(viscosity[i], mean) * total / weights;
  });
}

} // namespace

template <int dim>
void share_pressure(std::span<const double> viscosity, const Cloud<dim> &cloud, double factor,
                    VecView<dim> by_pressure, CarriedPressure<dim> &carried) {
  const int n = static_cast<int>(viscosity.size());
  carried.share.resize(n);
  carried.velocity.resize(n);
  for_each_point(n, [&](int i) {
    const double stiffness = factor * viscosity[i] / (cloud.spacing * cloud.spacing);
    const bool is_emerging = cloud.openness[i] > 0 && cloud.openness[i] < 1;
    carried.share[i] = is_emerging ? 0 : 1 - 1 / (1 + stiffness * stiffness);
    carried.velocity[i] = carried.share[i] * by_pressure[i];
  });
}

template <int dim>
void add_carried_pressure(const Points<dim> &points, const Cloud<dim> &cloud,
                          std::span<const double> viscosity,
                          std::span<const double> target_divergence, CarriedPressure<dim> &carried,
                          PressureProblem<dim> &problem) {
  const double before = size_of_sources(problem);
  add_to_sources(points, cloud, carried, problem);
  add_to_wall_data(points, cloud, carried, problem);
  correct(points, cloud, viscosity, target_divergence, problem, carried);
  carried.new_share = std::min(1.0, before / size_of_sources(problem));
}

template <int dim>
void settle_pressure(const Cloud<dim> &cloud, CarriedPressure<dim> &carried, Points<dim> &points) {
  constexpr double taken = 0.5; // of what gradients do not see, in one step
  const int n = points.size();
  for_each_point(n, [&](int i) { points.pressure[i] -= carried.correction[i]; });
  carried.smoothing.assign(n, 0);
  for_each_point(n, [&](int i) {
    if (cloud.kind[i] != PointKind::interior)
      return;
    double unseen = 0, weights = 1e-300;
    for_each_interior_neighbour(i, points, cloud, [&](int j, double w) {
      const Vec<dim> slope = 0.5 * (points.pressure_gradient[i] + points.pressure_gradient[j]);
      unseen += w * (points.pressure[j] - points.pressure[i] -
                     slope.dot(points.position[j] - points.position[i]));
      weights += w;
    });
    carried.smoothing[i] = taken * carried.share[i] * unseen / weights;
  });
  for_each_point(n, [&](int i) { points.pressure[i] += carried.smoothing[i]; });
}

template void share_pressure(std::span<const double>, const Cloud<2> &, double, VecView<2>,
                             CarriedPressure<2> &);
template void add_carried_pressure(const Points<2> &, const Cloud<2> &, std::span<const double>,
                                   std::span<const double>, CarriedPressure<2> &,
                                   PressureProblem<2> &);
template void settle_pressure(const Cloud<2> &, CarriedPressure<2> &, Points<2> &);
template void share_pressure(std::span<const double>, const Cloud<3> &, double, VecView<3>,
                             CarriedPressure<3> &);
template void add_carried_pressure(const Points<3> &, const Cloud<3> &, std::span<const double>,
                                   std::span<const double>, CarriedPressure<3> &,
                                   PressureProblem<3> &);
template void settle_pressure(const Cloud<3> &, CarriedPressure<3> &, Points<3> &);

} // namespace sluice::fluid
