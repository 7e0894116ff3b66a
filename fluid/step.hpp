// SPDX-License-Identifier: MIT
// One time step of the fluid, in the three parts that coupling needs: what happens once before the
// iterations (move, freeze the cloud, assemble), what a coupling iteration repeats (pressure and
// loads for a wall velocity), and what happens once after (project the velocity).
#pragma once

#include "bridge/base/check.hpp"
#include "bridge/base/timer.hpp"
#include "fluid/bicgstab.hpp"
#include "fluid/carried_pressure.hpp"
#include "fluid/multigrid.hpp"
#include "fluid/pressure.hpp"
#include "fluid/scene.hpp"
#include "fluid/surface_stress.hpp"
#include "fluid/viscosity.hpp"
#include "fluid/wall_loads.hpp"

#include <memory>
#include <vector>

namespace sluice::fluid {

/// What parts of a step change of the fluid's kinetic and potential energy [J]. Forces work on the
/// mean of the velocities before and after the step: on that path gravity gives to the one energy
/// what it takes from the other, and what is left of the whole change is viscosity's.
struct EnergyChanges {
  double correction = 0; // shift of the points, contact with walls
  double projection = 0; // pressure: nothing in a closed tank, were it exact
  double damping = 0;    // of point noise
};

/// Work of one step, for the run report.
template <int dim> struct StepReport {
  RowCounts rows;
  int pressure_iterations = 0; // over all coupling iterations of the step
  int viscous_iterations = 0;
  int viscous_passes = 0;         // over the viscosity law; 0: explicit
  bool viscosity_skipped = false; // it is negligible
  ViscousRowCounts viscous_rows;
  int pressure_solves = 0;
  Vec<dim> contact_impulse = Vec<dim>::Zero(); // of walls on the points that touched them [N s/m]
  EnergyChanges energy;
  int released = 0;  // points that bear no tension next to air
  int cells_cut = 0; // Voronoi cells whose neighbours were not known from the last step
};

template <int dim> class FluidSolver {
public:
  explicit FluidSolver(const Scene<dim> &scene);

  FluidState<dim> state; // a value: copy it to keep a checkpoint
  Walls<dim> walls;      // move coupled vertices through here

  /// Moves the points, freezes the cloud at walls.position, assembles viscosity and pressure.
  void begin_step(double dt);
  /// Pressure and wall loads for walls.velocity. Throws UserError when the pressure solver fails,
  /// on values that are not finite too.
  void iterate();
  /// Velocity after the pressure; plans the regularisation of the next move.
  void end_step();

  const std::vector<Vec<dim>> &nodal_forces() const {
    return nodal_forces_;
  }                                                                     // per wall vertex [N/m]
  const std::vector<Vec<dim>> &tractions() const { return tractions_; } // per coupled sample
  const WallQuadrature<dim> &quadrature() const { return quadrature_; }
  const Cloud<dim> &cloud() const { return cloud_; }
  const PressureProblem<dim> &problem() const { return problem_; }
  /// Dynamic viscosity per point [Pa s]; empty in an inviscid fluid.
  std::span<const double> viscosity() const { return viscous_.viscosity; }
  const ViscousProblem<dim> &viscous() const { return viscous_; }
  const StepReport<dim> &report() const { return report_; }
  const FluidParams<dim> &params() const { return params_; }
  double dt() const { return dt_; }
  /// Energy that points have carried out of the scene so far [J/m].
  double outlet_energy() const { return state.outlet_energy; }
  PhaseTimer timer;

private:
  void leave_through_outlet();
  double energy_of_shift() const;
  double energy() const;
  void measure_work();
  double mass_of_point() const;
  double energy_of_point(const Vec<dim> &u, const Vec<dim> &x) const;
  void freeze_cloud();
  void extrapolate_velocity();
  void push_by_known_forces();
  bool viscosity_is_negligible() const;
  bool viscosity_knows_pressure() const;
  void find_first_pressure();
  void solve_pressure();
  void predict_velocity();
  bool keeps_stiff_pressure() const;
  void take_back_push();
  void assemble();

  FluidParams<dim> params_;
  PressureParams pressure_params_;
  double dt_ = 0;            // [s], of the step
  double projection_dt_ = 0; // [s], over which the forces of the step act on predicted_
  Pace pace_{};              // [1/s]
  Cloud<dim> cloud_;
  PressureProblem<dim> problem_;
  ViscousProblem<dim> viscous_;
  std::vector<Vec<dim>> predicted_; // u* [m/s]
  std::vector<Vec<dim>> expected_;  // [m/s], at the end of the step, from the steps before
  SurfacePoints surface_;
  std::vector<Vec<dim>> push_; // [m/s]
  CarriedPressure<dim> carried_;
  std::vector<double> target_divergence_;
  std::vector<double> cell_average_; // memory of the volume control
  std::vector<char> leaves_;         // per point
  std::vector<Cell> cells_;          // per point: of the multigrid
  ScaledMatrix scaled_;
  Multigrid multigrid_;
  KrylovMemory memory_;
  WallQuadrature<dim> quadrature_;
  std::vector<Vec<dim>> tractions_, nodal_forces_;
  StepReport<dim> report_;
};

} // namespace sluice::fluid
