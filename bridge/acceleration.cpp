// SPDX-License-Identifier: MIT
#include "bridge/acceleration.hpp"

namespace sluice::bridge {

Acceleration make_acceleration(const BridgeSettings &settings) {
  if (settings.acceleration == "constant")
    return ConstantRelaxation(settings.initial_relaxation);
  if (settings.acceleration == "aitken")
    return Aitken(settings.initial_relaxation);
  if (settings.acceleration == "iqn-imvj")
    return MultiVector(settings.initial_relaxation, settings.windows_reused, settings.filter);
  return QuasiNewton(settings.initial_relaxation, settings.windows_reused, settings.filter);
}

AcceleratedIterate accelerate(Acceleration &acceleration, const Eigen::VectorXd &iterate,
                              const Eigen::VectorXd &solved, double resolution) {
  return std::visit([&](auto &chosen) { return chosen.next(iterate, solved, resolution); },
                    acceleration);
}

void finish_window(Acceleration &acceleration, const Eigen::VectorXd &iterate,
                   const Eigen::VectorXd &solved, double resolution) {
  std::visit([&](auto &chosen) { chosen.finish_window(iterate, solved, resolution); },
             acceleration);
}

void forget_window(Acceleration &acceleration) {
  std::visit([](auto &chosen) { chosen.forget_window(); }, acceleration);
}

} // namespace sluice::bridge
