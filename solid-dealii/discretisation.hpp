// SPDX-License-Identifier: MIT
// From a box of quadrilaterals or hexahedra to what the kernels need: node positions, cells, and
// the gradients of shape functions and incompatible modes in the reference configuration, computed
// once. deal.II makes the mesh, numbers the nodes and integrates; its headers stay behind this one.
#pragma once

#include "solid-dealii/element.hpp"

#include <array>
#include <functional>
#include <memory>
#include <vector>

namespace sluice::solid {

/// Sides of a box; the values are deal.II's boundary ids of a colorized box.
enum class Side : int { left = 0, right = 1, lower = 2, upper = 3, near = 4, far = 5 };

/// A box of equal cells; `shape`, when given, then moves every vertex (for distorted meshes).
template <int dim> struct Box {
  Vec<dim> corner;               ///< [m] lower left (near) corner
  Vec<dim> size;                 ///< [m]
  std::array<int, dim> elements; ///< along x, y (, z)
  std::function<Vec<dim>(const Vec<dim> &)> shape = {};
};

/// One cell face on the boundary; `nodes` run over its lattice, first axis fastest.
template <int dim> struct BoundaryFace {
  Side side;
  int cell;
  std::vector<int> nodes; ///< (degree + 1)^(dim - 1) of them
  Vec<dim> normal;        ///< outward unit normal at its centre
};

/// One quadrature point on the boundary, for surface loads.
template <int dim> struct BoundaryPoint {
  Side side;
  int cell;
  Vec<dim> position;                      ///< [m] in the reference configuration
  Vec<dim> normal;                        ///< outward unit normal
  double weight;                          ///< [m^(dim-1)]
  Eigen::VectorXd values;                 ///< shape functions of the cell's nodes
  Columns<dim, Eigen::Dynamic> gradients; ///< [1/m], one column per node of the cell
};

/// deal.II's triangulation and degrees of freedom; defined in dealii_mesh.hpp.
template <int dim> struct DealiiMesh;

template <int dim> struct Discretisation {
  ElementKind kind = ElementKind::incompatible_modes;
  int degree = 1;
  int nodes_per_cell = 0;
  int modes_per_cell = 0;
  int points_per_cell = 0;
  std::vector<Vec<dim>> nodes;          ///< [m] reference positions
  std::vector<int> cell_nodes;          ///< nodes_per_cell per cell
  std::vector<double> gradients;        ///< [cell][point][column][component] [1/m]
  std::vector<double> weights;          ///< [cell][point] [m^dim]
  std::vector<double> values;           ///< [point][node] shape functions
  std::vector<BoundaryFace<dim>> faces; ///< of the whole boundary
  std::vector<BoundaryPoint<dim>> boundary_points;
  std::shared_ptr<const DealiiMesh<dim>> mesh;

  int n_cells() const { return static_cast<int>(cell_nodes.size()) / nodes_per_cell; }
  int n_nodes() const { return static_cast<int>(nodes.size()); }
  int n_dofs() const { return dim * n_nodes(); }
  int n_modes() const { return dim * modes_per_cell * n_cells(); }
  int columns() const { return nodes_per_cell + modes_per_cell; }
  /// Nodes of one side, each once, in ascending number.
  std::vector<int> side_nodes(Side side) const;
};

/// Throws UserError for a box without extent or cells, or whose cells are inverted by `shape`.
template <int dim> Discretisation<dim> discretise(const Box<dim> &box, ElementKind kind);

} // namespace sluice::solid
