// SPDX-License-Identifier: MIT
// The elastic body: built once from its parameters, it turns a state and a load into the next
// state.
#pragma once

#include "solid-dealii/failure.hpp"
#include "solid-dealii/newton.hpp"
#include "solid-dealii/params.hpp"
#include "solid-dealii/solid_state.hpp"
#include "solid-dealii/supports.hpp"
#include "solid-dealii/time_integrator.hpp"

namespace sluice::solid {

/// What the solver has done since it was made.
struct SolverCounts {
  long solves = 0;          ///< nonlinear equations solved
  long iterations = 0;      ///< Newton iterations of all of them
  int iterations_max = 0;   ///< of one
  long rejected_starts = 0; ///< first guesses that were inverted or did not converge
  long cut_steps = 0;       ///< steps that were halved because they had no solution
  long factorisations = 0;
  long linear_iterations = 0; ///< of conjugate gradients
  double seconds = 0;         ///< [s] wall time in step()
  double cpu_seconds = 0;     ///< [s] CPU time in step()
};

/// The side that a key's value names: "left", "right", "lower" or "upper".
Side side_named(std::string_view name);
Side opposite(Side side);

template <int dim> class SolidSolver {
public:
  /// On several ranks each holds a part of the body, its states and loads are of that part, and all
  /// ranks make every call together.
  explicit SolidSolver(const SolidParams &params, const Ranks &ranks = {});
  SolidSolver(const SolidSolver &) = delete;
  SolidSolver &operator=(const SolidSolver &) = delete;

  /// At rest, undeformed, no acceleration: the first load finds it in the first step.
  SolidState initial_state() const;

  /// The state after a step of length `dt` [s] under nodal forces `load` [N] (all components),
  /// constant over the step, and the body's own load. `guess`, an earlier answer for the same step,
  /// only saves iterations. Throws NoSolution, with the numbers, when no start leads to a solution.
  SolidState step(const SolidState &start, const Eigen::VectorXd &load, double dt,
                  const SolidState *guess = nullptr);
  /// The same for a coupling window: in params().steps_per_window steps, each of them halved up to
  /// params().max_step_cuts times where it has no solution.
  SolidState advance(const SolidState &start, const Eigen::VectorXd &load, double window,
                     const SolidState *guess = nullptr);

  /// At a checkpoint: the next step has the bits that a solver gives which was made for it, whatever
  /// the linear solver had kept of earlier ones.
  void start_anew() { newton_.forget(); }

  /// Equilibrium under a dead load and the body's own, raised in parts where one part is too much.
  SolidState solve_static(const Eigen::VectorXd &load);
  /// Equilibrium under `load(displacement)`, a load that follows the body, e.g. a pressure.
  SolidState
  solve_static_follower(const std::function<Eigen::VectorXd(const Eigen::VectorXd &)> &load);
  /// Equilibrium under a pressure on `side` that stays normal to the deformed surface.
  SolidState solve_static_follower(Side side, const Hydrostatic &pressure);
  /// M^-1 (load - f_int) for a load that acts from the start on [m/s^2]; zero on fixed components.
  Eigen::VectorXd consistent_acceleration(const SolidState &state, const Eigen::VectorXd &load);
  /// The lowest `count` natural frequencies [Hz] about `state`, by a dense eigenvalue problem.
  std::vector<double> frequencies(const SolidState &state, int count);

  double kinetic_energy(const SolidState &state) const; ///< [J]
  double strain_energy(const SolidState &state) const;  ///< [J]
  /// Force [N] of the supports on every component of the body; zero where it is free and the
  /// motion satisfies its equation. `load` as in the step that led to `state`.
  Eigen::VectorXd reactions(const SolidState &state, const Eigen::VectorXd &load) const;

  const Ranks &ranks() const { return discretisation_.ranks; }
  const Discretisation<dim> &discretisation() const { return discretisation_; }
  const Assembly<dim> &assembly() const { return assembly_; }
  const SolidParams &params() const { return params_; }
  Side clamped_side() const { return side_named(params_.clamped_side); }
  const Supports &supports() const { return supports_; }
  const Eigen::VectorXd &own_load() const { return own_load_; } ///< [N] gravity and tractions
  const SolverCounts &counts() const { return counts_; }

private:
  LinearSolverKind linear_solver() const;
  NewtonReport solve(const Equation &equation, Iterate &iterate,
                     const Overstress<dim> &overstress = {});
  void raise_load(const Eigen::VectorXd &load, Iterate &iterate);
  SolidState advance_halving(const SolidState &start, const Eigen::VectorXd &load, double dt,
                             const SolidState *guess, int cuts_left);

  SolidParams params_;
  Discretisation<dim> discretisation_;
  Supports supports_;
  Eigen::VectorXd own_load_;
  Assembly<dim> assembly_;
  Newton<dim> newton_;
  GeneralisedAlpha integrator_;
  SolverCounts counts_;
};

} // namespace sluice::solid
