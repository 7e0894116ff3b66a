// SPDX-License-Identifier: MIT
// A plane fluid on a solid in space: the polyline of the fluid is drawn out along z over the
// solid's depth, mapped there, and the layers are averaged with the weights of the trapezoidal
// rule:
//
//   H = E H_3,   u_f(x, y) = mean over z of u_s,   F_s = depth H^T F_f   (F_f per metre of depth).
//
// For a solid that is itself drawn out along z (a column of hexahedra); displacements along z do
// not reach the fluid, and no force along z reaches the solid.
#pragma once

#include "bridge/interface_mesh.hpp"
#include "bridge/mapping.hpp"

namespace sluice::bridge {

/// Layers stand where the solid has nodes. Throws UserError when the solid has no depth, and as the
/// map of that kind does.
Mapping extruded_map(MapKind kind, const InterfaceMesh &fluid, const InterfaceMesh &solid);

} // namespace sluice::bridge
