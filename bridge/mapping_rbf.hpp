// SPDX-License-Identifier: MIT
// Radial basis functions with compact support and a linear polynomial, by a partition of unity:
//
//   u(x) = sum_c q_c(x) u_c(x),    u_c(x) = sum_j alpha_j phi(|x - X_j|) + p(x) . beta,
//
// one small interpolation problem for each patch c of neighbouring solid nodes, blended with smooth
// weights that sum to one. phi is Wendland's C6 function. H is the resulting matrix: each row holds
// the nodes of the few patches that its fluid node lies in.
// Sources: Wendland, Adv. Comput. Math. 4 (1995) 389-396; Beckert and Wendland, Aerosp. Sci.
// Technol. 5 (2001) 125-134 (coupling, conservative transpose); Schneider et al., preCICE's RBF-PU
// (2023). The most accurate map for smooth fields on smooth surfaces, and the dearest to set up;
// tractions are no better than those of the projection on surfaces with an edge.
#pragma once

#include "bridge/interface_mesh.hpp"
#include "bridge/mapping.hpp"

namespace sluice::bridge {

/// Throws UserError as projection_map does.
Mapping rbf_map(const InterfaceMesh &fluid, const InterfaceMesh &solid);

} // namespace sluice::bridge
