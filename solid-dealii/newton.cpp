// SPDX-License-Identifier: MIT
#include "solid-dealii/newton.hpp"

#include <algorithm>
#include <cmath>

namespace sluice::solid {

template <int dim>
Newton<dim>::Newton(Assembly<dim> &assembly, NewtonSettings settings, LinearSolverKind kind)
    : assembly_(assembly), settings_(settings),
      linear_solver_(assembly.tangent(), kind, [&assembly] { return assembly.rigid_motions(); }),
      matrix_(assembly.tangent()) {}

template <int dim>
typename Newton<dim>::Residual Newton<dim>::evaluate(const Equation &equation,
                                                     const Iterate &iterate) {
  Residual r;
  r.min_det = assembly_.linearise(iterate.displacement, iterate.modes, overstress_);
  if (!(r.min_det > 0))
    return r;
  r.force = equation.internal_factor * assembly_.condensed_force() - equation.load;
  r.reference = std::max(assembly_.norm_of_free(equation.load),
                         assembly_.norm_of_free(assembly_.condensed_force()));
  if (equation.mass_factor > 0) {
    const Eigen::VectorXd inertia =
        equation.mass_factor *
        assembly_.mass_times(iterate.displacement - equation.inertial_reference);
    r.force += inertia;
    r.reference = std::max(r.reference, assembly_.norm_of_free(inertia));
  }
  r.round_off = assembly_.round_off_force(equation.internal_factor * (1 + overstress_.factor),
                                          equation.mass_factor, iterate.displacement);
  r.norm = std::hypot(assembly_.norm_of_free(r.force), assembly_.mode_residual());
  return r;
}

template <int dim> bool Newton<dim>::is_small(const Residual &r) const {
  return r.norm <= std::max(settings_.tolerance * r.reference, r.round_off);
}

template <int dim> bool Newton<dim>::factorise(const Equation &equation) {
  Eigen::Map<Eigen::ArrayXd> values(matrix_.valuePtr(), matrix_.nonZeros());
  values = equation.internal_factor * assembly_.tangent().coeffs();
  if (equation.mass_factor > 0)
    values += equation.mass_factor * assembly_.mass().coeffs();
  return linear_solver_.factorise(matrix_);
}

template <int dim> Iterate Newton<dim>::increment(const Residual &r) {
  Iterate step{Eigen::VectorXd::Zero(r.force.size()), {}};
  assembly_.add_to_free(step.displacement, -1,
                        linear_solver_.solve(assembly_.restrict_to_free(r.force)));
  step.modes = assembly_.mode_increment(step.displacement);
  return step;
}

// Adds the largest of step, step/2, step/4 ... that leaves every element a tenth of the worst det
// F.
template <int dim>
typename Newton<dim>::Residual Newton<dim>::cut_back(const Equation &equation, Iterate &iterate,
                                                     const Iterate &step, double min_det) {
  const Iterate start = iterate;
  Residual residual;
  for (double factor = 1; factor > 1e-2; factor /= 2) {
    iterate.displacement = start.displacement + factor * step.displacement;
    iterate.modes = start.modes + factor * step.modes;
    residual = evaluate(equation, iterate);
    if (residual.min_det > 0.1 * min_det && std::isfinite(residual.norm))
      break;
  }
  return residual;
}

template <int dim>
NewtonReport Newton<dim>::solve(const Equation &equation, Iterate &iterate,
                                const Overstress<dim> &overstress) {
  overstress_ = overstress;
  NewtonReport report;
  Residual residual = evaluate(equation, iterate);
  double previous = 0;
  const auto failed = [&](std::string why) {
    report.failure = std::move(why);
    return report;
  };
  for (;; ++report.iterations) {
    report.residual = residual.norm;
    report.reference = residual.reference;
    report.min_det = residual.min_det;
    if (!(residual.min_det > 0))
      return failed(fmt::format("an element is inverted (smallest det F {:.3g}) after {} "
                                "iterations",
                                residual.min_det, report.iterations));
    if (!std::isfinite(residual.norm))
      return failed(
          fmt::format("the residual is not finite after {} iterations", report.iterations));
    report.has_converged = is_small(residual);
    if (report.has_converged)
      return report;
    if (report.iterations == settings_.max_iterations)
      return failed(fmt::format("residual {:.3g} N of {:.3g} N after {} iterations", residual.norm,
                                residual.reference, report.iterations));
    if (!(residual.norm <= settings_.reuse_while_below * previous)) {
      ++report.factorisations;
      if (!factorise(equation))
        return failed(fmt::format("the tangent is singular after {} iterations (smallest det F "
                                  "{:.3g})",
                                  report.iterations, residual.min_det));
    }
    previous = residual.norm;
    const Iterate step = increment(residual);
    report.linear_iterations += linear_solver_.last_iterations();
    if (!step.displacement.allFinite())
      return failed(fmt::format("the linear solver found no increment after {} iterations",
                                report.iterations));
    residual = cut_back(equation, iterate, step, residual.min_det);
  }
}

template class Newton<2>;
template class Newton<3>;

} // namespace sluice::solid
