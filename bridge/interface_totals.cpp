// SPDX-License-Identifier: MIT
#include "bridge/base/vec.hpp"
#include "bridge/participant.hpp"

#include <Eigen/Geometry>

#include <cassert>

namespace sluice::bridge {

namespace {

Vec<3> node_value(std::span<const double> values, std::size_t node, std::size_t dim) {
  Vec<3> v = Vec<3>::Zero();
  for (std::size_t d = 0; d < dim; ++d)
    v[static_cast<Eigen::Index>(d)] = values[dim * node + d];
  return v;
}

} // namespace

InterfaceTotals interface_totals(int dim, std::span<const double> positions,
                                 std::span<const double> forces, std::span<const double> start,
                                 std::span<const double> end) {
  assert(positions.size() == forces.size() && positions.size() == start.size() &&
         positions.size() == end.size());
  InterfaceTotals totals;
  Vec<3> force = Vec<3>::Zero(), moment = Vec<3>::Zero();
  const auto components = static_cast<std::size_t>(dim);
  for (std::size_t a = 0; a < positions.size() / components; ++a) {
    const Vec<3> f = node_value(forces, a, components);
    const Vec<3> from = node_value(start, a, components), to = node_value(end, a, components);
    const Vec<3> x = node_value(positions, a, components) + to;
    force += f;
    moment += x.cross(f);
    totals.work += f.dot(to - from);
    totals.force_magnitude += f.norm();
    totals.moment_magnitude += x.norm() * f.norm();
    totals.work_magnitude += f.norm() * (from.norm() + to.norm());
  }
  Eigen::Map<Vec<3>>(totals.force.data()) = force;
  Eigen::Map<Vec<3>>(totals.moment.data()) = moment;
  return totals;
}

} // namespace sluice::bridge
