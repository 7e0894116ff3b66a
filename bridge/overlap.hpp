// SPDX-License-Identifier: MIT
// The common part of two facets: the second is projected onto the first along the first's normal.
// Segments: an interval; triangles: a convex polygon, by clipping. Pure functions.
#pragma once

#include "bridge/facets.hpp"

#include <vector>

namespace sluice::bridge {

/// A point of the common part, as weights of either facet's corners; with `weight` [m^2; segments:
/// m] as the quadrature rule, exact for polynomials of second degree.
struct OverlapPoint {
  Vec<3> on_first, on_second;
  double weight = 0;
};

/// Appends the quadrature points of the common part. Nothing when the facets do not overlap or when
/// their normals differ by more than `steepest` allows.
void add_overlap(const Facet &first, const Facet &second, std::vector<OverlapPoint> &points);

/// Cosine of the largest angle between two facets that are taken for the same surface.
inline constexpr double steepest = 0.5;

} // namespace sluice::bridge
