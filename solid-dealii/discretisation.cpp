// SPDX-License-Identifier: MIT
#include "solid-dealii/dealii_mesh.hpp"

#include <deal.II/base/multithread_info.h>
#include <deal.II/base/quadrature_lib.h>
#include <deal.II/fe/fe_tools.h>
#include <deal.II/fe/fe_values.h>
#include <deal.II/fe/mapping_q1.h>
#include <deal.II/grid/grid_generator.h>
#include <deal.II/grid/grid_tools.h>

#include <algorithm>
#include <cmath>

namespace sluice::solid {
namespace {

template <int dim> Vec<dim> to_vec(const dealii::Tensor<1, dim> &t) {
  Vec<dim> v;
  for (int d = 0; d < dim; ++d)
    v[d] = t[static_cast<unsigned int>(d)];
  return v;
}

template <int dim> dealii::Point<dim> to_point(const Vec<dim> &v) {
  dealii::Point<dim> p;
  for (int d = 0; d < dim; ++d)
    p[static_cast<unsigned int>(d)] = v[d];
  return p;
}

template <int dim> void check_box(const Box<dim> &box) {
  for (int d = 0; d < dim; ++d) {
    check(box.size[d] > 0, "solid: size of the box along axis {} is {} m; it must be positive", d,
          box.size[d]);
    check(box.elements[static_cast<std::size_t>(d)] > 0,
          "solid: {} elements along axis {}; at least one is needed",
          box.elements[static_cast<std::size_t>(d)], d);
  }
}

template <int dim> void make_triangulation(const Box<dim> &box, dealii::Triangulation<dim> &grid) {
  const std::vector<unsigned int> repetitions(box.elements.begin(), box.elements.end());
  dealii::GridGenerator::subdivided_hyper_rectangle(grid, repetitions, to_point<dim>(box.corner),
                                                    to_point<dim>(box.corner + box.size), true);
  if (box.shape)
    dealii::GridTools::transform(
        [&](const dealii::Point<dim> &p) { return to_point<dim>(box.shape(to_vec<dim>(p))); },
        grid);
}

// Makes all of a Discretisation from the mesh; one object so that the passes share FEValues'
// inputs.
template <int dim> class Builder {
public:
  Builder(const Box<dim> &box, ElementKind kind) {
    // With tasks the last bit of the set-up depends on how many threads there are.
    dealii::MultithreadInfo::set_thread_limit(1);
    check_box(box);
    result_.kind = kind;
    result_.degree = kind == ElementKind::q2 ? 2 : 1;
    mesh_ = std::make_shared<DealiiMesh<dim>>(result_.degree);
    make_triangulation(box, mesh_->triangulation);
    mesh_->nodes.reinit(mesh_->triangulation);
    mesh_->nodes.distribute_dofs(mesh_->element);
  }

  Discretisation<dim> build() {
    set_sizes();
    integrate_cells();
    collect_boundary();
    result_.mesh = std::move(mesh_);
    return std::move(result_);
  }

private:
  void set_sizes() {
    with_element<dim>(result_.kind, [this]<int nodes, int modes>() {
      result_.nodes_per_cell = nodes;
      result_.modes_per_cell = modes;
    });
    result_.points_per_cell = static_cast<int>(quadrature().size());
    result_.nodes.resize(mesh_->nodes.n_dofs());
  }

  // degree + 1 Gauss points per axis: exact for the mass matrix of a parallelepiped.
  dealii::QGauss<dim> quadrature() const {
    return dealii::QGauss<dim>(static_cast<unsigned int>(result_.degree + 1));
  }

  void integrate_cells() {
    using namespace dealii;
    const auto points = quadrature();
    FEValues<dim> fe(mapping_, mesh_->element, points,
                     update_values | update_gradients | update_JxW_values | update_jacobians);
    FEValues<dim> centre(mapping_, mesh_->element, QMidpoint<dim>(), update_jacobians);
    std::vector<types::global_dof_index> numbers(mesh_->element.n_dofs_per_cell());
    for (const auto &cell : mesh_->nodes.active_cell_iterators()) {
      fe.reinit(cell);
      centre.reinit(cell);
      cell->get_dof_indices(numbers);
      add_nodes(*cell, numbers);
      for (unsigned int q = 0; q < points.size(); ++q)
        add_point(fe, q, points.point(q), centre.jacobian(0));
    }
    add_values(fe);
  }

  template <class Cell>
  void add_nodes(const Cell &cell, const std::vector<dealii::types::global_dof_index> &numbers) {
    for (unsigned int k = 0; k < numbers.size(); ++k) {
      const auto unit = mesh_->element.unit_support_point(k);
      result_.nodes[numbers[k]] = to_vec<dim>(mapping_.transform_unit_to_real_cell(
          typename dealii::Triangulation<dim>::cell_iterator(cell), unit));
      result_.cell_nodes.push_back(static_cast<int>(numbers[k]));
    }
  }

  void add_point(const dealii::FEValues<dim> &fe, unsigned int q, const dealii::Point<dim> &unit,
                 const dealii::DerivativeForm<1, dim, dim> &centre) {
    const double det = fe.jacobian(q).determinant();
    check(det > 0, "solid: cell {} of the mesh is inverted (Jacobian {:.3e})",
          result_.weights.size() / fe.n_quadrature_points, det);
    result_.weights.push_back(fe.JxW(q));
    for (unsigned int k = 0; k < fe.dofs_per_cell; ++k)
      add_gradient(fe.shape_grad(k, q));
    for (unsigned int d = 0; d < static_cast<unsigned int>(result_.modes_per_cell); ++d)
      add_gradient(mode_gradient(d, unit[d], centre, det));
  }

  void add_gradient(const dealii::Tensor<1, dim> &gradient) {
    for (unsigned int d = 0; d < dim; ++d)
      result_.gradients.push_back(gradient[d]);
  }

  // Mode d is 1 - xi_d^2 with xi = 2 s - 1, s in [0, 1] deal.II's coordinate; its gradient is taken
  // with the Jacobian of the centre and scaled by j_0/j, so that it integrates to zero over the
  // cell (Taylor, Beresford, Wilson 1976): then the patch test holds.
  static dealii::Tensor<1, dim> mode_gradient(unsigned int d, double s,
                                              const dealii::DerivativeForm<1, dim, dim> &centre,
                                              double det) {
    dealii::Tensor<1, dim> unit;
    unit[d] = -4 * (2 * s - 1);
    const double ratio = centre.determinant() / det;
    return ratio * dealii::apply_transformation(centre.covariant_form(), unit);
  }

  void add_values(const dealii::FEValues<dim> &fe) {
    for (unsigned int q = 0; q < fe.n_quadrature_points; ++q)
      for (unsigned int k = 0; k < fe.dofs_per_cell; ++k)
        result_.values.push_back(fe.shape_value(k, q));
  }

  void collect_boundary() {
    using namespace dealii;
    const QGauss<dim - 1> points(static_cast<unsigned int>(result_.degree + 1));
    FEFaceValues<dim> fe(mapping_, mesh_->element, points,
                         update_values | update_gradients | update_JxW_values |
                             update_normal_vectors | update_quadrature_points);
    for (const auto &cell : mesh_->nodes.active_cell_iterators())
      for (const unsigned int f : cell->face_indices())
        if (cell->face(f)->at_boundary()) {
          fe.reinit(cell, f);
          add_face(static_cast<int>(cell->active_cell_index()), f,
                   static_cast<Side>(cell->face(f)->boundary_id()), fe);
        }
  }

  void add_face(int cell, unsigned int f, Side side, const dealii::FEFaceValues<dim> &fe) {
    BoundaryFace<dim> face{side, cell, face_nodes(cell, f), Vec<dim>::Zero()};
    for (unsigned int q = 0; q < fe.n_quadrature_points; ++q) {
      BoundaryPoint<dim> point{side,
                               cell,
                               to_vec<dim>(fe.quadrature_point(q)),
                               to_vec<dim>(fe.normal_vector(q)),
                               fe.JxW(q),
                               Eigen::VectorXd(fe.dofs_per_cell),
                               Columns<dim, Eigen::Dynamic>(dim, fe.dofs_per_cell)};
      for (unsigned int k = 0; k < fe.dofs_per_cell; ++k) {
        point.values[k] = fe.shape_value(k, q);
        point.gradients.col(k) = to_vec<dim>(fe.shape_grad(k, q));
      }
      face.normal += point.normal;
      result_.boundary_points.push_back(std::move(point));
    }
    face.normal.normalize();
    result_.faces.push_back(std::move(face));
  }

  // Nodes of the cell's lattice whose index along axis f/2 is the first (f even) or the last.
  std::vector<int> face_nodes(int cell, unsigned int f) const {
    const int n = result_.degree + 1;
    const auto lattice = dealii::FETools::lexicographic_to_hierarchic_numbering<dim>(
        static_cast<unsigned int>(result_.degree));
    const int stride = static_cast<int>(std::lround(std::pow(n, f / 2)));
    const int wanted = f % 2 == 0 ? 0 : n - 1;
    std::vector<int> nodes;
    for (int k = 0; k < result_.nodes_per_cell; ++k)
      if (k / stride % n == wanted)
        nodes.push_back(result_.cell_nodes[static_cast<std::size_t>(
            cell * result_.nodes_per_cell +
            static_cast<int>(lattice[static_cast<std::size_t>(k)]))]);
    return nodes;
  }

  dealii::MappingQ1<dim> mapping_;
  std::shared_ptr<DealiiMesh<dim>> mesh_;
  Discretisation<dim> result_;
};

} // namespace

template <int dim> std::vector<int> Discretisation<dim>::side_nodes(Side side) const {
  std::vector<int> found;
  for (const auto &face : faces)
    if (face.side == side)
      found.insert(found.end(), face.nodes.begin(), face.nodes.end());
  std::sort(found.begin(), found.end());
  found.erase(std::unique(found.begin(), found.end()), found.end());
  return found;
}

template <int dim> Discretisation<dim> discretise(const Box<dim> &box, ElementKind kind) {
  return Builder<dim>(box, kind).build();
}

template struct Discretisation<2>;
template struct Discretisation<3>;
template Discretisation<2> discretise(const Box<2> &, ElementKind);
template Discretisation<3> discretise(const Box<3> &, ElementKind);

} // namespace sluice::solid
