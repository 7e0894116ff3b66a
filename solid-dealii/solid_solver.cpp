// SPDX-License-Identifier: MIT
#include "solid-dealii/solid_solver.hpp"

#include "bridge/base/timer.hpp"

#include <Eigen/Eigenvalues>

#include <algorithm>
#include <numbers>
#include <optional>

namespace sluice::solid {
namespace {

template <int dim> Box<dim> box_of(const SolidParams &p) {
  if constexpr (dim == 2)
    return {p.corner, {p.width, p.height}, {p.elements_across, p.elements_along}, {}};
  else
    return {{p.corner.x(), p.corner.y(), 0},
            {p.width, p.height, p.used_depth()},
            {p.elements_across, p.elements_along, p.elements_deep},
            {}};
}

template <int dim> Discretisation<dim> discretise(const SolidParams &p, const Ranks &ranks) {
  const ElementKind kind = element_kind(p.used_element());
  return p.mesh.empty() ? discretise(box_of<dim>(p), kind, ranks)
                        : discretise<dim>(read_mesh(p.mesh, dim), kind, ranks);
}

Material material_of(const SolidParams &p) {
  return make_material(p.material, p.constants(),
                       p.plane == "stress" ? Plane::stress : Plane::strain);
}

} // namespace

Side side_named(std::string_view name) {
  if (name == "left")
    return Side::left;
  if (name == "right")
    return Side::right;
  check(name == "lower" || name == "upper",
        "solid: unknown side '{}'; give left, right, lower or upper", name);
  return name == "lower" ? Side::lower : Side::upper;
}

Side opposite(Side side) { return static_cast<Side>(static_cast<int>(side) ^ 1); }

template <int dim>
SolidSolver<dim>::SolidSolver(const SolidParams &params, const Ranks &ranks)
    : params_(params), discretisation_(discretise<dim>(params, ranks)),
      supports_(supports_of(discretisation_, params)),
      own_load_(sluice::solid::own_load(discretisation_, params)),
      assembly_(discretisation_, material_of(params), params.density, supports_.fixed),
      newton_(assembly_,
              {params.newton_tolerance, params.newton_max_iterations, params.tangent_reuse},
              linear_solver()),
      integrator_(params.spectral_radius) {}

template <int dim> LinearSolverKind SolidSolver<dim>::linear_solver() const {
  const auto kind = linear_solver_kind(params_.linear_solver);
  if (discretisation_.ranks.is_one())
    return kind;
  check(kind != LinearSolverKind::direct,
        "solid: linear_solver = \"direct\" works on one rank, not on {}; take cg",
        discretisation_.ranks.size());
  return LinearSolverKind::cg;
}

template <int dim> SolidState SolidSolver<dim>::initial_state() const {
  const auto &d = discretisation_;
  const Eigen::VectorXd zero = Eigen::VectorXd::Zero(d.n_dofs());
  SolidState state{zero, zero, zero, Eigen::VectorXd::Zero(d.n_modes()), {}};
  if (params_.viscosity.has_branch())
    state.branch.setZero(voigt_size<dim> * static_cast<Eigen::Index>(d.weights.size()));
  return state;
}

template <int dim>
NewtonReport SolidSolver<dim>::solve(const Equation &equation, Iterate &iterate,
                                     const Overstress<dim> &overstress) {
  const NewtonReport report = newton_.solve(equation, iterate, overstress);
  counts_.iterations += report.iterations;
  counts_.factorisations += report.factorisations;
  counts_.linear_iterations += report.linear_iterations;
  if (report.has_converged) {
    ++counts_.solves;
    counts_.iterations_max = std::max(counts_.iterations_max, report.iterations);
  } else
    ++counts_.rejected_starts;
  return report;
}

template <int dim>
SolidState SolidSolver<dim>::step(const SolidState &start, const Eigen::VectorXd &load, double dt,
                                  const SolidState *guess) {
  check(discretisation_.ranks.min(load.allFinite() ? 1 : 0) > 0,
        "solid: a nodal force is not finite in step {}", start.step + 1);
  const Stopwatch watch;
  const double cpu_start = process_cpu_time();
  const Viscosity &viscosity = params_.viscosity;
  const Eigen::VectorXd total = load + own_load_;
  std::optional<StepOverstress> viscous;
  if (viscosity.has_stress())
    viscous.emplace(viscosity, assembly_.relaxing_stresses(start.displacement, start.modes),
                    start.branch, dt, 1 - integrator_.alpha_f);
  const Equation equation = integrator_.equation(
      start,
      assembly_.internal_force(start.displacement, start.modes,
                               viscous ? viscous->at_start<dim>() : Overstress<dim>{}),
      total, dt, viscosity.mass_rate);
  // The constant-acceleration predictor can invert an element where the load is rough; the
  // displacement of the last step cannot.
  std::vector<Iterate> starts;
  if (guess)
    starts.push_back({guess->displacement, guess->modes});
  starts.push_back({GeneralisedAlpha::predict(start, dt), start.modes});
  starts.push_back({start.displacement, start.modes});
  NewtonReport report;
  for (Iterate &iterate : starts) {
    report = solve(equation, iterate, viscous ? viscous->at_end<dim>() : Overstress<dim>{});
    if (!report.has_converged)
      continue;
    SolidState end = integrator_.finish(start, iterate, dt);
    end.load_work += discretisation_.components.dot(total, end.displacement - start.displacement);
    if (viscous)
      end.branch = viscous->branch_at_end(assembly_.relaxing_stresses(end.displacement, end.modes));
    counts_.seconds += watch.seconds();
    counts_.cpu_seconds += process_cpu_time() - cpu_start;
    return end;
  }
  throw NoSolution(fmt::format(
      "solid: step {} of {:.3g} s has no solution: {}; the largest nodal force is {:.3g} N. "
      "Take a smaller case.time_step_s, or look at the loads",
      start.step + 1, dt, report.failure, discretisation_.ranks.max(load.cwiseAbs().maxCoeff())));
}

template <int dim>
SolidState SolidSolver<dim>::advance(const SolidState &start, const Eigen::VectorXd &load,
                                     double window, const SolidState *guess) {
  SolidState state = start;
  const int n = params_.steps_per_window;
  for (int k = 0; k < n; ++k) // a guess is one for the end of the window
    state =
        advance_halving(state, load, window / n, n == 1 ? guess : nullptr, params_.max_step_cuts);
  return state;
}

template <int dim>
SolidState SolidSolver<dim>::advance_halving(const SolidState &start, const Eigen::VectorXd &load,
                                             double dt, const SolidState *guess, int cuts_left) {
  try {
    return step(start, load, dt, guess);
  } catch (const NoSolution &) {
    if (cuts_left == 0)
      throw;
  }
  ++counts_.cut_steps;
  const SolidState middle = advance_halving(start, load, 0.5 * dt, nullptr, cuts_left - 1);
  return advance_halving(middle, load, 0.5 * dt, nullptr, cuts_left - 1);
}

// From equilibrium under no load to equilibrium under all of it; parts are halved and doubled.
template <int dim>
void SolidSolver<dim>::raise_load(const Eigen::VectorXd &load, Iterate &iterate) {
  double reached = 0, part = 1;
  while (reached < 1) {
    const double target = std::min(1.0, reached + part);
    Iterate trial = iterate;
    const NewtonReport report = solve({1, 0, {}, target * load}, trial);
    if (report.has_converged) {
      iterate = std::move(trial);
      reached = target;
      part *= 2;
    } else {
      part /= 2;
      if (part <= 1e-4)
        throw NoSolution(fmt::format(
            "solid: no equilibrium beyond {:.4g} of the load (largest nodal force {:.3g} N): {}",
            reached, discretisation_.ranks.max(load.cwiseAbs().maxCoeff()), report.failure));
    }
  }
}

template <int dim> SolidState SolidSolver<dim>::solve_static(const Eigen::VectorXd &load) {
  SolidState state = initial_state();
  Iterate iterate{state.displacement, state.modes};
  raise_load(load + own_load_, iterate);
  state.displacement = iterate.displacement;
  state.modes = iterate.modes;
  return state;
}

// The load follows by repeated solution under the load of the last shape, which needs no load
// stiffness; the part of it that is left out makes the convergence linear.
template <int dim>
SolidState SolidSolver<dim>::solve_static_follower(
    const std::function<Eigen::VectorXd(const Eigen::VectorXd &)> &load_at) {
  constexpr int max_rounds = 100;
  SolidState state = initial_state();
  Eigen::VectorXd load = load_at(state.displacement);
  for (int round = 0; round < max_rounds; ++round) {
    state = solve_static(load);
    const Eigen::VectorXd next = load_at(state.displacement);
    const double change = discretisation_.components.norm(next - load);
    load = next;
    if (change <= 1e-10 * discretisation_.components.norm(load))
      return state;
  }
  throw NoSolution(fmt::format("solid: the follower load did not settle in {} rounds", max_rounds));
}

template <int dim>
SolidState SolidSolver<dim>::solve_static_follower(Side side, const Hydrostatic &pressure) {
  return solve_static_follower([&](const Eigen::VectorXd &displacement) {
    return pressure_forces(discretisation_, side, pressure, displacement);
  });
}

template <int dim>
Eigen::VectorXd SolidSolver<dim>::reactions(const SolidState &state,
                                            const Eigen::VectorXd &load) const {
  return assembly_.internal_force(state.displacement, state.modes,
                                  Overstress<dim>{0, numbers(state.branch)}) +
         assembly_.mass_times(state.acceleration) - load - own_load_;
}

template <int dim>
Eigen::VectorXd SolidSolver<dim>::consistent_acceleration(const SolidState &state,
                                                          const Eigen::VectorXd &load) {
  LinearSolver mass(assembly_.mass(), linear_solver(),
                    [this] { return assembly_.rigid_motions(); });
  mass.factorise(assembly_.mass());
  Eigen::VectorXd acceleration = Eigen::VectorXd::Zero(load.size());
  assembly_.add_to_free(
      acceleration, 1,
      mass.solve(assembly_.restrict_to_free(
          load + own_load_ - assembly_.internal_force(state.displacement, state.modes))));
  return acceleration;
}

template <int dim>
std::vector<double> SolidSolver<dim>::frequencies(const SolidState &state, int count) {
  check(discretisation_.ranks.is_one(), "solid: frequencies are found on one rank, not on {}",
        discretisation_.ranks.size());
  check(assembly_.n_free() <= 4000,
        "solid: {} unknowns are too many for the dense eigenvalue problem; use at most 4000",
        assembly_.n_free());
  check(assembly_.linearise(state.displacement, state.modes) > 0,
        "solid: the state whose frequencies are wanted has an inverted element");
  const Eigen::GeneralizedSelfAdjointEigenSolver<Eigen::MatrixXd> modes(
      Eigen::MatrixXd(assembly_.tangent()), Eigen::MatrixXd(assembly_.mass()),
      Eigen::EigenvaluesOnly);
  std::vector<double> found;
  for (int k = 0; k < std::min(count, assembly_.n_free()); ++k)
    found.push_back(std::sqrt(std::max(0.0, modes.eigenvalues()[k])) / (2 * std::numbers::pi));
  return found;
}

template <int dim> double SolidSolver<dim>::kinetic_energy(const SolidState &state) const {
  return 0.5 * discretisation_.components.dot(state.velocity, assembly_.mass_times(state.velocity));
}

template <int dim> double SolidSolver<dim>::strain_energy(const SolidState &state) const {
  return assembly_.strain_energy(state.displacement, state.modes);
}

template class SolidSolver<2>;
template class SolidSolver<3>;

} // namespace sluice::solid
