// SPDX-License-Identifier: MIT
#include "fluid/point_noise.hpp"

#include "fluid/parallel.hpp"
#include "fluid/weights.hpp"

#include <algorithm>
#include <cmath>

namespace sluice::fluid {

namespace {

// Sum of the weights of a point on a square lattice, the normaliser of all points.
template <int dim> double lattice_weight() {
  constexpr int reach = 3;
  double total = 0;
  for (int x = -reach; x <= reach; ++x)
    for (int y = -reach; y <= reach; ++y)
      for (int z = dim == 3 ? -reach : 0; z <= (dim == 3 ? reach : 0); ++z) {
        const double r = dim == 2 ? std::hypot(x, y) : std::hypot(x, y, z),
                     q = r / kernel_radius_ratio;
        total += q > 0 && q < 1 ? weight(q) : 0.0;
      }
  return total;
}

} // namespace

template <int dim>
void damp_point_noise(const Points<dim> &points, const Cloud<dim> &cloud, VecView<dim> reference,
                      MatView<dim> gradient, double rate, double dt, VecSpan<dim> velocity) {
  const double factor = std::min(rate * dt, 0.5) / lattice_weight<dim>();
  for_each_point(points.size(), [&](int i) {
    if (cloud.kind[i] == PointKind::thin)
      return;
    Vec<dim> unexplained = Vec<dim>::Zero();
    for (const int j : cloud.neighbours.of(i)) {
      if (cloud.kind[j] == PointKind::thin)
        continue;
      const Vec<dim> r = points.position[j] - points.position[i];
      const double w = weight(std::min(r.norm() / cloud.radius, 1.0));
      unexplained += w * (reference[j] - reference[i] - 0.5 * (gradient[i] + gradient[j]) * r);
    }
    velocity[i] += factor * unexplained;
  });
}

template void damp_point_noise(const Points<2> &, const Cloud<2> &, VecView<2>, MatView<2>, double,
                               double, VecSpan<2>);
template void damp_point_noise(const Points<3> &, const Cloud<3> &, VecView<3>, MatView<3>, double,
                               double, VecSpan<3>);

} // namespace sluice::fluid
