// SPDX-License-Identifier: MIT
#include "bridge/mapping.hpp"

#include <fmt/format.h>

#include <cassert>

namespace sluice::bridge {

namespace {

using NodeValues = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

Eigen::Map<const NodeValues> by_node(std::span<const double> values, int dim) {
  return {values.data(), static_cast<Eigen::Index>(values.size()) / dim, dim};
}

} // namespace

Mapping::Mapping(int dim, Matrix matrix, MapReport report)
    : dim_(dim), matrix_(std::move(matrix)), report_(report) {}

std::vector<double> Mapping::consistent(std::span<const double> solid_values) const {
  assert(static_cast<Eigen::Index>(solid_values.size()) == matrix_.cols() * dim_);
  std::vector<double> result(static_cast<std::size_t>(matrix_.rows() * dim_));
  Eigen::Map<NodeValues>(result.data(), matrix_.rows(), dim_) =
      matrix_ * by_node(solid_values, dim_);
  return result;
}

std::vector<double> Mapping::conservative(std::span<const double> fluid_values) const {
  assert(static_cast<Eigen::Index>(fluid_values.size()) == matrix_.rows() * dim_);
  std::vector<double> result(static_cast<std::size_t>(matrix_.cols() * dim_));
  Eigen::Map<NodeValues>(result.data(), matrix_.cols(), dim_) =
      matrix_.transpose() * by_node(fluid_values, dim_);
  return result;
}

std::string MapReport::text() const {
  return fmt::format(
      "map: {} fluid nodes on {} solid nodes, {:.1f} % of the solid nodes reached, "
      "{} fluid nodes beyond the rim, largest distance {:.3g} m (fluid node {}), row "
      "sums within {:.1g} of one",
      fluid_nodes, solid_nodes, 100 * coverage(), fluid_nodes_beyond, largest_distance,
      farthest_node, row_sum_error);
}

} // namespace sluice::bridge
