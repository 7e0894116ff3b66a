// SPDX-License-Identifier: MIT
// Newton's method for one equation of equilibrium, static or of a time step.
//
//   R(u) = k f_int(u) + c M (u - u_ref) - load = 0   on the free components
//
// k = 1, c = 0 is the static problem; generalised-alpha's step is the same equation with other
// numbers (time_integrator.hpp). The internal modes follow every update element by element.
//
// A step that would invert an element, or take nine tenths of its volume, is halved. There is no
// line search on the residual: in a thin body the first full step raises it a thousandfold (a
// linear deflection stretches the axis) and the next one brings it back, so a descent condition
// would only crawl. Loads are raised in parts instead (SolidSolver::solve_static).
#pragma once

#include "solid-dealii/assembly.hpp"
#include "solid-dealii/linear_solver.hpp"

#include <string>

namespace sluice::solid {

/// Displacement [m] of all components and internal modes [m].
struct Iterate {
  Eigen::VectorXd displacement;
  Eigen::VectorXd modes;
};

struct Equation {
  double internal_factor = 1;         ///< k
  double mass_factor = 0;             ///< c [1/s^2]
  Eigen::VectorXd inertial_reference; ///< u_ref [m], all components; empty when c = 0
  Eigen::VectorXd load;               ///< [N], all components
};

struct NewtonSettings {
  double tolerance = 1e-9; ///< of the residual, relative to the largest force in the equation
  int max_iterations = 25;
  /// Modified Newton: the factors of a tangent are used again as long as an iteration with them
  /// leaves at most this part of the residual. 0: every iteration has its own.
  double reuse_while_below = 0;
};

struct NewtonReport {
  bool has_converged = false;
  int iterations = 0;
  double residual = 0;  ///< [N] Euclidean norm, forces on the modes included
  double reference = 0; ///< [N] largest of the norms of load, internal and inertial force
  double min_det = 0;   ///< smallest det F of the last iterate
  int factorisations = 0;
  int linear_iterations = 0; ///< of conjugate gradients, all together
  std::string failure;       ///< why not, with the numbers
};

template <int dim> class Newton {
public:
  Newton(Assembly<dim> &assembly, NewtonSettings settings,
         LinearSolverKind kind = LinearSolverKind::automatic);

  /// Improves `iterate` until the residual is small; its fixed components stay. When the report
  /// says that it has not converged, `iterate` is not usable. `overstress` belongs to the internal
  /// force (viscosity.hpp).
  NewtonReport solve(const Equation &equation, Iterate &iterate,
                     const Overstress<dim> &overstress = {});
  void forget() { linear_solver_.forget(); } ///< (LinearSolver)

private:
  struct Residual {
    double min_det = 0;
    Eigen::VectorXd force; // R, all components
    double norm = 0;
    double reference = 0;
    double round_off = 0; // norms below it mean nothing
  };
  Residual evaluate(const Equation &equation, const Iterate &iterate);
  Iterate increment(const Residual &residual);
  bool factorise(const Equation &equation);
  Residual cut_back(const Equation &equation, Iterate &iterate, const Iterate &step,
                    double min_det);
  bool is_small(const Residual &residual) const;

  Assembly<dim> &assembly_;
  NewtonSettings settings_;
  LinearSolver linear_solver_;
  SparseMatrix matrix_;
  Overstress<dim> overstress_; // of the present solve
};

} // namespace sluice::solid
