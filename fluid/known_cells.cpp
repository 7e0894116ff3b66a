// SPDX-License-Identifier: MIT
#include "fluid/known_cells.hpp"

#include <algorithm>

namespace sluice::fluid {

void number_points(const Points<2> &points, CellMemory &memory) {
  const auto last = std::max_element(points.id.begin(), points.id.end());
  const std::size_t n = last == points.id.end() ? 0 : static_cast<std::size_t>(*last) + 1;
  if (memory.generators.size() < n)
    memory.generators.assign(n, {});
  memory.index_of_id.assign(memory.generators.size(), -1);
  for_each_index(
      points.size(), [&](int i) { memory.index_of_id[points.id[i]] = i; }, Work::light);
}

namespace {

Pack cross(const PackVec<2> &a, const PackVec<2> &b) { return a[0] * b[1] - a[1] * b[0]; }
Pack dot(const PackVec<2> &a, const PackVec<2> &b) { return a[0] * b[0] + a[1] * b[1]; }
PackVec<2> chosen(const PackMask &mask, const PackVec<2> &yes, const PackVec<2> &no) {
  return {mask ? yes[0] : no[0], mask ? yes[1] : no[1]};
}

/// Eight polygons around the origin, in kernel radii, as the lists of the memory make them.
class Polygons {
public:
  Polygons(const PackedStencil<2> &s, const Points<2> &points, const CellMemory &memory) : s_(s) {
    find_generators(points, memory);
    if (most_ > 0)
      find_corners(points);
  }

  PackMask are_convex(double shortest) const {
    PackMask convex = is_known_;
    for (int g = 0; g < most_; ++g) {
      const PackVec<2> &r = generator_[g], &from = g > 0 ? corner_[g - 1] : last_corner_;
      const PackVec<2> edge{corner_[g][0] - from[0], corner_[g][1] - from[1]};
      const Pack along = cross(r, edge); // length times |r|
      const Pack limit = shortest * shortest * dot(r, r);
      convex &= ((along > 0) & (along * along > limit)) | ~has(g);
    }
    return convex;
  }
  /// No point of the lists is nearer to a corner than the point itself.
  PackMask are_empty(double tolerance) const {
    Pack deepest{};
    for (int k = 0; k < s_.width(); ++k) {
      const PackVec<2> r = s_.offset(k);
      Pack farthest = dot(r, corner_[0]);
      for (int g = 1; g < most_; ++g) {
        const Pack along = dot(r, corner_[g]);
        farthest = along > farthest ? along : farthest;
      }
      const Pack depth = farthest - 0.5 * dot(r, r);
      deepest = depth > deepest ? depth : deepest;
    }
    return deepest <= tolerance;
  }
  PackedCells cells(double radius) const {
    PackedCells cells;
    Pack twice{};
    PackVec<2> moment{};
    for (int g = 0; g < most_; ++g) {
      const PackVec<2> &a = corner_[g];
      const PackVec<2> b = next_corner(g);
      const Pack c = has(g) ? cross(a, b) : Pack{};
      twice += c;
      for (int d = 0; d < 2; ++d)
        moment[d] += c * (a[d] + b[d]);
      const Pack distance2 = dot(a, a);
      cells.reach2 = distance2 > cells.reach2 ? distance2 : cells.reach2;
    }
    cells.reach2 *= radius * radius;
    cells.volume = 0.5 * radius * radius * twice;
    const Pack scale = twice > 0 ? radius / (3 * twice) : Pack{};
    cells.centroid = {scale * moment[0], scale * moment[1]};
    return cells;
  }
  bool any() const { return most_ > 0; }

private:
  PackMask has(int g) const { return count_ > g; }
  PackVec<2> next_corner(int g) const {
    return g + 1 < most_ ? chosen(has(g + 1), corner_[g + 1], corner_[0]) : corner_[0];
  }

  void find_generators(const Points<2> &points, const CellMemory &memory) {
    for (int l = 0; l < pack_size; ++l) {
      const int i = s_.self()[l];
      const CellGenerators &known = memory.generators[points.id[i]];
      bool is_known = known.count >= 3 && l < s_.count();
      for (int g = 0; g < CellGenerators::most; ++g) {
        const int j = is_known && g < known.count ? memory.index_of_id[known.id[g]] : i;
        is_known = is_known && j >= 0;
        index_[g][l] = std::max(j, 0);
      }
      is_known_[l] = is_known ? -1 : 0;
      count_[l] = is_known ? known.count : 0;
      most_ = is_known ? std::max(most_, known.count) : most_;
    }
  }

  // Lists shorter than the longest are filled up with their first corner, which changes nothing.
  void find_corners(const Points<2> &points) {
    const PackVec<2> centre = gathered(s_.self(), points.position.data());
    for (int g = 0; g < most_; ++g) {
      generator_[g] = gathered(index_[g].data(), points.position.data());
      for (int d = 0; d < 2; ++d)
        generator_[g][d] = (generator_[g][d] - centre[d]) * s_.scale();
    }
    for (int g = 0; g < most_; ++g) {
      const PackVec<2> &r = generator_[g];
      const PackVec<2> n =
          g + 1 < most_ ? chosen(has(g + 1), generator_[g + 1], generator_[0]) : generator_[0];
      const Pack twice_det = 2 * cross(r, n);
      const Pack r2 = dot(r, r), n2 = dot(n, n);
      const PackVec<2> corner{(r2 * n[1] - n2 * r[1]) / twice_det,
                              (r[0] * n2 - n[0] * r2) / twice_det};
      is_known_ &= (twice_det > 0) | ~has(g);
      corner_[g] = g > 0 ? chosen(has(g), corner, corner_[0]) : corner;
      last_corner_ = chosen(has(g), corner, last_corner_);
    }
  }

  const PackedStencil<2> &s_;
  int most_ = 0;
  PackMask is_known_{}, count_{};
  std::array<std::array<int, pack_size>, CellGenerators::most> index_;
  std::array<PackVec<2>, CellGenerators::most> generator_, corner_;
  PackVec<2> last_corner_{};
};

} // namespace

PackedCells known_cells(const PackedStencil<2> &s, const Points<2> &points, const Cloud<2> &cloud,
                        const CellMemory &memory) {
  const Polygons polygons(s, points, memory);
  if (!polygons.any())
    return {};
  const double tolerance = shortest_edge * cloud.spacing / cloud.radius;
  PackedCells cells = polygons.cells(cloud.radius);
  cells.is_known = polygons.are_convex(tolerance) & polygons.are_empty(tolerance);
  return cells;
}

} // namespace sluice::fluid
