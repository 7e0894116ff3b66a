// SPDX-License-Identifier: MIT
#include "solid-dealii/assembly.hpp"

#include "solid-dealii/cell_system.hpp"

#include <algorithm>
#include <cmath>

namespace sluice::solid {
namespace {

// Calls action(cell, q, F) at every point of the body.
template <int dim, class Action>
void for_each_point(const Discretisation<dim> &d, const Eigen::VectorXd &displacement,
                    const Eigen::VectorXd &mode_values, Action &&action) {
  with_element<dim>(d.kind, [&]<int nodes, int modes>() {
    constexpr int columns = nodes + modes;
    for (int cell = 0; cell < d.n_cells(); ++cell) {
      const auto u = gather<dim, nodes, modes>(d, cell, displacement, mode_values);
      for (int q = 0; q < d.points_per_cell; ++q)
        action(cell, q,
               deformation_gradient<dim, columns>(u, gradient_at<dim, columns>(d, cell, q)));
    }
  });
}

} // namespace

template <int dim>
Assembly<dim>::Assembly(const Discretisation<dim> &discretisation, Material material,
                        double density, const std::vector<bool> &fixed)
    : discretisation_(discretisation), material_(std::move(material)) {
  check(discretisation.kind != ElementKind::q2_p1 ||
            (material_.volume() && material_.plane == Plane::strain),
        "solid: the element q2-p1 needs a law with a volume energy of its own (neo-hookean-split, "
        "mooney-rivlin, yeoh or ogden) in plane strain or space; take another element or law");
  check(density > 0, "solid: density is {} kg/m^3; it must be positive", density);
  check(static_cast<int>(fixed.size()) == discretisation.n_dofs(),
        "solid: {} support conditions for {} displacement components", fixed.size(),
        discretisation.n_dofs());
  number_unknowns(fixed);
  build_pattern();
  build_mass(density);
  condensed_force_.resize(discretisation_.n_dofs());
  with_element<dim>(discretisation_.kind, [this]<int nodes, int modes>() {
    constexpr int size = decltype(Condensed<dim, nodes, modes>::recovery)::SizeAtCompileTime;
    recovery_.resize(static_cast<std::size_t>(size * discretisation_.n_cells()));
  });
  // Taken at rest once: near inversion it grows without limit and would excuse any residual.
  linearise(Eigen::VectorXd::Zero(discretisation_.n_dofs()),
            Eigen::VectorXd::Zero(discretisation_.n_modes()));
  stiffest_at_rest_ = stiffest_;
}

template <int dim> void Assembly<dim>::number_unknowns(const std::vector<bool> &fixed) {
  std::vector<double> numbers;
  for (std::size_t k = 0; k < fixed.size(); ++k) {
    unknown_of_.push_back(fixed[k] ? -1 : n_free_++);
    if (!fixed[k])
      numbers.push_back(dim * discretisation_.node_numbers[k / dim] + static_cast<double>(k % dim));
  }
  unknowns_ = SharedEntries(discretisation_.ranks, numbers);
  check(n_free_of_all() > 0, "solid: every node is fixed; nothing is left to compute");
}

template <int dim> void Assembly<dim>::build_pattern() {
  const auto &d = discretisation_;
  const int size = dim * d.nodes_per_cell;
  const auto unknown = [&](int cell, int k) {
    const auto node = d.cell_nodes[static_cast<std::size_t>(cell * d.nodes_per_cell + k / dim)];
    return unknown_of_[static_cast<std::size_t>(dim * node + k % dim)];
  };
  // Column by column from the nodes that share a cell: a list of all element entries would take
  // more memory than the matrix.
  std::vector<std::vector<int>> neighbours(static_cast<std::size_t>(d.n_nodes()));
  for (int cell = 0; cell < d.n_cells(); ++cell) {
    const int *nodes = d.cell_nodes.data() + cell * d.nodes_per_cell;
    for (int a = 0; a < d.nodes_per_cell; ++a) {
      auto &of_node = neighbours[static_cast<std::size_t>(nodes[a])];
      of_node.insert(of_node.end(), nodes, nodes + d.nodes_per_cell);
    }
  }
  std::vector<int> starts{0}, rows;
  for (int a = 0; a < d.n_nodes(); ++a) {
    auto &of_node = neighbours[static_cast<std::size_t>(a)];
    std::sort(of_node.begin(), of_node.end());
    of_node.erase(std::unique(of_node.begin(), of_node.end()), of_node.end());
    for (int c = 0; c < dim; ++c) {
      if (unknown_of_[static_cast<std::size_t>(dim * a + c)] < 0)
        continue;
      for (const int b : of_node)
        for (int e = 0; e < dim; ++e)
          if (const int row = unknown_of_[static_cast<std::size_t>(dim * b + e)]; row >= 0)
            rows.push_back(row);
      starts.push_back(static_cast<int>(rows.size()));
    }
    std::vector<int>().swap(of_node);
  }
  std::vector<double> zeros(rows.size(), 0.0);
  tangent_ = Eigen::Map<SparseMatrix>(n_free_, n_free_, static_cast<Eigen::Index>(rows.size()),
                                      starts.data(), rows.data(), zeros.data());
  mass_ = tangent_;

  const auto place = [&](int row, int column) {
    return row < 0 || column < 0
               ? -1
               : static_cast<int>(&tangent_.coeffRef(row, column) - tangent_.valuePtr());
  };
  place_.reserve(static_cast<std::size_t>(d.n_cells() * size * size));
  for (int cell = 0; cell < d.n_cells(); ++cell)
    for (int j = 0; j < size; ++j)
      for (int i = 0; i < size; ++i)
        place_.push_back(place(unknown(cell, i), unknown(cell, j)));
}

template <int dim> void Assembly<dim>::build_mass(double density) {
  const auto &d = discretisation_;
  const int n = d.nodes_per_cell;
  for (int cell = 0; cell < d.n_cells(); ++cell) {
    Eigen::MatrixXd block = Eigen::MatrixXd::Zero(n, n);
    for (int q = 0; q < d.points_per_cell; ++q) {
      const Eigen::Map<const Eigen::VectorXd> values(d.values.data() + q * n, n);
      block += density * weight_at(d, cell, q) * values * values.transpose();
    }
    cell_mass_.insert(cell_mass_.end(), block.data(), block.data() + n * n);
    const int *place = place_.data() + static_cast<std::ptrdiff_t>(cell) * dim * n * dim * n;
    for (int j = 0; j < dim * n; ++j)
      for (int i = 0; i < dim * n; ++i, ++place)
        if (*place >= 0 && i % dim == j % dim)
          mass_.valuePtr()[*place] += block(i / dim, j / dim);
  }
}

template <int dim>
Eigen::VectorXd Assembly<dim>::restrict_to_free(const Eigen::VectorXd &all) const {
  Eigen::VectorXd free(n_free_);
  for (std::size_t k = 0; k < unknown_of_.size(); ++k)
    if (unknown_of_[k] >= 0)
      free[unknown_of_[k]] = all[static_cast<Eigen::Index>(k)];
  return free;
}

template <int dim>
void Assembly<dim>::add_to_free(Eigen::VectorXd &all, double factor,
                                const Eigen::VectorXd &free) const {
  for (std::size_t k = 0; k < unknown_of_.size(); ++k)
    if (unknown_of_[k] >= 0)
      all[static_cast<Eigen::Index>(k)] += factor * free[unknown_of_[k]];
}

template <int dim> Eigen::VectorXd Assembly<dim>::mass_times(const Eigen::VectorXd &all) const {
  const auto &d = discretisation_;
  const int n = d.nodes_per_cell;
  Eigen::VectorXd product = Eigen::VectorXd::Zero(all.size());
  for (int cell = 0; cell < d.n_cells(); ++cell) {
    const int *numbers = d.cell_nodes.data() + cell * n;
    const double *block = cell_mass_.data() + static_cast<std::ptrdiff_t>(cell) * n * n;
    for (int b = 0; b < n; ++b)
      for (int a = 0; a < n; ++a)
        product.template segment<dim>(dim * numbers[a]) +=
            block[b * n + a] * all.template segment<dim>(dim * numbers[b]);
  }
  d.components.add_up(product);
  return product;
}

template <int dim> RigidMotions Assembly<dim>::rigid_motions() const {
  const auto &d = discretisation_;
  const auto is_own = [&](int node) { return d.components.owns(dim * node); };
  const auto n_nodes = static_cast<double>(d.components.count(d.n_dofs()) / dim);
  Vec<dim> centre = Vec<dim>::Zero();
  for (int a = 0; a < d.n_nodes(); ++a)
    if (is_own(a))
      centre += d.nodes[static_cast<std::size_t>(a)] / n_nodes;
  centre = d.ranks.sum(centre);
  const auto unknown = [&](int node, int c) {
    return unknown_of_[static_cast<std::size_t>(dim * node + c)];
  };
  RigidMotions motions{dim,     {},       0, Eigen::MatrixXd::Zero(d.n_dofs(), voigt_size<dim>),
                       d.ranks, unknowns_};
  Eigen::VectorXd place = Eigen::VectorXd::Zero(n_free_);
  int places = 0;
  for (int a = 0; a < d.n_nodes(); ++a) {
    if (!is_own(a))
      continue;
    const Vec<dim> x = d.nodes[static_cast<std::size_t>(a)] - centre;
    bool is_free = false;
    for (int c = 0; c < dim; ++c) {
      if (unknown(a, c) < 0)
        continue;
      is_free = true;
      place[unknown(a, c)] = places + c;
      for (int k = 0; k < voigt_size<dim>; ++k) { // translations, then rotations in every plane
        const int i = voigt_row<dim>(k), j = voigt_column<dim>(k);
        motions.vectors(places + c, k) = k < dim  ? (c == i ? 1 : 0)
                                         : c == i ? -x[j]
                                         : c == j ? x[i]
                                                  : 0;
      }
    }
    places += is_free ? dim : 0;
  }
  motions.vectors.conservativeResize(places, Eigen::NoChange);
  motions.first = static_cast<int>(d.ranks.sum_before(places));
  place.array() += motions.first;
  unknowns_.copy_from_owners(place);
  motions.place.assign(place.begin(), place.end());
  return motions;
}

template <int dim> void Assembly<dim>::clear() {
  std::fill_n(tangent_.valuePtr(), tangent_.nonZeros(), 0.0);
  condensed_force_.setZero();
  mode_residual_ = 0;
}

template <int dim>
double Assembly<dim>::linearise(const Eigen::VectorXd &displacement, const Eigen::VectorXd &modes,
                                const Overstress<dim> &overstress) {
  clear();
  double min_det = 0;
  with_element<dim>(discretisation_.kind, [&]<int nodes, int n_modes>() {
    min_det = sweep<nodes, n_modes>(displacement, modes, overstress);
  });
  return min_det;
}

template <int dim>
template <int nodes, int modes>
double Assembly<dim>::sweep(const Eigen::VectorXd &displacement, const Eigen::VectorXd &mode_values,
                            const Overstress<dim> &overstress) {
  double min_det = std::numeric_limits<double>::infinity(), modes_squared = 0, stiffest = 0;
  for (int k = 0; k < discretisation_.n_cells(); ++k) {
    const auto u = gather<dim, nodes, modes>(discretisation_, k, displacement, mode_values);
    auto element =
        cell_system<dim, nodes, modes>(discretisation_, material_, overstress, k, u, true);
    min_det = std::min(min_det, element.min_det);
    if (!(min_det > 0))
      break;
    mirror(element.tangent);
    modes_squared += element.force.template rightCols<modes>().squaredNorm();
    stiffest =
        std::max(stiffest, element.tangent.diagonal().template head<dim * nodes>().maxCoeff());
    scatter<nodes, modes>(k, condense<dim, nodes, modes>(element));
  }
  const Ranks &ranks = discretisation_.ranks;
  mode_residual_ = std::sqrt(ranks.sum(modes_squared));
  stiffest_ = ranks.max(stiffest);
  discretisation_.components.add_up(condensed_force_);
  return ranks.min(min_det);
}

template <int dim>
template <int nodes, int modes>
void Assembly<dim>::scatter(int cell, const Condensed<dim, nodes, modes> &condensed) {
  constexpr int size = dim * nodes;
  const int *numbers = discretisation_.cell_nodes.data() + cell * nodes;
  for (int a = 0; a < nodes; ++a)
    condensed_force_.template segment<dim>(dim * numbers[a]) +=
        condensed.force.template segment<dim>(dim * a);
  const int *place = place_.data() + static_cast<std::ptrdiff_t>(cell) * size * size;
  for (int k = 0; k < size * size; ++k)
    if (place[k] >= 0)
      tangent_.valuePtr()[place[k]] += condensed.tangent.data()[k];
  std::copy_n(condensed.recovery.data(), condensed.recovery.size(),
              recovery_.data() + cell * condensed.recovery.size());
}

// One unit in the last place of the displacements (and of F, over a cell's length), independent
// from cell to cell; 16 covers the operations that follow (observed: 3 to 5).
template <int dim>
double Assembly<dim>::round_off_force(double k, double c,
                                      const Eigen::VectorXd &displacement) const {
  const Ranks &ranks = discretisation_.ranks;
  const double length = ranks.max(displacement.cwiseAbs().maxCoeff()) +
                        std::pow(ranks.max(weight_at(discretisation_, 0, 0)), 1.0 / dim);
  return 16 * std::numeric_limits<double>::epsilon() *
         (k * stiffest_at_rest_ + c * ranks.max(mass_.diagonal().maxCoeff())) * length *
         std::sqrt(discretisation_.n_cells_of_all());
}

template <int dim>
Eigen::VectorXd Assembly<dim>::mode_increment(const Eigen::VectorXd &increment) const {
  Eigen::VectorXd result(discretisation_.n_modes());
  with_element<dim>(discretisation_.kind, [&]<int nodes, int modes>() {
    using Recovery = decltype(Condensed<dim, nodes, modes>::recovery);
    if constexpr (modes > 0)
      for (int cell = 0; cell < discretisation_.n_cells(); ++cell) {
        const Eigen::Map<const Recovery> recovery(recovery_.data() +
                                                  cell * Recovery::SizeAtCompileTime);
        const auto u = gather<dim, nodes, 0>(discretisation_, cell, increment, increment);
        result.template segment<dim * modes>(dim * modes * cell) =
            -recovery.template leftCols<dim * nodes>() * u.reshaped() -
            recovery.template rightCols<1>();
      }
  });
  return result;
}

template <int dim>
Eigen::VectorXd Assembly<dim>::internal_force(const Eigen::VectorXd &displacement,
                                              const Eigen::VectorXd &mode_values,
                                              const Overstress<dim> &overstress) const {
  const auto &d = discretisation_;
  Eigen::VectorXd force = Eigen::VectorXd::Zero(d.n_dofs());
  with_element<dim>(d.kind, [&]<int nodes, int modes>() {
    for (int k = 0; k < d.n_cells(); ++k) {
      const auto u = gather<dim, nodes, modes>(d, k, displacement, mode_values);
      const auto element = cell_system<dim, nodes, modes>(d, material_, overstress, k, u, false);
      for (int a = 0; a < nodes; ++a)
        force.template segment<dim>(dim * d.cell_nodes[static_cast<std::size_t>(k * nodes + a)]) +=
            element.force.col(a);
    }
  });
  d.components.add_up(force);
  return force;
}

template <int dim>
Eigen::VectorXd Assembly<dim>::relaxing_stresses(const Eigen::VectorXd &displacement,
                                                 const Eigen::VectorXd &modes) const {
  constexpr int n = voigt_size<dim>;
  const auto &d = discretisation_;
  Eigen::VectorXd stresses(n * static_cast<Eigen::Index>(d.weights.size()));
  for_each_point(d, displacement, modes, [&](int k, int q, const Mat<dim> &F) {
    stresses.template segment<n>(n * (k * d.points_per_cell + q)) =
        relaxing_stress<dim>(material_, F);
  });
  return stresses;
}

template <int dim>
double Assembly<dim>::smallest_det(const Eigen::VectorXd &displacement,
                                   const Eigen::VectorXd &modes) const {
  double smallest = std::numeric_limits<double>::infinity();
  for_each_point(discretisation_, displacement, modes, [&](int, int, const Mat<dim> &F) {
    const double det = F.determinant();
    smallest = std::isnan(det) ? -std::numeric_limits<double>::infinity() : std::min(smallest, det);
  });
  return discretisation_.ranks.min(smallest);
}

template <int dim>
Eigen::VectorXd Assembly<dim>::energy_of_cells(const Eigen::VectorXd &displacement,
                                               const Eigen::VectorXd &modes) const {
  const auto &d = discretisation_;
  Eigen::VectorXd energy = Eigen::VectorXd::Zero(d.n_cells());
  for_each_point(d, displacement, modes, [&](int k, int q, const Mat<dim> &F) {
    energy[k] += weight_at(d, k, q) * strain_energy_density<dim>(material_, F);
  });
  if (d.kind == ElementKind::q2_p1) // there the volume changes by theta, not by J
    for_each_volume_field(displacement, [&](int k, const auto &det, const auto &field) {
      const Volume &volume = *material_.volume();
      for (int q = 0; q < d.points_per_cell; ++q)
        energy[k] += weight_at(d, k, q) * (volume.energy(field.theta[q]) - volume.energy(det[q]));
    });
  return energy;
}

template <int dim>
double Assembly<dim>::strain_energy(const Eigen::VectorXd &displacement,
                                    const Eigen::VectorXd &modes) const {
  return discretisation_.ranks.sum(energy_of_cells(displacement, modes).sum());
}

// Calls action(cell, det F, VolumeField) for every cell of a mixed element.
template <int dim>
template <class Action>
void Assembly<dim>::for_each_volume_field(const Eigen::VectorXd &displacement,
                                          Action &&action) const {
  const auto &d = discretisation_;
  constexpr int nodes = dim == 2 ? 9 : 27;
  for (int k = 0; k < d.n_cells(); ++k) {
    const auto u = gather<dim, nodes, 0>(d, k, displacement, displacement);
    const auto at = deformation<dim, nodes>(d, k, u);
    action(k, at.det,
           volume_field<dim>(pressure_basis(d, k), at.det, decltype(at.det)(cell_weights(d, k)),
                             *material_.volume()));
  }
}

template <int dim>
Eigen::MatrixXd Assembly<dim>::mean_stress(const Eigen::VectorXd &displacement,
                                           const Eigen::VectorXd &modes) const {
  const auto &d = discretisation_;
  Eigen::MatrixXd mean = Eigen::MatrixXd::Zero(6, d.n_cells());
  Eigen::VectorXd volume = Eigen::VectorXd::Zero(d.n_cells());
  for_each_point(d, displacement, modes, [&](int k, int q, const Mat<dim> &F) {
    const double w = weight_at(d, k, q);
    mean.col(k) += w * to_voigt<3>(cauchy_stress<dim>(material_, F));
    volume[k] += w;
  });
  if (d.kind == ElementKind::q2_p1) // there the pressure is a field of its own
    for_each_volume_field(displacement, [&](int k, const auto &det, const auto &field) {
      for (int q = 0; q < d.points_per_cell; ++q)
        mean.col(k).template head<3>().array() +=
            weight_at(d, k, q) * (field.pressure[q] - material_.volume()->pressure(det[q]));
    });
  return mean.array().rowwise() / volume.transpose().array();
}

template class Assembly<2>;
template class Assembly<3>;

} // namespace sluice::solid
