// SPDX-License-Identifier: MIT
// How points move: with the flow, never through a wall, and kept evenly spread without changing the
// volume that they fill. All corrections are rates or thresholds: their effect does not grow with
// the number of steps.
#pragma once

#include "fluid/cloud.hpp"
#include "fluid/points.hpp"

#include <span>

namespace sluice::fluid {

struct MotionParams {
  /// Fraction of the way to the cell's centroid per unit of strain (dimensionless).
  double regularity = 2.0;
  /// Displacement per unit of strain in a direction that is each point's own, in spacings
  /// (dimensionless). A lattice that the flow stretches is a fixed point of the regularisation,
  /// though an unstable one; without a disturbance it stays a lattice until its rows part.
  double agitation = 0.05;
  /// Volume errors decay at this multiple of the flow's pace (dimensionless).
  double volume_rate = 0.3;
  /// No pair of points stays closer than this many spacings.
  double closest_pair = 0.7;
  /// No point stays farther from the middle of its cell than this many spacings.
  double widest_offset = 0.1;
  /// No point stays closer to a wall than this many spacings.
  double wall_clearance = 0.25;
};

template <int dim> struct ContactCounts {
  int moved = 0;                               // points that were too close to a wall
  int put_back = 0;                            // of these, points that were behind it
  Vec<dim> velocity_change = Vec<dim>::Zero(); // sum over the points [m/s]
};

/// Advances the points by a step `dt` [s], x += dt (u^n + lead (u^n - u^{n-1})), then applies the
/// pending regularisation. `lead` 0 is first order: with forces at the new positions that is the
/// symplectic Euler method, which keeps angular momentum under central forces and lets no wave
/// decay (E. Hairer, C. Lubich, G. Wanner, Geometric Numerical Integration, 2nd ed., I.1). With
/// half the ratio of dt to the step that ended in u^n it is second order, from stage to stage the
/// trapezoidal rule (the cloud lives at the stage positions; derived here).
template <int dim> void move_points(Points<dim> &points, double dt, double lead);

/// Puts points that are behind a wall or too close to it back to the clearance; those that were
/// behind it or next to air lose their velocity towards it (others have a pressure). Two walls on
/// opposite sides leave each at most 0.45 of the gap as clearance. Needs the cloud's projections.
template <int dim>
ContactCounts<dim> keep_clear_of_walls(Points<dim> &points, const Walls<dim> &walls,
                                       const MotionParams &params, const Cloud<dim> &cloud);

/// Divergence that brings the cells back to their volume [1/s], zero at the free surface: the
/// relative volume error, averaged twice over the neighbours (what cells of an irregular cloud
/// differ by is no lost volume, and a divergence would make it a velocity error), times volume_rate
/// and the larger of `pace` [1/s] and the point's strain rate, by which errors come up. `memory` is
/// scratch.
template <int dim>
void volume_restoring_divergence(const Points<dim> &points, const Cloud<dim> &cloud,
                                 const MotionParams &params, double pace,
                                 std::vector<double> &memory, std::span<double> divergence);

/// How fast things happen [1/s].
struct Pace {
  double points; // at the scale of the points
  double volume; // at which volume errors come up
};

/// Next to air volume errors follow the shortest waves: both are their frequency sqrt(g / spacing).
/// Without gravity: a tenth of the rms speed over the spacing, and 2 pi times it over the
/// size of the fluid, a turn of the largest eddy. A divergence that corrects the volume errors of
/// single cells, which are there on every irregular cloud, at the pace of the points would give a
/// velocity error of their size that no refinement takes away.
template <int dim> Pace pace_of(const Points<dim> &points, double gravity, double spacing);

/// Regularisation to be applied in the next move: towards the cell's centroid at a rate
/// proportional to the local strain rate (along the surface only, at the free surface), and apart
/// from a neighbour that is too close; plus an agitation proportional to the strain, and half of
/// what the cell's middle is too far away. Zero in a fluid at rest whose points keep their
/// distance.
template <int dim>
void plan_shift(Points<dim> &points, const Cloud<dim> &cloud, const MotionParams &params,
                MatView<dim> velocity_gradient, double dt);

} // namespace sluice::fluid
