// SPDX-License-Identifier: MIT
#include "fluid/point_noise.hpp"

#include "fluid/packed_stencil.hpp"

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
  for_each_pack(points.size(), [&](int first) {
    const PackedStencil<dim> s(first, points, cloud);
    const PackVec<dim> own = gathered(s.self(), reference.data());
    const auto own_gradient = gathered(s.self(), gradient.data());
    PackVec<dim> unexplained{};
    s.for_each_neighbour([&](const int *j, const PackVec<dim> &q, const Pack &weight_of_j) {
      const PackMask is_thin = gathered_equal(j, cloud.kind.data(), PointKind::thin);
      const Pack w = is_thin ? Pack{} : weight_of_j;
      const PackVec<dim> other = gathered(j, reference.data());
      const auto other_gradient = gathered(j, gradient.data());
      for (int a = 0; a < dim; ++a) {
        Pack explained{};
        for (int b = 0; b < dim; ++b)
          explained += (own_gradient[b * dim + a] + other_gradient[b * dim + a]) * q[b];
        unexplained[a] += w * (other[a] - own[a] - 0.5 * cloud.radius * explained);
      }
    });
    for (int l = 0; l < s.count(); ++l)
      if (cloud.kind[first + l] != PointKind::thin)
        for (int a = 0; a < dim; ++a)
          velocity[first + l][a] += factor * unexplained[a][l];
  });
}

template void damp_point_noise(const Points<2> &, const Cloud<2> &, VecView<2>, MatView<2>, double,
                               double, VecSpan<2>);
template void damp_point_noise(const Points<3> &, const Cloud<3> &, VecView<3>, MatView<3>, double,
                               double, VecSpan<3>);

} // namespace sluice::fluid
