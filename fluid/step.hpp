// SPDX-License-Identifier: MIT
// One time step of the fluid, in the three parts that coupling needs: what happens once before the
// iterations (move, freeze the cloud, assemble), what a coupling iteration repeats (pressure and
// loads for a wall velocity), and what happens once after (project the velocity).
#pragma once

#include "bridge/base/timer.hpp"
#include "fluid/bicgstab.hpp"
#include "fluid/multigrid.hpp"
#include "fluid/pressure.hpp"
#include "fluid/scene.hpp"
#include "fluid/viscosity.hpp"
#include "fluid/wall_loads.hpp"

#include <memory>
#include <vector>

namespace sluice::fluid {

/// Work of one step, for the run report.
struct StepReport {
  RowCounts rows;
  int pressure_iterations = 0;  // over all coupling iterations of the step
  int viscous_iterations = 0;
  int viscous_passes = 0; // over the viscosity law; 0: explicit
  ViscousRowCounts viscous_rows;
  int pressure_solves = 0;
  Vec<2> contact_impulse{0, 0}; // of walls on the points that touched them [N s/m]
  int released = 0;             // points that bear no tension next to air
};

class FluidSolver {
public:
  explicit FluidSolver(const Scene &scene);

  FluidState state; // a value: copy it to keep a checkpoint
  Walls walls;      // move coupled vertices through here

  /// Moves the points, freezes the cloud at walls.position, assembles viscosity and pressure.
  void begin_step(double dt);
  /// Pressure and wall loads for walls.velocity. Throws UserError when the pressure solver fails.
  void iterate();
  /// Velocity after the pressure; plans the regularisation of the next move.
  void end_step();

  const std::vector<Vec<2>> &nodal_forces() const { return nodal_forces_; } // per wall vertex [N/m]
  const std::vector<Vec<2>> &tractions() const { return tractions_; }       // per coupled sample
  const WallQuadrature &quadrature() const { return quadrature_; }
  const Cloud &cloud() const { return cloud_; }
  const PressureProblem &problem() const { return problem_; }
  /// Dynamic viscosity per point [Pa s]; empty in an inviscid fluid.
  std::span<const double> viscosity() const { return viscous_.viscosity; }
  const StepReport &report() const { return report_; }
  const FluidParams &params() const { return params_; }
  double dt() const { return dt_; }
  /// Energy that points have carried out of the scene so far [J/m].
  double outlet_energy() const { return state.outlet_energy; }
  PhaseTimer timer;

private:
  void leave_through_outlet();
  double energy_of_point(const Vec<2> &u, const Vec<2> &x) const;
  void freeze_cloud();
  void extrapolate_velocity();
  void predict_velocity();
  void assemble();

  FluidParams params_;
  PressureParams pressure_params_;
  double dt_ = 0;            // [s], of the step
  double projection_dt_ = 0; // [s], over which the forces of the step act on predicted_
  double pace_ = 0;          // [1/s], of what happens at the scale of the points
  Cloud cloud_;
  PressureProblem problem_;
  ViscousProblem viscous_;
  std::vector<Vec<2>> predicted_; // u* [m/s]
  std::vector<double> target_divergence_;
  ScaledMatrix scaled_;
  Multigrid multigrid_;
  KrylovMemory memory_;
  WallQuadrature quadrature_;
  std::vector<Vec<2>> tractions_, nodal_forces_;
  StepReport report_;
};

} // namespace sluice::fluid
