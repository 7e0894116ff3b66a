// SPDX-License-Identifier: MIT
// The wetted boundary of a body on several ranks as its partner meets it: the faces of all ranks
// and every node once, on the root, which speaks to the bridge. On one rank it is that rank's
// interface as it stands.
#pragma once

#include "solid-dealii/interface.hpp"

namespace sluice::solid {

template <int dim> class InterfaceOfRanks {
public:
  /// `part` is of the faces that this rank holds; throws UserError where it meets a plane partner
  /// on several ranks, as a row of nodes along z may cross them.
  InterfaceOfRanks(Interface<dim> part, const Discretisation<dim> &discretisation);

  /// Of the body on the root, empty elsewhere.
  const bridge::InterfaceMesh &mesh() const { return mesh_; }
  /// A nodal field at the interface nodes, and a load there (Interface): on the root, empty
  /// elsewhere.
  std::vector<double> gather(const Eigen::VectorXd &field) const {
    return to_root(part_.gather(field));
  }
  std::vector<double> gather_forces(const Eigen::VectorXd &load) const {
    return to_root(part_.gather_forces(load));
  }
  /// The root's nodal forces as a load on the components that this rank holds.
  Eigen::VectorXd scatter(std::span<const double> of_root) const;

private:
  std::vector<double> to_root(const std::vector<double> &of_part) const;

  const Discretisation<dim> &discretisation_;
  Interface<dim> part_;
  bridge::InterfaceMesh mesh_;
  std::vector<int> told_;                // nodes of the part that this rank tells the root about
  std::vector<std::vector<int>> places_; // on the root: of those of every rank in mesh_
};

} // namespace sluice::solid
