// SPDX-License-Identifier: MIT
#include "bridge/mapping.hpp"

#include "bridge/linear_reproduction.hpp"
#include "bridge/mapping_extruded.hpp"
#include "bridge/mapping_mortar.hpp"
#include "bridge/mapping_nearest.hpp"
#include "bridge/mapping_projection.hpp"
#include "bridge/mapping_rbf.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cassert>
#include <cstddef>

namespace sluice::bridge {

namespace {

// The first `dim` components of each node; the row's sums stay in registers.
template <int dim>
void multiply_components(double factor, const Mapping::Matrix &matrix, const double *in, int dim_in,
                         double *out, int dim_out) {
  const double *weight = matrix.valuePtr();
  const int *node = matrix.innerIndexPtr(), *start = matrix.outerIndexPtr();
  for (Eigen::Index row = 0; row < matrix.rows(); ++row) {
    Vec<dim> sum = Vec<dim>::Zero();
    for (int k = start[row]; k < start[row + 1]; ++k)
      sum += weight[k] * Eigen::Map<const Vec<dim>>(in + std::ptrdiff_t{node[k]} * dim_in);
    Eigen::Map<Vec<dim>>(out + row * dim_out) = factor * sum;
  }
}

// `factor` times the matrix times each component that both sides have; the others are zero.
void multiply(double factor, const Mapping::Matrix &matrix, std::span<const double> values,
              int dim_in, int dim_out, std::span<double> result) {
  assert(static_cast<Eigen::Index>(values.size()) == matrix.cols() * dim_in);
  assert(static_cast<Eigen::Index>(result.size()) == matrix.rows() * dim_out);
  assert(matrix.isCompressed());
  if (dim_in != dim_out)
    std::fill(result.begin(), result.end(), 0.0);
  if (std::min(dim_in, dim_out) == 3)
    multiply_components<3>(factor, matrix, values.data(), dim_in, result.data(), dim_out);
  else
    multiply_components<2>(factor, matrix, values.data(), dim_in, result.data(), dim_out);
}

bool is_unit_matrix(const Mapping::Matrix &matrix) {
  if (matrix.rows() != matrix.cols() || matrix.nonZeros() != matrix.rows())
    return false;
  for (int row = 0; row < matrix.rows(); ++row)
    if (matrix.coeff(row, row) != 1)
      return false;
  return true;
}

} // namespace

Mapping::Mapping(const InterfaceMesh &fluid, const InterfaceMesh &solid, Matrix matrix,
                 MapReport report, double depth)
    : fluid_dim_(fluid.dim), solid_dim_(solid.dim), depth_(depth), matrix_(std::move(matrix)),
      transpose_(matrix_.transpose()), fluid_areas_(node_areas(fluid)),
      solid_areas_(node_areas(solid)), report_(report),
      is_identity_(fluid.dim == solid.dim && depth == 1 && is_unit_matrix(matrix_)) {
  matrix_.makeCompressed();
  const Eigen::VectorXd row_sums = matrix_ * Eigen::VectorXd::Ones(matrix_.cols());
  report_.fluid_nodes = fluid.n_nodes();
  report_.solid_nodes = solid.n_nodes();
  report_.row_sum_error = (row_sums.array() - 1).abs().maxCoeff();
  report_.largest_offset = bridge::largest_offset(matrix_, fluid, solid);
  report_.solid_nodes_reached = 0;
  for (int j = 0; j < transpose_.rows(); ++j)
    report_.solid_nodes_reached += transpose_.row(j).nonZeros() > 0;
}

std::vector<double> Mapping::consistent(std::span<const double> solid_values) const {
  std::vector<double> result(static_cast<std::size_t>(matrix_.rows() * fluid_dim_));
  consistent(solid_values, result);
  return result;
}

void Mapping::consistent(std::span<const double> solid_values,
                         std::span<double> fluid_values) const {
  multiply(1, matrix_, solid_values, solid_dim_, fluid_dim_, fluid_values);
}

std::vector<double> Mapping::conservative(std::span<const double> fluid_values) const {
  std::vector<double> result(static_cast<std::size_t>(transpose_.rows() * solid_dim_));
  conservative(fluid_values, result);
  return result;
}

void Mapping::conservative(std::span<const double> fluid_values,
                           std::span<double> solid_values) const {
  multiply(depth_, transpose_, fluid_values, fluid_dim_, solid_dim_, solid_values);
}

std::vector<double> Mapping::traction(std::span<const double> fluid_values) const {
  std::vector<double> forces(fluid_values.begin(), fluid_values.end());
  for (std::size_t k = 0; k < forces.size(); ++k)
    forces[k] *= fluid_areas_[k / static_cast<std::size_t>(fluid_dim_)];
  std::vector<double> tractions = conservative(forces);
  for (std::size_t k = 0; k < tractions.size(); ++k)
    tractions[k] /= solid_areas_[k / static_cast<std::size_t>(solid_dim_)];
  return tractions;
}

namespace {

auto maker_of(MapKind kind) {
  switch (kind) {
  case MapKind::nearest:
    return nearest_map;
  case MapKind::mortar:
    return mortar_map;
  case MapKind::rbf:
    return rbf_map;
  default:
    return projection_map;
  }
}

} // namespace

Mapping make_mapping(MapKind kind, const InterfaceMesh &fluid, const InterfaceMesh &solid) {
  if (fluid.dim == 2 && solid.dim == 3)
    return extruded_map(kind, fluid, solid);
  return maker_of(kind)(fluid, solid);
}

std::string MapReport::text() const {
  return fmt::format(
      "map: {} fluid nodes on {} solid nodes, {:.1f} % of the solid nodes reached, "
      "{} fluid nodes beyond the rim, largest distance {:.3g} m (fluid node {}), row "
      "sums within {:.1g} of one, linear fields within {:.2g} m, {:.1f} % of the fluid's surface "
      "covered",
      fluid_nodes, solid_nodes, 100 * coverage(), fluid_nodes_beyond, largest_distance,
      farthest_node, row_sum_error, largest_offset, 100 * area_covered);
}

} // namespace sluice::bridge
