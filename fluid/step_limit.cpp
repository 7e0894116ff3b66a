// SPDX-License-Identifier: MIT
#include "fluid/step_limit.hpp"

#include <algorithm>
#include <cmath>

namespace sluice::fluid {

namespace {

constexpr double largest_growth = 1.1;

template <int dim> double fastest(const std::vector<Vec<dim>> &velocities) {
  double speed2 = 0;
  for (const Vec<dim> &u : velocities)
    speed2 = std::max(speed2, u.squaredNorm());
  return std::sqrt(speed2);
}

} // namespace

template <int dim>
LimitedStep limited_by_motion(const FluidState<dim> &state, const Walls<dim> &walls,
                              const FluidParams<dim> &params, double largest) {
  LimitedStep step{largest, StepLimit::given};
  if (params.courant <= 0)
    return step;
  const auto hold = [&](double size, StepLimit limit) {
    if (size < step.size)
      step = {size, limit};
  };
  const double speed = std::max(fastest(state.points.velocity), fastest(walls.velocity));
  if (speed > 0)
    hold(params.courant * params.spacing / speed, StepLimit::courant);
  if (const double g = params.gravity.norm(); g > 0)
    hold(params.courant * std::sqrt(params.spacing / g), StepLimit::gravity);
  return step;
}

template <int dim>
LimitedStep limited_step(const FluidState<dim> &state, const Walls<dim> &walls,
                         const FluidParams<dim> &params, double largest) {
  const LimitedStep step = limited_by_motion(state, walls, params, largest);
  const double grown = largest_growth * state.step_size;
  if (params.courant > 0 && state.step_size > 0 && grown < step.size)
    return {grown, StepLimit::growth};
  return step;
}

template LimitedStep limited_by_motion(const FluidState<2> &, const Walls<2> &,
                                       const FluidParams<2> &, double);
template LimitedStep limited_by_motion(const FluidState<3> &, const Walls<3> &,
                                       const FluidParams<3> &, double);
template LimitedStep limited_step(const FluidState<2> &, const Walls<2> &, const FluidParams<2> &,
                                  double);
template LimitedStep limited_step(const FluidState<3> &, const Walls<3> &, const FluidParams<3> &,
                                  double);

} // namespace sluice::fluid
