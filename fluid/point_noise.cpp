// SPDX-License-Identifier: MIT
#include "fluid/point_noise.hpp"

#include "fluid/parallel.hpp"
#include "fluid/weights.hpp"

#include <algorithm>
#include <cmath>

namespace sluice::fluid {

namespace {

// Sum of the weights of a point on a square lattice, the normaliser of all points.
double lattice_weight() {
  double total = 0;
  for (int x = -3; x <= 3; ++x)
    for (int y = -3; y <= 3; ++y) {
      const double q = std::hypot(x, y) / kernel_radius_ratio;
      total += q > 0 && q < 1 ? weight(q) : 0.0;
    }
  return total;
}

} // namespace

void damp_point_noise(const Points &points, const Cloud &cloud, std::span<const Vec<2>> reference,
                      std::span<const Mat<2>> gradient, double rate, double dt,
                      std::span<Vec<2>> velocity) {
  const double factor = std::min(rate * dt, 0.5) / lattice_weight();
  for_each_point(points.size(), [&](int i) {
    if (cloud.kind[i] == PointKind::thin)
      return;
    Vec<2> unexplained = Vec<2>::Zero();
    for (const int j : cloud.neighbours.of(i)) {
      if (cloud.kind[j] == PointKind::thin)
        continue;
      const Vec<2> r = points.position[j] - points.position[i];
      const double w = weight(std::min(r.norm() / cloud.radius, 1.0));
      unexplained += w * (reference[j] - reference[i] - 0.5 * (gradient[i] + gradient[j]) * r);
    }
    velocity[i] += factor * unexplained;
  });
}

} // namespace sluice::fluid
