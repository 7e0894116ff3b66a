// SPDX-License-Identifier: MIT
#include "solid-dealii/dealii_mesh.hpp"
#include "solid-dealii/ranks_mpi.hpp"

#include <deal.II/base/multithread_info.h>
#include <deal.II/base/quadrature_lib.h>
#include <deal.II/distributed/fully_distributed_tria.h>
#include <deal.II/dofs/dof_tools.h>
#include <deal.II/fe/fe_tools.h>
#include <deal.II/fe/fe_values.h>
#include <deal.II/fe/mapping_q1.h>
#include <deal.II/grid/grid_generator.h>
#include <deal.II/grid/grid_tools.h>
#include <deal.II/grid/tria_description.h>

#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>
#include <map>

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

// Files number corners in either sense: counter-clockwise, lower side first, makes volume positive.
void turn_outward(const MeshFile &mesh, std::vector<int> &corners) {
  const auto from_first = [&](std::size_t k) -> Vec<3> {
    return mesh.points[static_cast<std::size_t>(corners[k])] -
           mesh.points[static_cast<std::size_t>(corners[0])];
  };
  const Vec<3> area = from_first(2).cross(from_first(3)) + from_first(1).cross(from_first(2));
  if (corners.size() == 4 && area.z() < 0)
    std::reverse(corners.begin(), corners.end());
  if (corners.size() == 8 && area.dot(from_first(4) + from_first(6) - from_first(2)) < 0)
    std::rotate(corners.begin(), corners.begin() + 4, corners.end());
}

// A mesh file's cells as deal.II numbers corners: lexicographically, and every line of the mesh in
// one direction from both sides.
template <int dim> void make_triangulation(const MeshFile &mesh, dealii::Triangulation<dim> &grid) {
  std::vector<dealii::Point<dim>> points;
  for (const auto &x : mesh.points)
    points.push_back(to_point<dim>(x.template head<dim>()));
  std::vector<dealii::CellData<dim>> cells;
  for (std::vector<int> corners : mesh.cells) {
    turn_outward(mesh, corners);
    dealii::CellData<dim> cell(corners.size());
    for (std::size_t k = 0; k < corners.size(); ++k) {
      constexpr std::size_t from_ring[4] = {0, 1, 3, 2};
      cell.vertices[k] = static_cast<unsigned int>(corners[k / 4 * 4 + from_ring[k % 4]]);
    }
    cells.push_back(cell);
  }
  dealii::SubCellData none;
  dealii::GridTools::delete_unused_vertices(points, cells, none);
  dealii::GridTools::consistently_order_cells(cells);
  grid.create_triangulation(points, cells, none);
}

// The whole body, or this rank's part of it. Every rank makes the whole mesh once, to cut it as the
// others do (METIS, by the graph of the cells), and keeps its part.
template <int dim, class Source>
std::unique_ptr<dealii::Triangulation<dim>> part_of(const Source &source, const Ranks &ranks) {
  auto whole = std::make_unique<dealii::Triangulation<dim>>();
  make_triangulation(source, *whole);
  if (ranks.is_one())
    return whole;
  check(static_cast<int>(whole->n_active_cells()) >= ranks.size(),
        "solid: {} cells cannot be shared by {} ranks; take fewer", whole->n_active_cells(),
        ranks.size());
  const MPI_Comm communicator = mpi_communicator(ranks);
  dealii::GridTools::partition_triangulation(static_cast<unsigned int>(ranks.size()), *whole);
  auto part =
      std::make_unique<dealii::parallel::fullydistributed::Triangulation<dim>>(communicator);
  part->create_triangulation(
      dealii::TriangulationDescription::Utilities::create_description_from_triangulation(
          *whole, communicator));
  return part;
}

// Makes all of a Discretisation from the mesh; one object so that the passes share FEValues'
// inputs.
template <int dim> class Builder {
public:
  template <class Source> Builder(const Source &source, ElementKind kind, const Ranks &ranks) {
    // With tasks the last bit of the set-up depends on how many threads there are.
    dealii::MultithreadInfo::set_thread_limit(1);
    result_.kind = kind;
    result_.degree = degree_of(kind);
    result_.ranks = ranks;
    mesh_ = std::make_shared<DealiiMesh<dim>>(result_.degree);
    mesh_->triangulation = part_of<dim>(source, ranks);
    mesh_->nodes.reinit(*mesh_->triangulation);
    mesh_->nodes.distribute_dofs(mesh_->element);
    own_nodes_ = dealii::DoFTools::extract_locally_active_dofs(mesh_->nodes);
  }

  Discretisation<dim> build(const Box<dim> &) {
    integrate();
    for (int side = 0; side < 2 * dim; ++side) // a part of the body may have no face there
      result_.boundaries[name_of(static_cast<Side>(side))];
    for (std::size_t f = 0; f < result_.faces.size(); ++f)
      result_.boundaries[name_of(result_.faces[f].side)].push_back(static_cast<int>(f));
    return finish();
  }

  Discretisation<dim> build(const MeshFile &mesh) {
    integrate();
    for (auto &face : result_.faces)
      face.side = Side::none;
    for (const auto &[name, set] : mesh.node_sets)
      name_faces(
          name,
          [&, &nodes = set](const std::vector<int> &corners) {
            return std::all_of(corners.begin(), corners.end(),
                               [&](int corner) { return nodes.contains(corner); });
          },
          mesh);
    for (const auto &[name, set] : mesh.face_sets)
      name_faces(
          name,
          [&, &faces = set](const std::vector<int> &corners) { return faces.contains(corners); },
          mesh);
    return finish();
  }

private:
  void integrate() {
    set_sizes();
    integrate_cells();
    collect_boundary();
  }
  Discretisation<dim> finish() {
    std::vector<double> components;
    for (const auto number : own_nodes_) {
      result_.node_numbers.push_back(static_cast<double>(number));
      for (int c = 0; c < dim; ++c)
        components.push_back(static_cast<double>(dim * number) + c);
    }
    result_.components = SharedEntries(result_.ranks, components);
    result_.mesh = std::move(mesh_);
    return std::move(result_);
  }

  int local(dealii::types::global_dof_index node) const {
    return static_cast<int>(own_nodes_.index_within_set(node));
  }

  // deal.II may have left out points of the file that no cell uses, so corners are found by place.
  template <class IsNamed>
  void name_faces(const std::string &name, const IsNamed &is_named, const MeshFile &mesh) {
    if (point_of_vertex_.empty())
      match_points(mesh);
    std::vector<int> &faces = result_.boundaries[name];
    for (std::size_t f = 0; f < result_.faces.size(); ++f)
      if (is_named(corners_[f]))
        faces.push_back(static_cast<int>(f));
    if (result_.ranks.sum(static_cast<double>(faces.size())) == 0)
      result_.boundaries.erase(name); // a set of cells or of inner nodes names no boundary
  }

  void match_points(const MeshFile &mesh) {
    const auto less = [](const Vec<3> &a, const Vec<3> &b) {
      return std::lexicographical_compare(a.begin(), a.end(), b.begin(), b.end());
    };
    std::map<Vec<3>, int, decltype(less)> index(less);
    for (const auto &cell : mesh.cells)
      for (const int corner : cell) {
        Vec<3> x = mesh.points[static_cast<std::size_t>(corner)];
        if constexpr (dim == 2)
          x.z() = 0;
        const auto [at, is_new] = index.try_emplace(x, corner);
        check(is_new || at->second == corner,
              "solid: points {} and {} of the mesh lie on the same place ({:.6g}, {:.6g}, {:.6g}); "
              "merge duplicate nodes",
              at->second, corner, x.x(), x.y(), x.z());
      }
    for (const auto &vertex : mesh_->triangulation->get_vertices()) {
      Vec<3> x = Vec<3>::Zero();
      x.template head<dim>() = to_vec<dim>(vertex);
      point_of_vertex_.push_back(index.at(x));
    }
    for (const auto &cell : mesh_->own_cells())
      for (const unsigned int f : cell->face_indices())
        if (cell->face(f)->at_boundary()) {
          std::vector<int> corners;
          for (unsigned int v = 0; v < cell->face(f)->n_vertices(); ++v)
            corners.push_back(point_of_vertex_[cell->face(f)->vertex_index(v)]);
          std::sort(corners.begin(), corners.end());
          corners_.push_back(std::move(corners));
        }
  }

  void set_sizes() {
    with_element<dim>(result_.kind, [this]<int nodes, int modes>() {
      result_.nodes_per_cell = nodes;
      result_.modes_per_cell = modes;
    });
    result_.points_per_cell = static_cast<int>(quadrature().size());
    result_.nodes.resize(own_nodes_.n_elements());
  }

  // degree + 1 Gauss points per axis: exact for the mass matrix of a parallelepiped.
  dealii::QGauss<dim> quadrature() const {
    return dealii::QGauss<dim>(static_cast<unsigned int>(result_.degree + 1));
  }

  void integrate_cells() {
    using namespace dealii;
    const auto points = quadrature();
    FEValues<dim> fe(mapping_, mesh_->element, points,
                     update_values | update_gradients | update_JxW_values | update_jacobians |
                         update_quadrature_points);
    FEValues<dim> centre(mapping_, mesh_->element, QMidpoint<dim>(), update_jacobians);
    std::vector<types::global_dof_index> numbers(mesh_->element.n_dofs_per_cell());
    for (const auto &cell : mesh_->own_cells()) {
      fe.reinit(cell);
      centre.reinit(cell);
      cell->get_dof_indices(numbers);
      add_nodes(*cell, numbers);
      for (unsigned int q = 0; q < points.size(); ++q)
        add_point(fe, q, points.point(q), centre.jacobian(0));
      if (result_.kind == ElementKind::q2_p1)
        add_pressure_basis(fe);
    }
    add_values(fe);
  }

  template <class Cell>
  void add_nodes(const Cell &cell, const std::vector<dealii::types::global_dof_index> &numbers) {
    for (unsigned int k = 0; k < numbers.size(); ++k) {
      const auto unit = mesh_->element.unit_support_point(k);
      const int node = local(numbers[k]);
      result_.nodes[static_cast<std::size_t>(node)] =
          to_vec<dim>(mapping_.transform_unit_to_real_cell(
              typename dealii::Triangulation<dim>::cell_iterator(cell), unit));
      result_.cell_nodes.push_back(node);
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

  // 1, x, y(, z) made orthonormal over the cell by its own quadrature: functions of position, not
  // of the unit cell, or the element would lose an order on cells that are no parallelepipeds.
  void add_pressure_basis(const dealii::FEValues<dim> &fe) {
    const auto n = static_cast<Eigen::Index>(fe.n_quadrature_points);
    const Eigen::Map<const Eigen::VectorXd> weights(
        result_.weights.data() + static_cast<Eigen::Index>(result_.weights.size()) - n, n);
    Eigen::MatrixXd functions = Eigen::MatrixXd::Ones(n, dim + 1);
    for (Eigen::Index q = 0; q < n; ++q)
      functions.row(q).tail(dim) =
          to_vec<dim>(fe.quadrature_point(static_cast<unsigned int>(q))).transpose();
    const double volume = weights.sum();
    for (int i = 0; i <= dim; ++i) {
      if (i > 0) // about the centre first: far from the origin 1 and x are nearly the same
        functions.col(i).array() -= weights.dot(functions.col(i)) / volume;
      for (int k = 0; k < i; ++k)
        functions.col(i) -=
            weights.dot(functions.col(i).cwiseProduct(functions.col(k))) * functions.col(k);
      functions.col(i) /= std::sqrt(weights.dot(functions.col(i).cwiseAbs2()));
    }
    for (Eigen::Index q = 0; q < n; ++q)
      for (int i = 0; i <= dim; ++i)
        result_.pressure_basis.push_back(functions(q, i));
  }

  void add_values(const dealii::FEValues<dim> &fe) {
    for (unsigned int q = 0; q < fe.n_quadrature_points; ++q)
      for (unsigned int k = 0; k < fe.dofs_per_cell; ++k)
        result_.values.push_back(fe.shape_value(k, q));
  }

  void collect_boundary() {
    using namespace dealii;
    const QGauss<dim - 1> points(static_cast<unsigned int>(result_.degree + 1));
    result_.points_per_face = static_cast<int>(points.size());
    FEFaceValues<dim> fe(mapping_, mesh_->element, points,
                         update_values | update_gradients | update_JxW_values |
                             update_normal_vectors | update_quadrature_points);
    int number = 0;
    for (const auto &cell : mesh_->own_cells()) {
      for (const unsigned int f : cell->face_indices())
        if (cell->face(f)->at_boundary()) {
          fe.reinit(cell, f);
          add_face(number, f, static_cast<Side>(cell->face(f)->boundary_id()), fe);
        }
      ++number;
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
  dealii::IndexSet own_nodes_; // of the body's, those of the cells here
  Discretisation<dim> result_;
  std::vector<int> point_of_vertex_;      // of the file, for every vertex of deal.II
  std::vector<std::vector<int>> corners_; // sorted points of the file, for every boundary face
};

} // namespace

const char *name_of(Side side) {
  constexpr const char *names[] = {"left", "right", "lower", "upper", "near", "far", "none"};
  return names[static_cast<int>(side)];
}

template <int dim>
const std::vector<int> &Discretisation<dim>::boundary(const std::string &name) const {
  const auto found = boundaries.find(name);
  if (found != boundaries.end())
    return found->second;
  std::string known;
  for (const auto &[there, faces_there] : boundaries)
    known += fmt::format("{}{} ({} faces)", known.empty() ? "" : ", ", there, faces_there.size());
  fail("solid: the mesh has no boundary '{}'; it has {}", name,
       known.empty() ? "no named boundary at all" : known);
}

template <int dim>
std::vector<int> Discretisation<dim>::nodes_of(const std::vector<int> &some_faces) const {
  std::vector<int> found;
  for (const int f : some_faces) {
    const auto &of_face = faces[static_cast<std::size_t>(f)].nodes;
    found.insert(found.end(), of_face.begin(), of_face.end());
  }
  std::sort(found.begin(), found.end());
  found.erase(std::unique(found.begin(), found.end()), found.end());
  return found;
}

template <int dim> int Discretisation<dim>::nearest_node(const Vec<dim> &position) const {
  const auto nearest =
      std::min_element(nodes.begin(), nodes.end(), [&](const Vec<dim> &a, const Vec<dim> &b) {
        return (a - position).squaredNorm() < (b - position).squaredNorm();
      });
  const double distance = (*nearest - position).squaredNorm();
  const bool is_nearest = distance == ranks.min(distance);
  const double lowest = ranks.min(is_nearest ? ranks.rank() : ranks.size());
  return ranks.rank() == lowest ? static_cast<int>(nearest - nodes.begin()) : -1;
}

template <int dim>
Discretisation<dim> discretise(const Box<dim> &box, ElementKind kind, const Ranks &ranks) {
  check_box(box);
  return Builder<dim>(box, kind, ranks).build(box);
}

template <int dim>
Discretisation<dim> discretise(const MeshFile &mesh, ElementKind kind, const Ranks &ranks) {
  return Builder<dim>(mesh, kind, ranks).build(mesh);
}

template struct Discretisation<2>;
template struct Discretisation<3>;
template Discretisation<2> discretise(const Box<2> &, ElementKind, const Ranks &);
template Discretisation<3> discretise(const Box<3> &, ElementKind, const Ranks &);
template Discretisation<2> discretise<2>(const MeshFile &, ElementKind, const Ranks &);
template Discretisation<3> discretise<3>(const MeshFile &, ElementKind, const Ranks &);

} // namespace sluice::solid
