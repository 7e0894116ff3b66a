// SPDX-License-Identifier: MIT
// The neighbours of eight consecutive points side by side, for kernels that do the same to each.
// Short lists are filled up with the point itself: it stands at q = 0 and differs from itself by
// nothing, so that it adds nothing to a sum over differences or over terms of a fit.
#pragma once

#include "fluid/cloud.hpp"
#include "fluid/packs.hpp"
#include "fluid/parallel.hpp"
#include "fluid/weights.hpp"

namespace sluice::fluid {

template <int dim> class PackedStencil {
public:
  /// Of the points first .. first + 7, `first` a multiple of eight.
  PackedStencil(int first, const Points<dim> &points, const Cloud<dim> &cloud)
      : first_(first), count_(std::min(pack_size, points.size() - first)),
        width_(cloud.slices.width(first)),
        column_(cloud.slices.column.data() + cloud.slices.place(first, 0)),
        position_(points.position.data()), scale_(1 / cloud.radius) {
    for (int l = 0; l < pack_size; ++l) {
      self_[l] = first + std::min(l, count_ - 1);
      length_[l] = l < count_ ? cloud.neighbours.count[first + l] : 0;
    }
    centre_ = gathered(self_.data(), position_);
  }

  int first() const { return first_; }
  int count() const { return count_; }    ///< points that there are
  int width() const { return width_; }    ///< entries of each list, filled up
  double scale() const { return scale_; } ///< 1 / radius [1/m]
  const int *self() const { return self_.data(); }
  const int *neighbours(int k) const { return column_ + k * SlicedPattern::lanes; }

  /// (x_j - x_i) / radius of the neighbours number k.
  PackVec<dim> offset(int k) const {
    PackVec<dim> q = gathered(neighbours(k), position_);
    for (int d = 0; d < dim; ++d)
      q[d] = (q[d] - centre_[d]) * scale_;
    return q;
  }
  /// Calls body(j, q, w) for every place in the lists: indices, offsets and weights.
  template <class Body> void for_each_neighbour(Body &&body) const {
    for (int k = 0; k < width_; ++k) {
      const PackVec<dim> q = offset(k);
      body(neighbours(k), q, weight_at(q));
    }
  }

  static Pack squared_norm(const PackVec<dim> &q) {
    Pack sum = q[0] * q[0];
    for (int d = 1; d < dim; ++d)
      sum += q[d] * q[d];
    return sum;
  }
  static Pack weight_at(const PackVec<dim> &q) {
    const Pack distance = square_root(squared_norm(q));
    return weight(distance < 1 ? distance : Pack{} + 1);
  }
  /// True for points whose lists have an entry k.
  PackMask has_neighbour(int k) const { return length_ > k; }

private:
  int first_, count_, width_;
  const int *column_;
  const Vec<dim> *position_;
  double scale_;
  std::array<int, pack_size> self_;
  PackMask length_; // of the lists
  PackVec<dim> centre_;
};

/// Calls body(first) for the first of every eight points.
template <class Body> void for_each_pack(int n, Body &&body) {
  for_each_block(n, [&](IndexRange range, int) {
    for (int first = range.begin; first < range.end; first += pack_size)
      body(first);
  });
}

} // namespace sluice::fluid
