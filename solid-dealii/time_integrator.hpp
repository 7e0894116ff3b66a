// SPDX-License-Identifier: MIT
// Generalised-alpha: second order, with one number for the damping of unresolved frequencies.
//
//   M [(1 - am) a1 + am a0] + (1 - af) f_int(u1) + af f_int(u0) = load
//   u1 = u0 + dt v0 + dt^2 [(1/2 - b) a0 + b a1],   v1 = v0 + dt [(1 - g) a0 + g a1]
//
// The load is the mean over the step and stands as it is at the alpha level: weighting the loads of
// two steps would double the noise of a coupled load (measured on the elastic gate).
// Source: J. Chung, G. M. Hulbert, J. Appl. Mech. 60 (1993) 371-375, eqs. 14, 15, 17, 25; internal
// forces weighted, not evaluated at a weighted state, as in S. Erlicher, L. Bonaventura,
// O. S. Bursi, Comput. Mech. 28 (2002) 83-104.
#pragma once

#include "solid-dealii/newton.hpp"
#include "solid-dealii/solid_state.hpp"

namespace sluice::solid {

class GeneralisedAlpha {
public:
  /// `spectral_radius` at infinite frequency: 1 damps nothing, 0 annihilates in one step.
  explicit GeneralisedAlpha(double spectral_radius)
      : alpha_m((2 * spectral_radius - 1) / (spectral_radius + 1)),
        alpha_f(spectral_radius / (spectral_radius + 1)), gamma(0.5 - alpha_m + alpha_f),
        beta(0.25 * (1 - alpha_m + alpha_f) * (1 - alpha_m + alpha_f)) {
    check(spectral_radius >= 0 && spectral_radius <= 1,
          "solid: spectral radius is {}; it must lie between 0 and 1", spectral_radius);
  }

  /// Displacement [m] of constant acceleration.
  static Eigen::VectorXd predict(const SolidState &s, double dt) {
    return s.displacement + dt * s.velocity + 0.5 * dt * dt * s.acceleration;
  }

  /// The step as an equation for u1. `internal_force` is f_int(u0) [N]; `mass_rate` [1/s] adds
  /// mass_rate M [(1 - af) v1 + af v0], in which v1 is linear in u1.
  Equation equation(const SolidState &s, const Eigen::VectorXd &internal_force,
                    const Eigen::VectorXd &load, double dt, double mass_rate = 0) const {
    const double inertia = (1 - alpha_m) / (beta * dt * dt);
    const double damping = mass_rate * (1 - alpha_f) * gamma / (beta * dt);
    const Eigen::VectorXd coasting = s.velocity + dt * (1 - gamma) * s.acceleration; // v1 - g dt a1
    const Eigen::VectorXd reference =
        unaccelerated(s, dt) -
        (alpha_m * s.acceleration + mass_rate * ((1 - alpha_f) * coasting + alpha_f * s.velocity)) /
            (inertia + damping);
    return {1 - alpha_f, inertia + damping, reference, load - alpha_f * internal_force};
  }

  /// The state at the end of the step from its displacement and modes.
  SolidState finish(const SolidState &s, const Iterate &end, double dt) const {
    SolidState next = s;
    next.displacement = end.displacement;
    next.modes = end.modes;
    next.acceleration = (end.displacement - unaccelerated(s, dt)) / (beta * dt * dt);
    next.velocity += dt * ((1 - gamma) * s.acceleration + gamma * next.acceleration);
    ++next.step;
    return next;
  }

  double alpha_m, alpha_f, gamma, beta;

private:
  // u1 where a1 = 0.
  Eigen::VectorXd unaccelerated(const SolidState &s, double dt) const {
    return s.displacement + dt * s.velocity + dt * dt * (0.5 - beta) * s.acceleration;
  }
};

} // namespace sluice::solid
