// SPDX-License-Identifier: MIT
// The deal.II objects behind Discretisation; included by the two files that call deal.II.
#pragma once

#include "solid-dealii/discretisation.hpp"

#include <deal.II/dofs/dof_handler.h>
#include <deal.II/fe/fe_q.h>
#include <deal.II/grid/tria.h>

namespace sluice::solid {

template <int dim> struct DealiiMesh {
  explicit DealiiMesh(int degree) : element(static_cast<unsigned int>(degree)) {}
  dealii::Triangulation<dim> triangulation;
  dealii::FE_Q<dim> element; ///< scalar: one degree of freedom per node
  dealii::DoFHandler<dim> nodes;
};

} // namespace sluice::solid
