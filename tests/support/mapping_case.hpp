// SPDX-License-Identifier: MIT
// The work of the mapping benchmark: surfaces, fields and error measures. The same definitions were
// used to measure preCICE 3.4.1, so that the tables can be laid side by side.
//
// Surfaces (vertices of both sides lie on the same smooth one; none are meant to coincide):
//   sphere  unit, closed; fluid: class-I geodesic sphere, turned; solid: equiangular cubed sphere
//   plate   z = 0.2 sin(2 pi x) cos(pi y) over the unit square, open; fluid: inner vertices moved
//   by
//           up to a quarter of h, diagonals alternate; solid: regular
// Fields: scalar f (Franke), displacement u, traction t = -(1 + f) n + 0.1 (-y, x, 0); nodal force
// F_i = t(x_i) A_i with A_i a third of the areas of the triangles round vertex i.
#pragma once

#include "bridge/interface_mesh.hpp"

#include <cstdint>
#include <vector>

namespace sluice::bridge::benchmark {

enum class Surface { sphere, plate };

/// `n` cuts an edge of the icosahedron: 10 n^2 + 2 vertices.
InterfaceMesh geodesic_sphere(int n);
/// `n` cuts an edge of the cube: 6 n^2 + 2 vertices, each quadrilateral halved.
InterfaceMesh cubed_sphere(int n);
/// n x n vertices, regular.
InterfaceMesh regular_plate(int n);
/// The same with inner vertices moved by up to a quarter of h; `state` is that of the random
/// numbers.
InterfaceMesh jittered_plate(int n, std::uint64_t &state);
inline constexpr std::uint64_t first_state = 88172645463325252u;

double scalar(Surface surface, const Vec<3> &x);
Vec<3> displacement(const Vec<3> &x);
Vec<3> traction(Surface surface, const Vec<3> &x);

/// Nodal values of a field, three components per node.
std::vector<double> displacements(const InterfaceMesh &mesh);
/// The scalar in every component.
std::vector<double> scalars(Surface surface, const InterfaceMesh &mesh);
std::vector<double> nodal_forces(Surface surface, const InterfaceMesh &mesh);

/// Relative to the l2 norm of the exact values, and to the largest of them.
struct FieldError {
  double l2 = 0, largest = 0;
};
FieldError error(const std::vector<double> &got, const std::vector<double> &exact);

struct ForceError {
  double force = 0;        ///< |sum F_got - sum F_given| / sum |F_given|
  double moment = 0;       ///< the same of x cross F about the origin
  double traction_l2 = 0;  ///< area-weighted relative l2 of F_got/A against the traction
  double traction_max = 0; ///< largest error over the largest traction
  double empty = 0;        ///< part of the receiving vertices without force
};
ForceError force_error(Surface surface, const InterfaceMesh &from, const std::vector<double> &given,
                       const InterfaceMesh &to, const std::vector<double> &got);

double work(const std::vector<double> &force, const std::vector<double> &displacement);

} // namespace sluice::bridge::benchmark
