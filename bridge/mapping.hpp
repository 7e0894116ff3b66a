// SPDX-License-Identifier: MIT
// A mapping is one sparse matrix H, built once in the reference configuration. Its rows belong to
// the fluid's nodes, its columns to the solid's; it acts on each component of a field alike.
//
//   consistent     x_f = H x_s      displacement, velocity: solid -> fluid
//   conservative   F_s = H^T F_f    nodal forces:           fluid -> solid
//
// Because one is the transpose of the other, virtual work is the same on both sides:
// F_f . (H u) = (H^T F_f) . u for every u. Because every row sums to one, so is the resultant
// force. The moment in the current configuration is the same when the fluid's nodes lie on the
// solid's faces (H X_s = x_f): then x_f + H d = H (X_s + d) and sum (x_f + H d) x F = sum (X_s + d)
// x H^T F. A gap g = x_f - H X_s changes the moment by sum g x F, which the report bounds.
#pragma once

#include "bridge/map_report.hpp"

#include <Eigen/SparseCore>

#include <span>
#include <vector>

namespace sluice::bridge {

class Mapping {
public:
  using Matrix = Eigen::SparseMatrix<double, Eigen::RowMajor>;

  Mapping() = default;
  /// `matrix` acts on node values of `dim` components each.
  Mapping(int dim, Matrix matrix, MapReport report);

  /// x_f = H x_s. Sizes: dim per solid node in, dim per fluid node out.
  std::vector<double> consistent(std::span<const double> solid_values) const;
  /// F_s = H^T F_f. Sizes: dim per fluid node in, dim per solid node out.
  std::vector<double> conservative(std::span<const double> fluid_values) const;

  const Matrix &matrix() const { return matrix_; }
  const MapReport &report() const { return report_; }

private:
  int dim_ = 0;
  Matrix matrix_;
  MapReport report_;
};

} // namespace sluice::bridge
