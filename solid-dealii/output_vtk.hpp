// SPDX-License-Identifier: MIT
// Fields for ParaView: one VTU file per sample in the deformed configuration, and solid.pvd.
#pragma once

#include "solid-dealii/discretisation.hpp"

#include <filesystem>
#include <memory>
#include <vector>

namespace sluice::solid {

/// What one file holds. Nodal fields have dim components per node, cell fields one value per cell.
struct OutputFields {
  const Eigen::VectorXd &displacement; ///< [m]
  const Eigen::VectorXd &velocity;     ///< [m/s]
  const Eigen::VectorXd &pressure;     ///< [Pa] mean Cauchy pressure of a cell
  const Eigen::VectorXd &von_mises;    ///< [Pa] of the mean Cauchy stress of a cell
  const Eigen::MatrixXd &stress;       ///< [Pa] that stress, rows xx yy zz xy xz yz
  const Eigen::VectorXd &energy;       ///< [J] strain energy of a cell
};

template <int dim> class OutputVtk {
public:
  /// Writes into `folder`, which must exist.
  OutputVtk(const Discretisation<dim> &discretisation, std::filesystem::path folder);
  ~OutputVtk();
  OutputVtk(const OutputVtk &) = delete;
  OutputVtk &operator=(const OutputVtk &) = delete;

  /// Writes solid_NNNN.vtu for `time` [s] and renews solid.pvd, so that a run which is cut short
  /// leaves a readable series. On several ranks each writes a part, which solid_NNNN.pvtu joins.
  void write(double time, const OutputFields &fields);

private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

} // namespace sluice::solid
