// SPDX-License-Identifier: MIT
// The elastic gate of the case folder, without its water: what several tests start from.
#pragma once

#include "bridge/participant.hpp"
#include "solid-dealii/solid_solver.hpp"

#include <fstream>

namespace sluice::solid {

/// 79 x 5 mm, clamped at the top, 28 incompatible-mode elements.
inline SolidParams gate_params() {
  SolidParams p;
  p.corner = {0.1, 0};
  p.width = 0.005;
  p.height = 0.079;
  p.elements_along = 28;
  p.element = "incompatible-modes";
  p.density = 1100;
  p.youngs_modulus = 12e6;
  p.poisson_ratio = 0.4;
  return p;
}

/// The water of the published tank, 140 mm high, at rest.
inline constexpr Hydrostatic gate_water{1000, 9.81, 0.14};

template <int dim> Eigen::VectorXd dead_load(const SolidSolver<dim> &solver) {
  return pressure_forces(solver.discretisation(), Side::left, gate_water,
                         solver.initial_state().displacement);
}

/// Mean displacement [m] of the nodes of the free end, 0: x, 1: y.
template <int dim>
double tip(const SolidSolver<dim> &solver, const SolidState &state, int component) {
  const auto nodes = solver.discretisation().side_nodes(Side::lower);
  double sum = 0;
  for (const int node : nodes)
    sum += state.displacement[dim * node + component];
  return sum / static_cast<double>(nodes.size());
}

/// The bridge's part of the fluid's state, which a scripted fluid keeps beside the solid's restart
/// files, and goes on from where the folder `from` has one.
inline void keep_fluid(const bridge::Participant &bridge, const std::filesystem::path &folder) {
  const auto bytes = bridge.saved_state();
  std::ofstream(folder / "fluid.state", std::ios::binary)
      .write(reinterpret_cast<const char *>(bytes.data()), std::ssize(bytes));
}
inline void restore_fluid(bridge::Participant &bridge, const std::filesystem::path &from) {
  if (from.empty())
    return;
  std::ifstream in(from / "fluid.state", std::ios::binary);
  const std::string text{std::istreambuf_iterator<char>(in), {}};
  bridge.restore(std::as_bytes(std::span(text)));
}

} // namespace sluice::solid
