// SPDX-License-Identifier: MIT
// The input file of a rectangle or box clamped along one side, as a user could have written it.
#pragma once

#include "bridge/calculix/params.hpp"

namespace sluice::calculix {

/// Names of the node sets in that file.
inline constexpr const char *box_interface_set =
    "WETTED";                                       ///< all sides in the plane but the clamped
inline constexpr const char *box_probe_set = "TIP"; ///< the middle of the free end

/// The model and a step with *DYNAMIC. The planes of smallest and largest z hold u_z = 0. The
/// step's ALPHA is that of the HHT method with the spectral radius r at infinite frequency, (r -
/// 1)/(r + 1); source: Hilber, Hughes, Taylor, Earthq. Eng. Struct. Dyn. 5 (1977) 283.
std::string box_deck(const BoxParams &box);

} // namespace sluice::calculix
