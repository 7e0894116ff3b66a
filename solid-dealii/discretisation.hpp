// SPDX-License-Identifier: MIT
// From a box or a mesh file of quadrilaterals or hexahedra to what the kernels need: node
// positions, cells, and the gradients of shape functions and incompatible modes in the reference
// configuration, computed once. deal.II makes the mesh, cuts it where there are several ranks,
// numbers the nodes and integrates; its headers stay behind this one.
#pragma once

#include "solid-dealii/element.hpp"
#include "solid-dealii/mesh_file.hpp"
#include "solid-dealii/shared_entries.hpp"

#include <array>
#include <functional>
#include <memory>
#include <vector>

namespace sluice::solid {

/// Sides of a box; the values are deal.II's boundary ids of a colorized box. A face of a mesh from
/// a file is on no side: its parts of the boundary have the names of the file.
enum class Side : int { left = 0, right = 1, lower = 2, upper = 3, near = 4, far = 5, none = 6 };

/// The name of a side as a boundary: "left", "right", "lower", "upper", "near" or "far".
const char *name_of(Side side);

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

/// Of the whole body, or of the part that this rank holds: its cells with all their nodes.
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
  std::vector<double> pressure_basis;   ///< [cell][point][function], q2-p1 only (element_mixed.hpp)
  std::vector<BoundaryFace<dim>> faces; ///< of the whole boundary
  std::vector<BoundaryPoint<dim>> boundary_points; ///< points_per_face for every face, in order
  int points_per_face = 0;
  std::map<std::string, std::vector<int>> boundaries; ///< faces of every named part of the boundary
  std::shared_ptr<const DealiiMesh<dim>> mesh;
  Ranks ranks;                      ///< that share the body
  std::vector<double> node_numbers; ///< of the nodes here among all of the body, ascending
  SharedEntries components;         ///< of vectors with dim entries per node

  int n_cells() const { return static_cast<int>(cell_nodes.size()) / nodes_per_cell; }
  int n_nodes() const { return static_cast<int>(nodes.size()); }
  int n_dofs() const { return dim * n_nodes(); }
  int n_modes() const { return dim * modes_per_cell * n_cells(); }
  int columns() const { return nodes_per_cell + modes_per_cell; }
  /// Cells on all ranks.
  long n_cells_of_all() const { return std::lround(ranks.sum(n_cells())); }
  /// Nodes of one side, each once, in ascending number.
  std::vector<int> side_nodes(Side side) const { return nodes_of(boundary(name_of(side))); }
  /// Faces of a named part of the boundary. Throws UserError that lists the names there are.
  const std::vector<int> &boundary(const std::string &name) const;
  /// Nodes of some faces, each once, in ascending number.
  std::vector<int> nodes_of(const std::vector<int> &some_faces) const;
  /// The node nearest to a position [m]: its number on one of the ranks that hold it, -1 on others.
  int nearest_node(const Vec<dim> &position) const;
  /// A nodal field at such a node, the same on every rank.
  Vec<dim> at(const Eigen::VectorXd &field, int node) const {
    return ranks.sum(node < 0 ? Vec<dim>(Vec<dim>::Zero())
                              : Vec<dim>(field.template segment<dim>(dim * node)));
  }
};

/// Throws UserError for a box without extent or cells, or whose cells are inverted by `shape`.
template <int dim>
Discretisation<dim> discretise(const Box<dim> &box, ElementKind kind, const Ranks &ranks = {});

/// The same for a mesh from a file, whose cells may be numbered in either sense. Throws UserError
/// for cells without volume, and for a named part of the boundary that has no face.
template <int dim>
Discretisation<dim> discretise(const MeshFile &mesh, ElementKind kind, const Ranks &ranks = {});

} // namespace sluice::solid
