// SPDX-License-Identifier: MIT
// How long the next step may be.
#pragma once

#include "fluid/fluid_params.hpp"
#include "fluid/points.hpp"
#include "fluid/walls.hpp"

#include <array>
#include <string_view>

namespace sluice::fluid {

/// What holds the step back.
enum class StepLimit { given, courant, gravity, growth };
inline constexpr std::array<std::string_view, 4> step_limit_names{"given", "courant", "gravity",
                                                                  "growth"};

struct LimitedStep {
  double size; // [s]
  StepLimit limit;
};

/// The smallest of
///   given    `largest` [s];
///   courant  C h / U: the fastest point or wall moves C spacings;
///   gravity  C sqrt(h / g): C of the time in which the shortest wave turns by one radian;
///   growth   1.1 times the last step, so that the extrapolated motion stays second order;
/// with C = params.courant; `largest` where C is 0. Viscosity sets no limit, it is implicit.
template <int dim>
LimitedStep limited_step(const FluidState<dim> &state, const Walls<dim> &walls,
                         const FluidParams<dim> &params, double largest);

/// The same without growth: what the motion alone allows, whatever the step before was.
template <int dim>
LimitedStep limited_by_motion(const FluidState<dim> &state, const Walls<dim> &walls,
                              const FluidParams<dim> &params, double largest);

} // namespace sluice::fluid
