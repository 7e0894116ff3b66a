// SPDX-License-Identifier: MIT
// Force and tangent of one cell of a Discretisation: deformation at the points, the material's
// answer for all of them at once, then the element kernel.
#pragma once

#include "solid-dealii/discretisation.hpp"
#include "solid-dealii/element_mixed.hpp"

namespace sluice::solid {

/// Displacement of a cell's nodes and modes, column by column.
template <int dim, int nodes, int modes>
Columns<dim, nodes + modes> gather(const Discretisation<dim> &d, int cell,
                                   const Eigen::VectorXd &displacement,
                                   const Eigen::VectorXd &mode_values) {
  Columns<dim, nodes + modes> u;
  const int *numbers = d.cell_nodes.data() + cell * nodes;
  for (int a = 0; a < nodes; ++a)
    u.col(a) = displacement.template segment<dim>(dim * numbers[a]);
  for (int a = 0; a < modes; ++a)
    u.col(nodes + a) = mode_values.template segment<dim>(dim * (cell * modes + a));
  return u;
}

template <int dim, int columns>
Eigen::Map<const Columns<dim, columns>> gradient_at(const Discretisation<dim> &d, int cell, int q) {
  const auto index = static_cast<std::size_t>(cell * d.points_per_cell + q);
  return Eigen::Map<const Columns<dim, columns>>(d.gradients.data() + index * dim * columns);
}

template <int dim> double weight_at(const Discretisation<dim> &d, int cell, int q) {
  return d.weights[static_cast<std::size_t>(cell * d.points_per_cell + q)];
}

/// Deformation gradients at the points of a cell.
template <int dim> struct CellDeformation {
  std::array<Mat<dim>, max_points<dim>> F;
  Eigen::Matrix<double, 1, Eigen::Dynamic, Eigen::RowMajor, 1, max_points<dim>> det;

  std::span<const Mat<dim>> gradients() const {
    return {F.data(), static_cast<std::size_t>(det.size())};
  }
  /// Smallest det F; minus infinity where one is not a number.
  double smallest_det() const {
    return det.array().isNaN().any() ? -std::numeric_limits<double>::infinity() : det.minCoeff();
  }
};

template <int dim, int columns>
CellDeformation<dim> deformation(const Discretisation<dim> &d, int cell,
                                 const Columns<dim, columns> &u) {
  CellDeformation<dim> at;
  at.det.resize(d.points_per_cell);
  for (int q = 0; q < d.points_per_cell; ++q) {
    const auto k = static_cast<std::size_t>(q);
    at.F[k] = deformation_gradient<dim, columns>(u, gradient_at<dim, columns>(d, cell, q));
    at.det[q] = at.F[k].determinant();
  }
  return at;
}

/// Weights of a cell's points as a row.
template <int dim> auto cell_weights(const Discretisation<dim> &d, int cell) {
  return Eigen::Map<
      const Eigen::Matrix<double, 1, Eigen::Dynamic, Eigen::RowMajor, 1, max_points<dim>>>(
      d.weights.data() + static_cast<std::ptrdiff_t>(cell) * d.points_per_cell, d.points_per_cell);
}

template <int dim> PressureBasis<dim> pressure_basis(const Discretisation<dim> &d, int cell) {
  return PressureBasis<dim>(d.pressure_basis.data() + static_cast<std::ptrdiff_t>(cell) *
                                                          d.points_per_cell * n_pressures<dim>,
                            n_pressures<dim>, d.points_per_cell);
}

/// What acts in one cell beside its law.
template <int dim>
Overstress<dim> overstress_of(const Discretisation<dim> &d, const Overstress<dim> &whole,
                              int cell) {
  if (whole.stress.empty())
    return whole;
  const auto n = static_cast<std::size_t>(voigt_size<dim> * d.points_per_cell);
  return {whole.factor, whole.stress.subspan(n * static_cast<std::size_t>(cell), n)};
}

/// Force and, when wanted, the lower triangle of the tangent of one cell. An element with an
/// inverted point gets nothing but its smallest det F (which a law of small strain does not mind).
template <int dim, int nodes, int modes>
ElementSystem<dim, nodes + modes>
cell_system(const Discretisation<dim> &d, const Material &material,
            const Overstress<dim> &overstress, int cell, const Columns<dim, nodes + modes> &u,
            bool with_tangent);

} // namespace sluice::solid
