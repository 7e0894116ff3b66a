// SPDX-License-Identifier: MIT
// Damping of the material: Rayleigh's two terms and one Maxwell branch, as a stress beside the
// law's.
//
//   S = S_e + stiffness_time dS_e/dt + Q,      dQ/dt + Q/branch_time = branch_ratio dS_e/dt
//   M a + mass_rate M v + f_int(S) = load
//
// S_e is the second Piola-Kirchhoff stress of the law (of its distortion when the law is split: the
// volume stays elastic), so that a rotation damps nothing. The stiffness-proportional term is the
// Kelvin-Voigt model. Over a step S_e varies linearly: Q then has the closed form
//   Q1 = a Q0 + b (S1 - S0),   a = exp(-x), b = branch_ratio (1 - a)/x,  x = dt/branch_time,
// and the rate is (S1 - S0)/dt, taken for the whole step as the load is (time_integrator.hpp).
// Both are `factor` S_e(u1) + h with h known from the start of the step.
// Source: J. C. Simo, Comput. Methods Appl. Mech. Engrg. 60 (1987) 153 (one branch, sec. 3).
#pragma once

#include "solid-dealii/material.hpp"

#include <cmath>

namespace sluice::solid {

/// The entries of a vector.
inline std::span<const double> numbers(const Eigen::VectorXd &v) {
  return {v.data(), static_cast<std::size_t>(v.size())};
}

struct Viscosity {
  double mass_rate = 0;      ///< [1/s] Rayleigh's damping by mass
  double stiffness_time = 0; ///< [s] Kelvin-Voigt; Rayleigh's damping by stiffness
  double branch_ratio = 0;   ///< stiffness of the branch over that of the law
  double branch_time = 1;    ///< [s] relaxation time of the branch

  bool has_stress() const { return stiffness_time > 0 || branch_ratio > 0; }
  bool has_branch() const { return branch_ratio > 0; }
  /// What is left of the branch's stress after `dt` [s] without strain.
  double decay(double dt) const { return std::exp(-dt / branch_time); }
  /// The branch's answer to a linear change of the law's stress over `dt`.
  double response(double dt) const {
    return -branch_ratio * std::expm1(-dt / branch_time) * branch_time / dt;
  }
};

/// Overstress of a step for the equation of its end, where it counts with the weight
/// `weight_of_end`: the branch is weighted like the elastic stress, the rate is not. Stresses are
/// [Pa], [point][component].
class StepOverstress {
public:
  /// `relaxing` of the law at the start; `branch` then, empty when there is none.
  StepOverstress(const Viscosity &viscosity, Eigen::VectorXd relaxing, Eigen::VectorXd branch,
                 double dt, double weight_of_end)
      : decay_(viscosity.decay(dt)), response_(viscosity.response(dt)),
        factor_(response_ + viscosity.stiffness_time / (dt * weight_of_end)),
        relaxing_(std::move(relaxing)), branch_(std::move(branch)), known_(-factor_ * relaxing_) {
    if (branch_.size() > 0)
      known_ += decay_ * branch_;
  }

  /// Of the branch alone at the start of the step.
  template <int dim> Overstress<dim> at_start() const { return {0, numbers(branch_)}; }
  /// As a function of the end's deformation.
  template <int dim> Overstress<dim> at_end() const { return {factor_, numbers(known_)}; }
  /// Stress of the branch at the end, from what relaxes there.
  Eigen::VectorXd branch_at_end(const Eigen::VectorXd &relaxing) const {
    if (branch_.size() == 0)
      return {};
    return decay_ * branch_ + response_ * (relaxing - relaxing_);
  }

private:
  double decay_, response_, factor_;
  Eigen::VectorXd relaxing_, branch_, known_;
};

} // namespace sluice::solid
