// SPDX-License-Identifier: MIT
// Everything that the next step depends on, as a value: a checkpoint is a copy.
#pragma once

#include <Eigen/Core>

namespace sluice::solid {

/// dim components per node, node by node, in the numbering of Discretisation. Not in it, because
/// they follow from it: the internal force and the stresses.
struct SolidState {
  Eigen::VectorXd displacement; ///< [m]
  Eigen::VectorXd velocity;     ///< [m/s]
  Eigen::VectorXd acceleration; ///< [m/s^2]
  Eigen::VectorXd modes;        ///< [m] internal modes, dim components per mode, cell by cell
  Eigen::VectorXd branch;       ///< [Pa] viscous stress [cell][point][component]; empty without
  long step = 0;                ///< steps taken since the start
  double load_work = 0;         ///< [J] done by the loads since the start (2-D: per metre)
};

} // namespace sluice::solid
