// SPDX-License-Identifier: MIT
// The elastic gate as a box for ccx, and the water's static load on it.
#pragma once

#include "bridge/calculix/box_deck.hpp"
#include "bridge/calculix/interface.hpp"

namespace sluice::calculix {

inline BoxParams gate_box(const std::string &element) {
  BoxParams box;
  box.corner = {0.1, 0};
  box.width = 0.005;
  box.height = 0.079;
  box.elements_along = 28;
  box.element = element;
  box.density = 1100;
  box.youngs_modulus = 12e6;
  box.poisson_ratio = 0.4;
  return box;
}

/// Nodal forces [N/m] of water at rest, 0.14 m deep, on the side x = 0.1 m, by the trapezoidal
/// rule; dead: normal to the undeformed side.
inline std::vector<double> water_load(const bridge::InterfaceMesh &mesh) {
  std::vector<double> forces(mesh.positions.size(), 0.0);
  for (std::size_t a = 0; a < mesh.n_nodes(); ++a) {
    const auto x = mesh.position(a);
    const double spacing = 0.079 / 28, end = x[1] < 1e-9 || x[1] > 0.079 - 1e-9 ? 0.5 : 1;
    if (x[0] < 0.1 + 1e-9)
      forces[2 * a] = end * spacing * 1000 * 9.81 * (0.14 - x[1]);
  }
  return forces;
}

} // namespace sluice::calculix
