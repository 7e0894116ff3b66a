// SPDX-License-Identifier: MIT
// The wetted boundary: body nodes <-> interface nodes, and the mesh that the bridge gets.
//
// Wetted is every side in the plane but the clamped one: for the gate its front face, lower edge
// and back face. The nodes of the clamped edge belong to it, so that no load is lost; what acts on
// them goes into the support.
#pragma once

#include "bridge/interface_mesh.hpp"
#include "solid-dealii/discretisation.hpp"

#include <span>
#include <string>
#include <vector>

namespace sluice::solid {

template <int dim> struct Interface {
  std::vector<int> nodes;     ///< body node of every interface node
  bridge::InterfaceMesh mesh; ///< fluid on the left of a segment, in front of a quadrilateral

  /// A nodal field of the body at the interface nodes, dim components per node.
  std::vector<double> gather(const Eigen::VectorXd &field) const;
  /// Nodal forces [N] of the interface as a load on all components of the body.
  Eigen::VectorXd scatter(std::span<const double> forces, int n_dofs) const;
};

/// Faces of second-order elements are divided into linear ones between their nodes.
template <int dim>
Interface<dim> wetted_interface(const Discretisation<dim> &discretisation, Side clamped);

/// The free end, opposite to the clamped side: its two corners and its middle. `front` is the
/// corner of smaller x (of smaller y on a vertical end); in three dimensions in the near plane.
template <int dim> struct FreeEnd {
  int front = 0, back = 0;                 ///< nodes
  int before_middle = 0, after_middle = 0; ///< the nodes on both sides of the middle
  double weight_after = 0;                 ///< of the latter in linear interpolation

  Vec<dim> at(const Eigen::VectorXd &field, int node) const {
    return field.template segment<dim>(dim * node);
  }
  Vec<dim> middle(const Eigen::VectorXd &field) const {
    return (1 - weight_after) * at(field, before_middle) + weight_after * at(field, after_middle);
  }
};

template <int dim> FreeEnd<dim> free_end(const Discretisation<dim> &discretisation, Side clamped);

} // namespace sluice::solid
