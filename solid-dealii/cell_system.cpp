// SPDX-License-Identifier: MIT
// The kernels of all elements, compiled once: this is the file that takes the compiler's time.
#include "solid-dealii/cell_system.hpp"

namespace sluice::solid {
namespace {

template <int dim, int columns, class Response>
ElementSystem<dim, columns> plain_system(const Discretisation<dim> &d, const Material &material,
                                         const Overstress<dim> &overstress, int cell,
                                         const Columns<dim, columns> &u, bool with_tangent) {
  ElementSystem<dim, columns> element;
  const auto at = deformation<dim, columns>(d, cell, u);
  element.min_det = material.is_small_strain() && at.det.allFinite() ? 1 : at.smallest_det();
  if (!(element.min_det > 0))
    return element;
  std::array<Response, max_points<dim>> responses;
  respond<dim, Response>(material, at.gradients(), overstress_of(d, overstress, cell),
                         std::span(responses).first(at.gradients().size()));
  for (int q = 0; q < d.points_per_cell; ++q)
    add_point<dim, columns>(responses[static_cast<std::size_t>(q)],
                            Columns<dim, columns>(gradient_at<dim, columns>(d, cell, q)),
                            weight_at(d, cell, q), with_tangent, element);
  return element;
}

// The same for an element with volume change and pressure in a space of their own.
template <int dim, int columns>
ElementSystem<dim, columns> mixed_system(const Discretisation<dim> &d, const Material &material,
                                         const Overstress<dim> &overstress, int cell,
                                         const Columns<dim, columns> &u, bool with_tangent) {
  ElementSystem<dim, columns> element;
  const auto at = deformation<dim, columns>(d, cell, u);
  element.min_det = at.smallest_det();
  if (!(element.min_det > 0))
    return element;
  const Volume &volume = *material.volume();
  const auto phi = pressure_basis(d, cell);
  const auto field =
      volume_field<dim>(phi, at.det, decltype(at.det)(cell_weights(d, cell)), volume);
  element.min_det = std::min(element.min_det, field.theta.minCoeff());
  if (!(element.min_det > 0))
    return element;
  std::array<VoigtResponse<dim>, max_points<dim>> responses;
  respond_distortion<dim>(material, at.gradients(), overstress_of(d, overstress, cell),
                          std::span(responses).first(at.gradients().size()));
  Eigen::Matrix<double, n_pressures<dim>, dim * columns> divergence;
  divergence.setZero();
  Mat<n_pressures<dim>> stiffness = Mat<n_pressures<dim>>::Zero();
  for (int q = 0; q < d.points_per_cell; ++q) {
    auto &r = responses[static_cast<std::size_t>(q)];
    const double w = weight_at(d, cell, q);
    Volume::add_pressure<dim>(r, at.det[q] * field.pressure[q], 0);
    const Columns<dim, columns> gradient = gradient_at<dim, columns>(d, cell, q);
    add_point<dim, columns>(r, gradient, w, with_tangent, element);
    const Columns<dim, columns> g = r.push * gradient;
    divergence.noalias() += w * at.det[q] * phi.col(q) * g.reshaped().transpose();
    stiffness.noalias() +=
        w * volume.stiffness(field.theta[q]) * phi.col(q) * phi.col(q).transpose();
  }
  if (with_tangent)
    add_volume_stiffness<dim, columns>(divergence, stiffness, element);
  return element;
}

} // namespace

template <int dim, int nodes, int modes>
ElementSystem<dim, nodes + modes>
cell_system(const Discretisation<dim> &d, const Material &material,
            const Overstress<dim> &overstress, int cell, const Columns<dim, nodes + modes> &u,
            bool with_tangent) {
  constexpr int columns = nodes + modes;
  if constexpr (nodes == (dim == 2 ? 9 : 27))
    if (d.kind == ElementKind::q2_p1)
      return mixed_system<dim, columns>(d, material, overstress, cell, u, with_tangent);
  if (material.has_metric_tangent())
    return plain_system<dim, columns, MetricResponse<dim>>(d, material, overstress, cell, u,
                                                           with_tangent);
  return plain_system<dim, columns, VoigtResponse<dim>>(d, material, overstress, cell, u,
                                                        with_tangent);
}

#define SLUICE_CELL_SYSTEM(dim, nodes, modes)                                                      \
  template ElementSystem<dim, nodes + modes> cell_system<dim, nodes, modes>(                       \
      const Discretisation<dim> &, const Material &, const Overstress<dim> &, int,                 \
      const Columns<dim, nodes + modes> &, bool);
SLUICE_CELL_SYSTEM(2, 4, 0)
SLUICE_CELL_SYSTEM(2, 4, 2)
SLUICE_CELL_SYSTEM(2, 9, 0)
SLUICE_CELL_SYSTEM(2, 16, 0)
SLUICE_CELL_SYSTEM(3, 8, 0)
SLUICE_CELL_SYSTEM(3, 8, 3)
SLUICE_CELL_SYSTEM(3, 27, 0)
#undef SLUICE_CELL_SYSTEM

} // namespace sluice::solid
