// SPDX-License-Identifier: MIT
// A mapping is one sparse matrix H, built once in the reference configuration. Its rows belong to
// the fluid's nodes, its columns to the solid's; it acts on each component of a field alike.
//
//   consistent     x_f = H x_s      displacement, velocity: solid -> fluid
//   conservative   F_s = H^T F_f    nodal forces:           fluid -> solid
//   traction       t_s = A_s^-1 H^T A_f t_f   nodal tractions, with the areas of the nodes
//
// Because one is the transpose of the other, virtual work is the same on both sides:
// F_f . (H u) = (H^T F_f) . u for every u. Because every row sums to one, so is the resultant
// force. The moment in the current configuration is the same when the fluid's nodes lie on the
// solid's faces (H X_s = x_f): then x_f + H d = H (X_s + d) and sum (x_f + H d) x F = sum (X_s + d)
// x H^T F. A gap g = x_f - H X_s changes the moment by sum g x F, which the report bounds.
//
// How H is made: mapping_nearest, mapping_projection, mapping_rbf, mapping_mortar; for a plane
// fluid and a solid in space mapping_extruded. make_mapping chooses.
#pragma once

#include "bridge/interface_mesh.hpp"
#include "bridge/map_report.hpp"

#include <Eigen/SparseCore>

#include <span>
#include <vector>

namespace sluice::bridge {

class Mapping {
public:
  using Matrix = Eigen::SparseMatrix<double, Eigen::RowMajor>;

  Mapping() = default;
  /// Completes `report` by what can be seen from the matrix.
  Mapping(const InterfaceMesh &fluid, const InterfaceMesh &solid, Matrix matrix, MapReport report,
          double depth = 1);

  /// x_f = H x_s. Sizes: the solid's dim per solid node in, the fluid's dim per fluid node out.
  std::vector<double> consistent(std::span<const double> solid_values) const;
  /// F_s = H^T F_f; forces per metre of a plane fluid times depth() on a solid in space. Sizes: the
  /// fluid's dim per fluid node in, the solid's dim per solid node out.
  std::vector<double> conservative(std::span<const double> fluid_values) const;
  /// The same into memory that is there already.
  void consistent(std::span<const double> solid_values, std::span<double> fluid_values) const;
  void conservative(std::span<const double> fluid_values, std::span<double> solid_values) const;
  /// Tractions [Pa] at the fluid's nodes to tractions at the solid's with the same resultant.
  std::vector<double> traction(std::span<const double> fluid_values) const;

  /// True where each node meets the same node of the other side, so that values pass as they are.
  bool is_identity() const { return is_identity_; }
  /// [m] of the solid along z where only the fluid is plane; else 1.
  double depth() const { return depth_; }
  const Matrix &matrix() const { return matrix_; }
  const MapReport &report() const { return report_; }

private:
  int fluid_dim_ = 0, solid_dim_ = 0;
  double depth_ = 1; // [m]
  Matrix matrix_;
  Matrix transpose_;                              // kept: its rows are read in order
  std::vector<double> fluid_areas_, solid_areas_; // of the nodes
  MapReport report_;
  bool is_identity_ = false;
};

enum class MapKind { nearest, projection, mortar, rbf };

/// The map of that kind; extruded when the fluid is plane and the solid is not. Throws UserError
/// when the meshes do not fit together, naming the first fluid node that is too far away.
Mapping make_mapping(MapKind kind, const InterfaceMesh &fluid, const InterfaceMesh &solid);

} // namespace sluice::bridge
