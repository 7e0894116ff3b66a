// SPDX-License-Identifier: MIT
#include "fluid/step.hpp"

#include "bridge/base/check.hpp"
#include "fluid/parallel.hpp"
#include "fluid/point_noise.hpp"
#include "fluid/surface_stress.hpp"

#include <algorithm>
#include <array>
#include <cmath>

namespace sluice::fluid {

template <int dim>
FluidSolver<dim>::FluidSolver(const Scene<dim> &scene)
    : state(scene.initial), walls(scene.walls), params_(scene.params) {
  pressure_params_.density = params_.density;
  if (params_.pressure_rows == "renormalised")
    pressure_params_.operators = PressureOperators::renormalised;
  pressure_params_.row_guard = params_.row_guard;
  pressure_params_.gradient_guard = params_.gradient_guard;
  if (!params_.rheology.is_newtonian()) // a hundredth of what ends the passes over the law
    viscous_.relative_tolerance = 0.01 * params_.rheology.params().picard_tolerance;
  cloud_.has_air = params_.free_surface;
  cloud_.remembers_cells = params_.remember_cells;
  nodal_forces_.assign(walls.position.size(), Vec<dim>::Zero());
}

template <int dim> void FluidSolver<dim>::begin_step(double dt) {
  dt_ = dt;
  report_ = {};
  pace_ = pace_of(state.points, params_.gravity.norm(), params_.spacing);
  report_.energy.correction = energy_of_shift();
  timer("move", [&] {
    const bool knows_change = params_.time_order == 2 && state.step_size > 0;
    move_points(state.points, dt, knows_change ? 0.5 * dt / state.step_size : 0);
  });
  freeze_cloud();
  timer("operators", [&] {
    assemble_pressure_operators(state.points, cloud_, pressure_params_, problem_);
    report_.rows = problem_.rows;
  });
  find_first_pressure();
  timer("viscosity", [&] { predict_velocity(); });
  assemble();
}

// Where viscosity has to know the last pressure there is none in the first step: without it a stiff
// fluid at rest gets the whole weight of a step, and what the projection leaves of that.
template <int dim> void FluidSolver<dim>::find_first_pressure() {
  if (state.step > 0 || !viscosity_knows_pressure())
    return;
  constexpr int passes = 2; // more do not settle: each differentiates the last pressure anew
  Points<dim> &points = state.points;
  for (int k = 0; k < passes; ++k) {
    timer("viscosity", [&] { predict_velocity(); });
    assemble();
    solve_pressure();
    pressure_gradients(points, cloud_, problem_, points.pressure, points.pressure_gradient);
  }
}

template <int dim> void FluidSolver<dim>::solve_pressure() {
  Points<dim> &points = state.points;
  set_wall_velocity(walls, cloud_, pressure_params_, projection_dt_, problem_);
  const SolveResult result = timer("pressure solve", [&] {
    SolveOptions options;
    options.relative_tolerance = params_.pressure_tolerance * std::max(carried_.new_share, 1e-6);
    options.null_space = problem_.has_open_point ? NullSpace::none : NullSpace::constants;
    return bicgstab(scaled_, problem_.source, points.pressure, multigrid_, options, memory_);
  });
  if (!result.converged)
    throw UserError(
        fmt::format("step {}: the pressure solve stopped after {} iterations at a residual "
                    "of {:.2e} Pa; reduce the time step",
                    state.step + 1, result.iterations, result.residual));
  report_.pressure_iterations += result.iterations;
  ++report_.pressure_solves;
}

template <int dim> void FluidSolver<dim>::iterate() {
  solve_pressure();
  timer("loads", [&] {
    evaluate_tractions(state.points, walls, cloud_, problem_, state.points.pressure, viscosity(),
                       quadrature_, tractions_);
    integrate_nodal_forces(walls, quadrature_, tractions_, nodal_forces_);
  });
}

template <int dim> void FluidSolver<dim>::end_step() {
  Points<dim> &points = state.points;
  timer("project", [&] {
    const double factor = projection_dt_ / params_.density;
    pressure_gradients(points, cloud_, problem_, points.pressure, points.pressure_gradient);
    for_each_point(points.size(), [&](int i) {
      points.previous_velocity[i] = points.velocity[i];
      points.velocity[i] = predicted_[i] - factor * points.pressure_gradient[i];
    });
    if (carried_.exists()) {
      for_each_point(points.size(), [&](int i) { points.velocity[i] -= carried_.velocity[i]; });
      settle_pressure(cloud_, carried_, points);
    }
    damp_point_noise(points, cloud_, predicted_, problem_.velocity_gradient,
                     params_.noise_damping * pace_.points, dt_, points.velocity);
    measure_work();
    plan_shift(points, cloud_, params_.motion, problem_.velocity_gradient, dt_);
  });
  ++state.step;
  state.step_size = dt_;
}

namespace {

// Water may leave the scene upwards, and fall back.
template <int dim>
bool is_outside(const Vec<dim> &x, const Vec<dim> &low, const Vec<dim> &high, double margin) {
  for (int d = 0; d < dim; ++d)
    if (x[d] < low[d] - margin || (d != 1 && x[d] > high[d] + margin))
      return true;
  return false;
}

template <int dim> void remove_points(Points<dim> &points, const std::vector<char> &leaves) {
  const auto compact = [&](const char *, auto &values) {
    std::size_t n = 0;
    for (std::size_t i = 0; i < values.size(); ++i)
      if (!leaves[i])
        values[n++] = values[i];
    values.resize(n);
  };
  for_each_array(points, compact);
}

} // namespace

template <int dim> double FluidSolver<dim>::mass_of_point() const {
  double mass = params_.density;
  for (int d = 0; d < dim; ++d)
    mass *= params_.spacing;
  return mass;
}

template <int dim>
double FluidSolver<dim>::energy_of_point(const Vec<dim> &u, const Vec<dim> &x) const {
  return mass_of_point() * (0.5 * u.squaredNorm() - params_.gravity.dot(x));
}

template <int dim> double FluidSolver<dim>::energy() const {
  const Points<dim> &points = state.points;
  return sum(points.size(),
             [&](int i) { return energy_of_point(points.velocity[i], points.position[i]); });
}

template <int dim> double FluidSolver<dim>::energy_of_shift() const {
  const Points<dim> &points = state.points;
  return sum(points.size(), [&](int i) {
    const Vec<dim> &u = points.velocity[i], &x = points.position[i];
    return energy_of_point(u + points.shift_velocity[i], x + points.shift[i]) -
           energy_of_point(u, x);
  });
}

template <int dim> void FluidSolver<dim>::measure_work() {
  const Points<dim> &points = state.points;
  const double factor = projection_dt_ / params_.density;
  const auto work = block_sums<2>(points.size(), [&](IndexRange range) {
    std::array<double, 2> part{};
    for (int i = range.begin; i < range.end; ++i) {
      const Vec<dim> mean = 0.5 * (points.previous_velocity[i] + points.velocity[i]);
      const Vec<dim> by_pressure = -factor * points.pressure_gradient[i];
      Vec<dim> projected = predicted_[i] + by_pressure;
      if (carried_.exists())
        projected -= carried_.velocity[i];
      part[0] += by_pressure.dot(mean);
      part[1] += (points.velocity[i] - projected).dot(mean);
    }
    return part;
  });
  report_.energy.projection = mass_of_point() * work[0];
  report_.energy.damping = mass_of_point() * work[1];
}

template <int dim> void FluidSolver<dim>::leave_through_outlet() {
  Points<dim> &points = state.points;
  Vec<dim> low = walls.position.front(), high = low;
  for (const Vec<dim> &x : walls.position) {
    low = low.cwiseMin(x);
    high = high.cwiseMax(x);
  }
  leaves_.assign(points.size(), 0);
  bool any = false;
  for (int i = 0; i < points.size(); ++i) {
    const Vec<dim> &x = points.position[i];
    const bool is_out = x.x() > params_.outlet_x;
    const bool is_lost = !is_out && is_outside(x, low, high, params_.spacing);
    state.outflow_points += is_out;
    state.lost_points += is_lost;
    leaves_[i] = is_out || is_lost;
    if (leaves_[i]) {
      state.outlet_energy += energy_of_point(points.velocity[i], x);
      state.outlet_momentum += mass_of_point() * points.velocity[i];
    }
    any = any || leaves_[i] != 0;
  }
  if (any)
    remove_points(points, leaves_);
  check(points.size() > 0,
        "step {}: no water is left in the scene ({} points left through the outlet, {} were lost); "
        "end the run earlier",
        state.step + 1, state.outflow_points, state.lost_points);
}

template <int dim> void FluidSolver<dim>::freeze_cloud() {
  Points<dim> &points = state.points;
  timer("walls", [&] {
    cloud_.spacing = params_.spacing;
    leave_through_outlet();
    update_walls(points, walls, params_.spacing, cloud_);
    const double before = energy();
    const ContactCounts<dim> contacts = keep_clear_of_walls(points, walls, params_.motion, cloud_);
    report_.energy.correction += energy() - before;
    state.wall_returns += contacts.put_back;
    report_.contact_impulse = mass_of_point() * contacts.velocity_change;
    if (contacts.moved > 0)
      update_walls(points, walls, params_.spacing, cloud_);
  });
  timer("search", [&] { update_neighbours(points, walls, cloud_); });
  timer("cells", [&] { update_cells(points, cloud_); });
  report_.cells_cut = cloud_.cells_cut;
}

// The velocity from which the step's forces act over projection_dt_: that of the last step, or of
// the last two by backward differences of second order (steps of unequal length: ratio r).
template <int dim> void FluidSolver<dim>::extrapolate_velocity() {
  const Points<dim> &points = state.points;
  constexpr double largest_ratio = 2; // of steps: backward differences are stable to 2.4
  const bool is_second_order =
      params_.time_order == 2 && state.step > 0 && dt_ <= largest_ratio * state.step_size;
  const double r = is_second_order ? dt_ / state.step_size : 0;
  const double now = (1 + r) * (1 + r) / (1 + 2 * r), before = r * r / (1 + 2 * r);
  projection_dt_ = dt_ * (1 + r) / (1 + 2 * r);
  predicted_.resize(points.size());
  expected_.resize(points.size());
  for_each_point(points.size(), [&](int i) {
    const Vec<dim> &u = points.velocity[i], &old = points.previous_velocity[i];
    predicted_[i] = now * u - before * old;
    expected_[i] = u + r * (u - old);
  });
}

template <int dim> bool FluidSolver<dim>::viscosity_knows_pressure() const {
  return !params_.rheology.is_inviscid() && !viscosity_is_negligible() &&
         (params_.time_order == 2 ||
          !is_explicit(params_.rheology, params_.density, dt_, params_.spacing));
}

// Velocity that gravity and the last pressure add in the step: what viscosity has to know, so that
// water at rest stays so and a surface point does not fall freely before it is held. In a step of
// first order without stiffness it makes a difference of second order, and is left out.
template <int dim> void FluidSolver<dim>::push_by_known_forces() {
  const Points<dim> &points = state.points;
  push_.assign(points.size(), Vec<dim>::Zero());
  if (!viscosity_knows_pressure())
    return;
  carried_pressure_gradients(points, cloud_, problem_, push_);
  for_each_point(points.size(), [&](int i) {
    push_[i] = projection_dt_ * (params_.gravity - push_[i] / params_.density);
    predicted_[i] += push_[i];
  });
}

// A wave of L spacings would lose (2 pi / L)^2 times this number in the step.
template <int dim> bool FluidSolver<dim>::viscosity_is_negligible() const {
  return !params_.rheology.is_inviscid() &&
         viscous_number(params_.rheology, params_.density, dt_, params_.spacing) <
             params_.negligible_viscosity;
}

template <int dim> bool FluidSolver<dim>::keeps_stiff_pressure() const {
  return params_.stiff_pressure == "kept" ||
         (params_.stiff_pressure == "auto" && !params_.free_surface);
}

// Gravity and pressure act by the projection, as far as a stiff point does not keep them.
template <int dim> void FluidSolver<dim>::take_back_push() {
  const int n = state.points.size();
  for_each_point(n, [&](int i) { predicted_[i] -= push_[i]; });
  if (!keeps_stiff_pressure() ||
      is_explicit(params_.rheology, params_.density, projection_dt_, params_.spacing))
    return;
  for_each_point(n, [&](int i) { push_[i] -= projection_dt_ * params_.gravity; });
  share_pressure(viscosity(), cloud_, projection_dt_ / params_.density, push_, carried_);
  for_each_point(n, [&](int i) { predicted_[i] += carried_.velocity[i]; });
}

template <int dim> void FluidSolver<dim>::predict_velocity() {
  Points<dim> &points = state.points;
  carried_.clear();
  extrapolate_velocity();
  report_.viscosity_skipped = viscosity_is_negligible();
  if (report_.viscosity_skipped) // for the shear on walls
    params_.rheology.with_law(
        [&](const auto &law) { viscous_.viscosity.assign(points.size(), law(0)); });
  if (!params_.rheology.is_inviscid() && !report_.viscosity_skipped) {
    push_by_known_forces();
    build_viscous_rows(points, cloud_, params_.rheology, problem_, viscous_.rows);
    const ViscousResult result =
        diffuse_velocity(points, walls, cloud_, params_.rheology, params_.density, projection_dt_,
                         expected_, predicted_, viscous_);
    update_surface_pressure(cloud_, viscosity(), predicted_, projection_dt_ / params_.density,
                            points, surface_);
    report_.viscous_iterations = result.iterations;
    report_.viscous_passes = result.passes;
    report_.viscous_rows = viscous_.rows.count;
    take_back_push();
  } else {
    points.surface_pressure.assign(points.size(), 0); // it may come from a run with viscosity
  }
  for_each_point(points.size(), [&](int i) { predicted_[i] += projection_dt_ * params_.gravity; });
}

namespace {

// Where release_tension does not look at the points: one that was at the surface and is not any
// more is judged like any other from now on.
template <int dim> void forget_enclosed_surfaces(const Cloud<dim> &cloud, Points<dim> &points) {
  for_each_point(points.size(), [&](int i) {
    if (cloud.kind[i] == PointKind::interior)
      points.at_surface[i] = SurfaceMemory::enclosed;
  });
}

} // namespace

template <int dim> void FluidSolver<dim>::assemble() {
  Points<dim> &points = state.points;
  timer("operators", [&] {
    target_divergence_.resize(points.size());
    volume_restoring_divergence(points, cloud_, params_.motion, pace_.volume, cell_average_,
                                target_divergence_);
    assemble_pressure_source(points, cloud_, pressure_params_, predicted_, target_divergence_,
                             projection_dt_, problem_);
    if (carried_.exists())
      add_carried_pressure(points, cloud_, viscosity(), target_divergence_, carried_, problem_);
    if (params_.holds_tension)
      forget_enclosed_surfaces(cloud_, points);
    else if (state.step > 0) // in the first step there is no pressure of a flow to judge by
      report_.released = release_tension(points, walls, pressure_params_, predicted_,
                                         target_divergence_, projection_dt_, cloud_, problem_);
  });
  timer("pressure set-up", [&] {
    cells_.resize(points.size());
    for_each_point(points.size(), [&](int i) {
      const Vec<dim> c = (points.position[i] - cloud_.grid.origin) / (2 * cloud_.spacing);
      cells_[i] = {};
      for (int d = 0; d < dim; ++d)
        cells_[i][d] = static_cast<int>(c[d]);
    });
    scaled_.build(problem_.matrix);
    multigrid_.build(scaled_, cells_);
  });
  timer("loads",
        [&] { build_wall_quadrature(points, walls, cloud_, WallPart::coupled, quadrature_); });
}

template class FluidSolver<2>;
template class FluidSolver<3>;

} // namespace sluice::fluid
