// SPDX-License-Identifier: MIT
// Surface-integral (mortar) map: solid values enter by integrals over the surface, not by values at
// points, so that nodal forces of a mesh as fine as the solid's, or finer, become smooth tractions.
//
//   H_ij = int psi_i phi_j / int psi_i,    int psi_i phi^f_k = delta_ik int phi^f_i,
//
// with the fluid's shape functions phi^f, the dual ones psi (a combination of phi^f face by face),
// and the solid's phi_j. Source: Wohlmuth, SIAM J. Numer. Anal. 38 (2000) 989-1012; on faces that
// hang over the rim of the solid's surface both integrals go over the covered part, as in Popp et
// al., SIAM J. Sci. Comput. 35 (2013) B421-B446. On a flat surface three things follow:
//   rows sum to one, and H is exact for linear fields      (force, moment; also at open edges)
//   int psi_i summed over i is the area of phi_j           (a constant traction stays constant)
// On a curved one the first is restored by linear_reproduction.hpp, the second holds to O(h^2).
//
// The integrals are exact for flat faces: the solid's facets are projected along the normal of the
// fluid's and clipped (Sutherland and Hodgman, Comm. ACM 17 (1974) 32-42); on each piece the
// product of two linear functions is integrated by a rule of second degree. Cost: O(n log n), once.
// Not done: on a solid finer than the fluid the dual functions show through, and tractions are
// jagged.
#pragma once

#include "bridge/interface_mesh.hpp"
#include "bridge/mapping.hpp"

namespace sluice::bridge {

/// Fluid nodes without any covered surface take the row of projection_map. Throws UserError as
/// projection_map does.
Mapping mortar_map(const InterfaceMesh &fluid, const InterfaceMesh &solid);

} // namespace sluice::bridge
