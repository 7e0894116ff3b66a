// SPDX-License-Identifier: MIT
#include "fluid/surface_stress.hpp"

#include "fluid/least_squares.hpp"
#include "fluid/parallel.hpp"
#include "fluid/weights.hpp"

#include <algorithm>

namespace sluice::fluid {

namespace {

// Rate at which the surface contracts around point i [1/s].
template <int dim>
double contraction(int i, const Points<dim> &points, const Cloud<dim> &cloud,
                   VecView<dim> velocity) {
  LinearFit<dim> fit;
  Mat<dim> moment = Mat<dim>::Zero();
  for (const int j : cloud.neighbours.of(i)) {
    const Vec<dim> q = (points.position[j] - points.position[i]) / cloud.radius;
    const double w = weight(std::min(q.norm(), 1.0));
    fit.add(q, w);
    moment += w * (velocity[j] - velocity[i]) * q.transpose();
  }
  const Mat<dim> gradient = moment * fit.limited_inverse() / cloud.radius;
  const Vec<dim> &n = cloud.surface_normal[i];
  return n.dot(gradient * n) - gradient.trace();
}

} // namespace

template <int dim>
void surface_pressure(const Points<dim> &points, const Cloud<dim> &cloud,
                      std::span<const double> viscosity, VecView<dim> velocity,
                      std::vector<double> &pressure) {
  pressure.clear();
  if (viscosity.empty())
    return;
  const auto is_at_surface = [&](int i) { return cloud.kind[i] == PointKind::surface; };
  std::vector<double> stress(points.size(), 0.0);
  for_each_point(points.size(), [&](int i) {
    if (is_at_surface(i))
      stress[i] = 2 * viscosity[i] * contraction(i, points, cloud, velocity);
  });
  pressure.assign(points.size(), 0.0);
  for_each_point(points.size(), [&](int i) {
    if (!is_at_surface(i))
      return;
    double sum = stress[i], total = 1;
    for (const int j : cloud.neighbours.of(i))
      if (is_at_surface(j)) {
        const double w =
            weight(std::min((points.position[j] - points.position[i]).norm() / cloud.radius, 1.0));
        sum += w * stress[j];
        total += w;
      }
    pressure[i] = sum / total;
  });
}

template void surface_pressure(const Points<2> &, const Cloud<2> &, std::span<const double>,
                               VecView<2>, std::vector<double> &);
template void surface_pressure(const Points<3> &, const Cloud<3> &, std::span<const double>,
                               VecView<3>, std::vector<double> &);

} // namespace sluice::fluid
