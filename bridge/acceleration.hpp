// SPDX-License-Identifier: MIT
// The next iterate of a window from the last iterate x and what the solvers made of it, x~ =
// S(F(x)). The residual is r = x~ - x. Every accelerator is a value: a copy is its checkpoint.
#pragma once

#include "bridge/acceleration_aitken.hpp"
#include "bridge/acceleration_imvj.hpp"
#include "bridge/acceleration_iqn.hpp"
#include "bridge/settings.hpp"

#include <variant>

namespace sluice::bridge {

/// x + omega r. Converges only where omega (1 + ratio of added mass to mass) < 2.
class ConstantRelaxation {
public:
  explicit ConstantRelaxation(double relaxation) : relaxation_(relaxation) {}
  AcceleratedIterate next(const Eigen::VectorXd &iterate, const Eigen::VectorXd &solved, double) {
    return {iterate + relaxation_ * (solved - iterate), relaxation_, 0};
  }
  void finish_window(const Eigen::VectorXd &, const Eigen::VectorXd &, double) {}
  void forget_window() {}
  template <class Archive> void archive(Archive &) {} // nothing but its setting

private:
  double relaxation_;
};

using Acceleration = std::variant<ConstantRelaxation, Aitken, QuasiNewton, MultiVector>;

/// The accelerator that `settings` names.
Acceleration make_acceleration(const BridgeSettings &settings);

/// The next iterate of the current window. Changes of the residual below `resolution` [m, norm over
/// all nodes] are rounding or the solvers' noise: nothing is learnt from them.
AcceleratedIterate accelerate(Acceleration &acceleration, const Eigen::VectorXd &iterate,
                              const Eigen::VectorXd &solved, double resolution);
/// The window is accepted with its last iterate and solution: history moves on.
void finish_window(Acceleration &acceleration, const Eigen::VectorXd &iterate,
                   const Eigen::VectorXd &solved, double resolution);
/// The window is given up and starts anew.
void forget_window(Acceleration &acceleration);

} // namespace sluice::bridge
