// SPDX-License-Identifier: MIT
// What the rows of the pressure are made from: the neighbours of one point and the walls that hold
// it. Used by the two files that assemble the pressure only.
#pragma once

#include "fluid/least_squares.hpp"
#include "fluid/pressure.hpp"
#include "fluid/weights.hpp"

#include <algorithm>
#include <array>

namespace sluice::fluid {

// Weight of a wall row: that of a neighbour at no distance.
inline constexpr double wall_weight = 1.0;
// Points farther from a wall than this, in spacings, have no row for it: they see enough
// neighbours.
inline constexpr double wall_row_reach = 1.5;

/// A neighbour in scaled coordinates.
template <int dim> struct Neighbour {
  int j;
  Vec<dim> q; // r / h
  double w;
};

/// All that the row of one point is made from, gathered once.
template <int dim> struct Stencil {
  int i;
  double h;                     // kernel radius [m]
  const PointWalls<dim> *walls; // or nullptr
  bool open;                    // touches air: no wall holds it, its pressure is not solved for
  Vec<dim> open_side;           // of the zero of pressure
  int count;
  std::array<Neighbour<dim>, most_neighbours<dim>> neighbour;
};

template <int dim> double reach_of_rows(const Cloud<dim> &cloud) {
  return wall_row_reach * cloud.spacing;
}

// A sharp edge has no row: held at the direction towards it, a point would have to circle round the
// edge, and the suction of that circle tears the flow off. Contact alone keeps points out.
template <int dim> bool has_row(const Projection<dim> &p, const Cloud<dim> &cloud) {
  return p.distance < reach_of_rows(cloud) && !p.at_edge;
}

/// visit(m, projection m) for the walls that hold a point.
template <int dim, class Visit>
void for_each_wall_row(const PointWalls<dim> *walls, const Cloud<dim> &cloud, Visit &&visit) {
  if (!walls)
    return;
  for (int m = 0; m < walls->count; ++m)
    if (has_row(walls->projection[m], cloud))
      visit(m, walls->projection[m]);
}
template <int dim, class Visit>
void for_each_wall_row(const Stencil<dim> &s, const Cloud<dim> &cloud, Visit &&visit) {
  for_each_wall_row(s.walls, cloud, visit);
}

/// q of the zero of pressure outside an open point; 0: at the point.
template <int dim> Vec<dim> open_side(int i, const Cloud<dim> &cloud) {
  return cloud.surface_depth[i] / cloud.radius * cloud.surface_normal[i];
}

template <int dim>
void gather(int i, const Points<dim> &points, const Cloud<dim> &cloud, Stencil<dim> &s) {
  s.i = i;
  s.h = cloud.radius;
  s.walls = cloud.walls_of(i);
  s.open = cloud.kind[i] != PointKind::interior;
  s.open_side = open_side(i, cloud);
  s.count = 0;
  const Vec<dim> x = points.position[i];
  const double scale = 1 / s.h;
  for (const int j : cloud.neighbours.of(i)) {
    const Vec<dim> q = scale * (points.position[j] - x);
    s.neighbour[s.count++] = {j, q, weight(std::min(q.norm(), 1.0))};
  }
}

template <int dim, class Visit> void for_each_neighbour(const Stencil<dim> &s, Visit &&visit) {
  for (int k = 0; k < s.count; ++k)
    visit(s.neighbour[k]);
}

/// Does a wall hold the point of this row?
template <int dim> bool has_wall_row(int i, const Cloud<dim> &cloud) {
  const PointWalls<dim> *walls = cloud.walls_of(i);
  return walls && std::any_of(walls->begin(), walls->end(),
                              [&](const Projection<dim> &p) { return has_row(p, cloud); });
}

/// Assembles matrix row and gradient functional of one point.
template <int dim>
RowKind assemble_pressure_row(int i, const Points<dim> &points, const Cloud<dim> &cloud,
                              const PressureParams &params, PressureProblem<dim> &problem);

} // namespace sluice::fluid
