// SPDX-License-Identifier: MIT
// The wetted boundary: body nodes <-> interface nodes, and the mesh that the bridge gets.
//
// For the gate the wetted faces are its front, lower edge and back. The nodes of the clamped edge
// belong to them, so that no load is lost at a corner; what acts on those goes into the support.
//
// A column of hexahedra may meet a plane partner: an interface node is then a row of body nodes
// along z. It moves as their mean over the depth, and a force per metre of depth is spread over
// them with the same weights times the depth, so that both sides do the same work (per metre).
#pragma once

#include "bridge/interface_mesh.hpp"
#include "solid-dealii/discretisation.hpp"

#include <span>
#include <string>
#include <vector>

namespace sluice::solid {

template <int dim> struct Interface {
  std::vector<int> nodes;      ///< body nodes, nodes_per_row for every interface node
  std::vector<double> weights; ///< of the body nodes of every row; they sum to one
  int nodes_per_row = 1;
  double depth = 1;           ///< [m] over which a force per metre acts; 1 where forces are forces
  bridge::InterfaceMesh mesh; ///< fluid on the left of a segment, in front of a quadrilateral

  int n_nodes() const { return static_cast<int>(nodes.size()) / nodes_per_row; }
  /// A nodal field of the body at the interface nodes, mesh.dim components per node.
  std::vector<double> gather(const Eigen::VectorXd &field) const;
  /// A load of the body at the interface nodes [N], per metre of depth for a plane partner.
  std::vector<double> gather_forces(const Eigen::VectorXd &load) const;
  /// Nodal forces [N] of the interface as a load on all components of the body.
  Eigen::VectorXd scatter(std::span<const double> forces, int n_dofs) const;
};

/// Faces of second-order elements are divided into linear ones between their nodes.
template <int dim>
Interface<dim> wetted_interface(const Discretisation<dim> &discretisation,
                                const std::vector<int> &wetted_faces);
/// Of a box: all sides in the plane but the clamped one.
template <int dim>
Interface<dim> wetted_interface(const Discretisation<dim> &discretisation, Side clamped);

/// The same for a column of hexahedra, all of whose sections z = constant are one mesh, as a plane
/// partner meets it. Throws UserError where the sections differ.
Interface<3> plane_interface(const Discretisation<3> &discretisation,
                             const std::vector<int> &wetted_faces);

/// The free end, opposite to the clamped side: its two corners and its middle. `front` is the
/// corner of smaller x (of smaller y on a vertical end); in three dimensions in the near plane.
/// On several ranks a node is -1 on all but one; its displacement is the same on all.
template <int dim> struct FreeEnd {
  int front = 0, back = 0;                 ///< nodes
  int before_middle = 0, after_middle = 0; ///< the nodes on both sides of the middle
  double weight_after = 0;                 ///< of the latter in linear interpolation
  Ranks ranks;

  Vec<dim> at(const Eigen::VectorXd &field, int node) const {
    return ranks.sum(node < 0 ? Vec<dim>(Vec<dim>::Zero())
                              : Vec<dim>(field.template segment<dim>(dim * node)));
  }
  Vec<dim> middle(const Eigen::VectorXd &field) const {
    return (1 - weight_after) * at(field, before_middle) + weight_after * at(field, after_middle);
  }
};

template <int dim> FreeEnd<dim> free_end(const Discretisation<dim> &discretisation, Side clamped);

} // namespace sluice::solid
