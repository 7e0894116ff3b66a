// SPDX-License-Identifier: MIT
// Traction of the fluid on the walls, integrated into nodal forces. At each quadrature point of a
// segment the pressure is a positive average of first-order Taylor expansions from the points in
// sight on the wetted side, p(x) = sum w_i (p_i + grad p_i . (x - x_i)): exact for linear pressure,
// and affine in the wall velocity. Faces are one-sided; nothing is averaged round a corner.
#pragma once

#include "fluid/cloud.hpp"
#include "fluid/pressure.hpp"

#include <vector>

namespace sluice::fluid {

/// Quadrature points on the wetted walls of a frozen cloud and the fluid points that feed them.
struct WallQuadrature {
  struct Sample {
    int segment;
    double t;        // on the segment, 0 at vertex a
    Vec<2> position; // [m]
    Vec<2> normal;   // unit, out of the fluid
    double length;   // quadrature weight times wetted fraction [m]
    int first, count; // contributions
  };
  struct Contribution {
    int feeder;
    double weight; // sum to one per sample
  };
  std::vector<Sample> samples;
  std::vector<Contribution> contributions; // `feeder` counts in `feeders`
  std::vector<int> feeders;                // the fluid points that contribute, each once
  std::vector<int> feeder_of_point;        // -1: none
};

/// Resultant on part of the walls [N/m, N] per metre of depth, moment about the origin.
struct Resultant {
  Vec<2> force{0, 0};
  double moment = 0;
};

enum class WallPart { coupled, all };

/// Finds the wetted quadrature points of the coupled segments, or of all.
void build_wall_quadrature(const Points &points, const Walls &walls, const Cloud &cloud,
                           WallPart part, WallQuadrature &quadrature);

/// Tractions at the samples [Pa]: pressure times the normal, and viscous shear with the tangential
/// velocity difference to the wall over the distance. `viscosity` [Pa s] per point; none without.
void evaluate_tractions(const Points &points, const Walls &walls, const Cloud &cloud,
                        const PressureProblem &problem, std::span<const double> pressure,
                        std::span<const double> viscosity, const WallQuadrature &quadrature,
                        std::vector<Vec<2>> &traction);

/// Consistent nodal forces [N/m] on all wall vertices: sum of traction times linear shape function.
void integrate_nodal_forces(const Walls &walls, const WallQuadrature &quadrature,
                            std::span<const Vec<2>> traction, std::span<Vec<2>> force);

/// Resultant of the tractions themselves.
Resultant integrate_resultant(const WallQuadrature &quadrature, std::span<const Vec<2>> traction);

} // namespace sluice::fluid
