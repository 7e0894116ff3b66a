// SPDX-License-Identifier: MIT
// Nearest neighbour: every fluid node takes the value of the nearest solid node. First order; force
// sums are kept, moments are not (largest_offset in the report), and solid nodes that are nearest
// to none get no force. For quick starts and for meshes that match.
#pragma once

#include "bridge/interface_mesh.hpp"
#include "bridge/mapping.hpp"

namespace sluice::bridge {

/// Throws UserError as projection_map does; the gap is measured to the solid's surface. A solid
/// without faces has none: then the report alone says how far the nodes are.
Mapping nearest_map(const InterfaceMesh &fluid, const InterfaceMesh &solid);

} // namespace sluice::bridge
