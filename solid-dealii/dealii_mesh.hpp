// SPDX-License-Identifier: MIT
// The deal.II objects behind Discretisation; included by the two files that call deal.II.
#pragma once

#include "solid-dealii/discretisation.hpp"

#include <deal.II/dofs/dof_handler.h>
#include <deal.II/fe/fe_q.h>
#include <deal.II/grid/filtered_iterator.h>
#include <deal.II/grid/tria.h>

namespace sluice::solid {

template <int dim> struct DealiiMesh {
  explicit DealiiMesh(int degree) : element(static_cast<unsigned int>(degree)) {}
  /// On several ranks a parallel::fullydistributed one: own cells and their neighbours.
  std::unique_ptr<dealii::Triangulation<dim>> triangulation;
  dealii::FE_Q<dim> element; ///< scalar: one degree of freedom per node
  dealii::DoFHandler<dim> nodes;

  /// Those of this rank; all cells on one. In the order of Discretisation's.
  auto own_cells() const {
    return nodes.active_cell_iterators() | dealii::IteratorFilters::LocallyOwnedCell();
  }
};

} // namespace sluice::solid
