// SPDX-License-Identifier: MIT
// Makes a map exact for linear fields: H X_s = x_f. Then x_f + H d = H (X_s + d) for every motion
// d, and the moment of nodal forces is the same on both sides in the current configuration.
//
// A row whose nodes do not add up to their fluid node, r = x_i - sum_j H_ij X_j, gets the smallest
// change that closes it: minimise sum_j delta_j^2 / w_j under sum_j delta_j = 0 and sum_j delta_j
// X_j = r, hence delta_j = w_j lambda . (X_j - X_mean) with the weighted covariance C lambda = r.
// w_j falls smoothly from one at the fluid node to zero behind the last node of the row, which is
// first widened by the solid's neighbours. Source: moving least squares with a linear basis
// (Lancaster and Salkauskas, Math. Comp. 37 (1981) 141-158), applied to the residual of another
// map.
//
// On a curved surface the gap is bridged by nodes that lie off the tangent plane, so that the
// correction also takes the surface's curvature into account. Where the surface is flat no node
// does and the gap stays (largest_offset says how much): the moment then changes by gap x force.
#pragma once

#include "bridge/interface_mesh.hpp"
#include "bridge/mapping.hpp"

namespace sluice::bridge {

/// H with rows changed where they need it. Rows that are exact keep their entries.
Mapping::Matrix with_linear_reproduction(const Mapping::Matrix &h, const InterfaceMesh &fluid,
                                         const InterfaceMesh &solid);

/// max_i |x_i - sum_j H_ij X_j| [m] in the fluid's dimensions: zero up to rounding for a map that
/// keeps moments.
double largest_offset(const Mapping::Matrix &h, const InterfaceMesh &fluid,
                      const InterfaceMesh &solid);

} // namespace sluice::bridge
