// SPDX-License-Identifier: MIT
// The wetted surface: a node set of the deck <-> the interface mesh of the bridge.
//
// Its faces are the outer faces of elements with all their nodes in the set. In two dimensions the
// body is a slab along z: nodes of the set with the same x and y are one interface node, a face
// with two such places is a segment, and the planes z = constant are none. The force of an
// interface node [N per metre of depth] is shared by its nodes with weights that integrate a
// function linear between them over the depth, and their motion is the mean with the same weights:
// the virtual work is the same on both sides.
#pragma once

#include "bridge/calculix/deck.hpp"
#include "bridge/interface_mesh.hpp"

#include <span>

namespace sluice::calculix {

/// One value of three components per node of the deck; column: node number - 1.
using NodeField = Eigen::Matrix3Xd;

struct NodalForce {
  int node;
  Vec<3> force; ///< [N]
};

/// Part of an interface node that one node of the deck carries.
struct Share {
  int node;
  double weight; ///< those of one interface node sum to one
};

struct Interface {
  bridge::InterfaceMesh mesh;             ///< fluid on the left of a segment, in front of a face
  std::vector<std::vector<Share>> shares; ///< per interface node
  double depth = 1;                       ///< [m] by which a force per metre is multiplied; 3-D: 1

  /// Forces of the bridge [N; 2-D: N/m], mesh.dim per interface node, as forces on deck nodes.
  std::vector<NodalForce> scatter(std::span<const double> forces) const;
  /// The inverse: what the deck's nodes carry, summed to interface nodes [N; 2-D: N/m].
  std::vector<double> collect(std::span<const NodalForce> forces) const;
  /// A field at the interface nodes, mesh.dim per node.
  std::vector<double> gather(const NodeField &field) const;
};

/// Throws UserError when the set does not exist, holds nodes without a face, or (2-D) has no depth.
Interface interface_of(const Deck &deck, std::string_view set, int dim);

} // namespace sluice::calculix
