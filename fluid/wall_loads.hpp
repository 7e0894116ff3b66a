// SPDX-License-Identifier: MIT
// Traction of the fluid on the walls, integrated into nodal forces. At each quadrature point of a
// face the pressure is a positive average of first-order Taylor expansions from the points in
// sight on the wetted side, p(x) = sum w_i (p_i + grad p_i . (x - x_i)): exact for linear pressure,
// and affine in the wall velocity. Faces are one-sided; nothing is averaged round a corner of
// more than 30 degrees.
//
// Where only the sum over all walls is asked for, narrow faces (less than a quarter of a spacing)
// have one quadrature point on pieces no longer than a spacing, and those in one small cube share
// their average: the points in sight of the first and their weights there. It is still linear in x
// for each of them, so the sum is exact for linear pressure. Else the remainder of a Taylor
// expansion, |grad grad p| r^2 / 2 from points up to r = 2 spacings away, becomes one up to the
// cube's diagonal farther, 2.9 spacings: of the same order.
#pragma once

#include "fluid/cloud.hpp"
#include "fluid/pressure.hpp"

#include <vector>

namespace sluice::fluid {

/// Quadrature points on the wetted walls of a frozen cloud and the fluid points that feed them.
template <int dim> struct WallQuadrature {
  struct Sample {
    int face;
    Shape<dim> shape;  // of the face's vertices
    Vec<dim> position; // [m]
    Vec<dim> normal;   // unit, out of the fluid
    double measure;    // quadrature weight times wetted fraction [m^(dim-1)]
    int first, count;  // contributions; samples may share them
  };
  struct Contribution {
    int feeder;
    double weight; // sum to one per sample
  };
  std::vector<Sample> samples;
  std::vector<Contribution> contributions; // `feeder` counts in `feeders`
  std::vector<int> feeders;                // the fluid points that contribute, each once
  std::vector<int> feeder_of_point;        // -1: none
  std::vector<Vec<dim>> gradient;          // of the pressure at the feeders, when last evaluated
};

/// Resultant on part of the walls [N, N m], in the plane per metre of depth; moment about the
/// origin.
template <int dim> struct Resultant {
  Vec<dim> force = Vec<dim>::Zero();
  decltype(cross(force, force)) moment = cross(force, force); // a number in the plane
};

enum class WallPart { coupled, all };

/// Finds the wetted quadrature points of the coupled faces, or of all.
template <int dim>
void build_wall_quadrature(const Points<dim> &points, const Walls<dim> &walls,
                           const Cloud<dim> &cloud, WallPart part, WallQuadrature<dim> &quadrature);

/// Tractions at the samples [Pa]: pressure times the normal, and viscous shear with the tangential
/// velocity difference to the wall over the distance, unless the wall slips. `viscosity` [Pa s] per
/// point; none without.
template <int dim>
void evaluate_tractions(const Points<dim> &points, const Walls<dim> &walls, const Cloud<dim> &cloud,
                        const PressureProblem<dim> &problem, std::span<const double> pressure,
                        std::span<const double> viscosity, WallQuadrature<dim> &quadrature,
                        std::vector<Vec<dim>> &traction);

/// Consistent nodal forces [N/m] on all wall vertices: sum of traction times linear shape function.
template <int dim>
void integrate_nodal_forces(const Walls<dim> &walls, const WallQuadrature<dim> &quadrature,
                            VecView<dim> traction, VecSpan<dim> force);

/// Resultant of the tractions themselves.
template <int dim>
Resultant<dim> integrate_resultant(const WallQuadrature<dim> &quadrature, VecView<dim> traction);

} // namespace sluice::fluid
