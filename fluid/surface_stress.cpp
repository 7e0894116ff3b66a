// SPDX-License-Identifier: MIT
#include "fluid/surface_stress.hpp"

#include "bridge/base/check.hpp"
#include "fluid/least_squares.hpp"
#include "fluid/parallel.hpp"
#include "fluid/weights.hpp"

#include <Eigen/Sparse>
#include <algorithm>
#include <cmath>
#include <vector>

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

// Sum of w |q|^2 over the surface points around one, on a straight surface of a lattice.
template <int dim> double moment_along_surface() {
  double sum = 0;
  constexpr int reach = 3, across = dim == 3 ? reach : 0;
  static_assert(reach >= kernel_radius_ratio);
  for (int j = -across; j <= across; ++j)
    for (int i = -reach; i <= reach; ++i) {
      const double q = std::hypot(i, j) / kernel_radius_ratio;
      sum += q < 1 ? weight(q) * q * q : 0.0;
    }
  return sum;
}

template <int dim> void number_surface(const Cloud<dim> &cloud, SurfacePoints &surface) {
  surface.point.clear();
  surface.number.assign(cloud.kind.size(), -1);
  for (int i = 0; i < static_cast<int>(cloud.kind.size()); ++i)
    if (cloud.kind[i] == PointKind::surface) {
      surface.number[i] = static_cast<int>(surface.point.size());
      surface.point.push_back(i);
    }
}

/// 1 - 2 factor div_s mu grad_s on the surface points; symmetric and positive definite.
template <int dim>
Eigen::SparseMatrix<double> surface_diffusion(const Points<dim> &points, const Cloud<dim> &cloud,
                                              std::span<const double> viscosity, double factor,
                                              const SurfacePoints &surface) {
  const double scale =
      4 * (dim - 1) * factor / (moment_along_surface<dim>() * cloud.radius * cloud.radius);
  std::vector<Eigen::Triplet<double>> entries;
  const auto add = [&](int row, int column, double value) {
    entries.emplace_back(row, column, value);
  };
  for (int a = 0; a < static_cast<int>(surface.point.size()); ++a) {
    const int i = surface.point[a];
    add(a, a, 1);
    for (const int j : cloud.neighbours.of(i)) {
      const int b = surface.number[j];
      if (b <= a) // each pair once: also where one list has been cut short
        continue;
      const double q = (points.position[j] - points.position[i]).norm() / cloud.radius;
      const double c = scale * weight(std::min(q, 1.0)) * 0.5 * (viscosity[i] + viscosity[j]);
      add(a, a, c);
      add(b, b, c);
      add(a, b, -c);
      add(b, a, -c);
    }
  }
  const int n = static_cast<int>(surface.point.size());
  Eigen::SparseMatrix<double> matrix(n, n);
  matrix.setFromTriplets(entries.begin(), entries.end());
  return matrix;
}

} // namespace

template <int dim>
void update_surface_pressure(const Cloud<dim> &cloud, std::span<const double> viscosity,
                             VecView<dim> velocity, double factor, Points<dim> &points,
                             SurfacePoints &surface) {
  number_surface(cloud, surface);
  const int n = static_cast<int>(surface.point.size());
  surface.change.resize(n);
  for_each_index(n, [&](int a) {
    const int i = surface.point[a];
    surface.change[a] =
        2 * viscosity[i] * contraction(i, points, cloud, velocity) - points.surface_pressure[i];
  });
  double largest = 0;
  for (const int i : surface.point)
    largest = std::max(largest, viscosity[i]);
  constexpr double stiff = 0.01;
  if (factor * largest > stiff * cloud.spacing * cloud.spacing) {
    const Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>> solver(
        surface_diffusion(points, cloud, viscosity, factor, surface));
    check(solver.info() == Eigen::Success,
          "the stress at {} surface points cannot be solved for; reduce the time step", n);
    Eigen::Map<Eigen::VectorXd> change(surface.change.data(), n);
    change = solver.solve(change).eval();
  }
  for_each_point(points.size(), [&](int i) {
    const int a = surface.number[i];
    points.surface_pressure[i] = a < 0 ? 0 : points.surface_pressure[i] + surface.change[a];
  });
}

template void update_surface_pressure(const Cloud<2> &, std::span<const double>, VecView<2>, double,
                                      Points<2> &, SurfacePoints &);
template void update_surface_pressure(const Cloud<3> &, std::span<const double>, VecView<3>, double,
                                      Points<3> &, SurfacePoints &);

} // namespace sluice::fluid
