// SPDX-License-Identifier: MIT
#include "solid-dealii/loads.hpp"

#include <Eigen/Geometry>

namespace sluice::solid {
namespace {

template <int dim> Vec<3> in_space(const Vec<dim> &v) {
  Vec<3> w = Vec<3>::Zero();
  w.template head<dim>() = v;
  return w;
}

// cof(F) = det(F) F^-T, also where F is singular: an area element needs no inverse.
Mat<2> cofactor(const Mat<2> &F) {
  Mat<2> c;
  c << F(1, 1), -F(1, 0), -F(0, 1), F(0, 0);
  return c;
}
Mat<3> cofactor(const Mat<3> &F) {
  Mat<3> c;
  for (int d = 0; d < 3; ++d)
    c.row(d) = F.row((d + 1) % 3).cross(F.row((d + 2) % 3));
  return c;
}

// Calls action(point, nodes of its cell) for every quadrature point of some faces.
template <int dim, class Action>
void for_each_boundary_point(const Discretisation<dim> &d, const std::vector<int> &faces,
                             Action &&action) {
  for (const int face : faces)
    for (int q = 0; q < d.points_per_face; ++q) {
      const auto &point = d.boundary_points[static_cast<std::size_t>(face * d.points_per_face + q)];
      action(point, d.cell_nodes.data() + point.cell * d.nodes_per_cell);
    }
}

} // namespace

template <int dim>
Eigen::VectorXd pressure_forces(const Discretisation<dim> &d, const std::vector<int> &faces,
                                const Hydrostatic &pressure, const Eigen::VectorXd &displacement) {
  Eigen::VectorXd forces = Eigen::VectorXd::Zero(d.n_dofs());
  for_each_boundary_point(d, faces, [&](const BoundaryPoint<dim> &point, const int *nodes) {
    Mat<dim> F = Mat<dim>::Identity();
    for (int a = 0; a < d.nodes_per_cell; ++a)
      F += displacement.template segment<dim>(dim * nodes[a]) * point.gradients.col(a).transpose();
    const Vec<dim> traction =
        -pressure(point.position.y()) * point.weight * (cofactor(F) * point.normal);
    for (int a = 0; a < d.nodes_per_cell; ++a)
      forces.template segment<dim>(dim * nodes[a]) += point.values[a] * traction;
  });
  d.components.add_up(forces);
  return forces;
}

template <int dim>
Eigen::VectorXd traction_forces(const Discretisation<dim> &d, const std::vector<int> &faces,
                                const std::function<Vec<dim>(const Vec<dim> &)> &traction) {
  Eigen::VectorXd forces = Eigen::VectorXd::Zero(d.n_dofs());
  for_each_boundary_point(d, faces, [&](const BoundaryPoint<dim> &point, const int *nodes) {
    const Vec<dim> force = point.weight * traction(point.position);
    for (int a = 0; a < d.nodes_per_cell; ++a)
      forces.template segment<dim>(dim * nodes[a]) += point.values[a] * force;
  });
  d.components.add_up(forces);
  return forces;
}

template <int dim>
LoadSums<dim> sum_loads(const Discretisation<dim> &d, const Eigen::VectorXd &load,
                        const Eigen::VectorXd &start, const Eigen::VectorXd &end) {
  LoadSums<dim> sums;
  for (int a = 0; a < d.n_nodes(); ++a) {
    if (!d.components.owns(dim * a))
      continue;
    const Vec<dim> f = load.template segment<dim>(dim * a);
    const Vec<dim> u = end.template segment<dim>(dim * a);
    const Vec<dim> x = d.nodes[static_cast<std::size_t>(a)] + u;
    const double work = f.dot(u - start.template segment<dim>(dim * a));
    sums.force += f;
    sums.moment += in_space<dim>(x).cross(in_space<dim>(f));
    sums.work += work;
    sums.force_magnitude += f.norm();
    sums.moment_magnitude += x.norm() * f.norm();
    sums.work_magnitude += std::abs(work);
  }
  sums.force = d.ranks.sum(sums.force);
  sums.moment = d.ranks.sum(sums.moment);
  for (double *sum :
       {&sums.work, &sums.force_magnitude, &sums.moment_magnitude, &sums.work_magnitude})
    *sum = d.ranks.sum(*sum);
  return sums;
}

template Eigen::VectorXd pressure_forces(const Discretisation<2> &, const std::vector<int> &,
                                         const Hydrostatic &, const Eigen::VectorXd &);
template Eigen::VectorXd traction_forces(const Discretisation<2> &, const std::vector<int> &,
                                         const std::function<Vec<2>(const Vec<2> &)> &);
template Eigen::VectorXd pressure_forces(const Discretisation<3> &, const std::vector<int> &,
                                         const Hydrostatic &, const Eigen::VectorXd &);
template Eigen::VectorXd traction_forces(const Discretisation<3> &, const std::vector<int> &,
                                         const std::function<Vec<3>(const Vec<3> &)> &);
template LoadSums<2> sum_loads(const Discretisation<2> &, const Eigen::VectorXd &,
                               const Eigen::VectorXd &, const Eigen::VectorXd &);
template LoadSums<3> sum_loads(const Discretisation<3> &, const Eigen::VectorXd &,
                               const Eigen::VectorXd &, const Eigen::VectorXd &);

} // namespace sluice::solid
