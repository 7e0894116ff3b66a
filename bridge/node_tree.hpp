// SPDX-License-Identifier: MIT
// Nodes near a point: a k-d tree over the nodes of an interface mesh, built once. Equal distances
// go to the lowest node number, so that the result does not depend on the tree.
#pragma once

#include "bridge/interface_mesh.hpp"

#include <utility>
#include <vector>

namespace sluice::bridge {

class NodeTree {
public:
  explicit NodeTree(const InterfaceMesh &mesh);

  struct Neighbour {
    double distance_squared; ///< [m^2]
    int node;
    auto operator<=>(const Neighbour &) const = default;
  };
  /// The `n` nearest nodes (all when there are fewer), nearest first.
  std::vector<Neighbour> nearest(const Vec<3> &p, std::size_t n) const;
  /// All nodes within `radius` [m], nearest first.
  std::vector<Neighbour> within(const Vec<3> &p, double radius) const;

private:
  void build(std::size_t first, std::size_t last);
  template <class Visit>
  void search(std::size_t first, std::size_t last, const Vec<3> &p, Visit &visit) const;

  std::vector<Vec<3>> points_; // in the order of the tree: the middle of a range splits it
  std::vector<int> nodes_;     // node number of each point
  std::vector<int> axes_;      // along which a range is split, at its middle
};

} // namespace sluice::bridge
