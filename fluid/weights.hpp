// SPDX-License-Identifier: MIT
// The compact kernel of all weighted-least-squares operators.
#pragma once

namespace sluice::fluid {

/// Weight of a neighbour at the distance q = |r| / radius, 0 <= q <= 1: W = (1 - q)^2.
/// The same W enters moments, numerators and denominators; otherwise linear fields are not
/// reproduced.
template <class Number> Number weight(const Number &q) { return (1.0 - q) * (1.0 - q); }

} // namespace sluice::fluid
