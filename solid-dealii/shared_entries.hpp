// SPDX-License-Identifier: MIT
// Vectors of a body that is cut into parts of whole cells, one a rank. An entry on the border of
// two parts is held by both, and owned by the lowest rank that holds it.
//
//   complete   every holder of an entry has its value: displacements, loads, residuals
//   partial    every holder has the sum over its own cells: what assembly gives; add_up completes
//   it
//
// Holders add the same numbers in the same order, so that their copies stay equal bit by bit.
#pragma once

#include "solid-dealii/ranks.hpp"

namespace sluice::solid {

class SharedEntries {
public:
  /// Nothing is shared.
  SharedEntries() = default;
  /// `numbers` has the number of every entry held here among those of the whole body, ascending.
  SharedEntries(const Ranks &ranks, const std::vector<double> &numbers);

  bool owns(Eigen::Index entry) const { return owned_.size() == 0 || owned_[entry] > 0; }
  /// Entries of the whole body, of which `n` are held here.
  Eigen::Index count(Eigen::Index n) const;

  void add_up(Eigen::VectorXd &partial) const;
  /// Makes a vector complete whose owners have its values.
  void copy_from_owners(Eigen::VectorXd &values) const;

  /// Of complete vectors.
  double dot(const Eigen::VectorXd &a, const Eigen::VectorXd &b) const {
    return ranks_.is_one() ? a.dot(b) : ranks_.sum(a.cwiseProduct(owned_).dot(b));
  }
  double norm(const Eigen::VectorXd &a) const {
    return ranks_.is_one() ? a.norm() : std::sqrt(dot(a, a));
  }

private:
  Ranks ranks_;
  Eigen::VectorXd owned_;                // 1 or 0; empty for one rank
  std::vector<int> neighbours_;          // ranks that share entries with this one, ascending
  std::vector<std::vector<int>> shared_; // with every neighbour, in the order of their numbers
  std::vector<int> border_;              // all that are shared
};

} // namespace sluice::solid
