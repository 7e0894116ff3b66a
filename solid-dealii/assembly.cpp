// SPDX-License-Identifier: MIT
#include "solid-dealii/assembly.hpp"

#include <cmath>

namespace sluice::solid {
namespace {

// Displacement of a cell's nodes and modes, column by column.
template <int dim, int nodes, int modes>
Columns<dim, nodes + modes> gather(const Discretisation<dim> &d, int cell,
                                   const Eigen::VectorXd &displacement,
                                   const Eigen::VectorXd &mode_values) {
  Columns<dim, nodes + modes> u;
  const int *numbers = d.cell_nodes.data() + cell * nodes;
  for (int a = 0; a < nodes; ++a)
    u.col(a) = displacement.template segment<dim>(dim * numbers[a]);
  for (int a = 0; a < modes; ++a)
    u.col(nodes + a) = mode_values.template segment<dim>(dim * (cell * modes + a));
  return u;
}

template <int dim, int columns>
Eigen::Map<const Columns<dim, columns>> gradient_at(const Discretisation<dim> &d, int cell, int q) {
  const auto index = static_cast<std::size_t>(cell * d.points_per_cell + q);
  return Eigen::Map<const Columns<dim, columns>>(d.gradients.data() + index * dim * columns);
}

template <int dim> double weight_at(const Discretisation<dim> &d, int cell, int q) {
  return d.weights[static_cast<std::size_t>(cell * d.points_per_cell + q)];
}

template <int dim, int columns, class Law>
ElementSystem<dim, columns> element_system(const Discretisation<dim> &d, const Law &law, int cell,
                                           const Columns<dim, columns> &u, bool with_tangent) {
  ElementSystem<dim, columns> element;
  for (int q = 0; q < d.points_per_cell; ++q)
    if (!add_point<dim, columns>(law, u, gradient_at<dim, columns>(d, cell, q),
                                 weight_at(d, cell, q), with_tangent, element))
      break;
  return element;
}

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

// Cauchy stress with its out-of-plane part: in plane strain b33 = 1 and E33 = 0.
template <int dim> Mat<3> cauchy_stress(const Material &material, const Mat<dim> &F) {
  return std::visit(
      [&](const auto &law) {
        Mat<3> whole = Mat<3>::Identity();
        whole.template topLeftCorner<dim, dim>() = F;
        const double det_f = F.determinant();
        const Mat<3> stress = law.template response<3>(whole, det_f).stress;
        return Mat<3>(stress / det_f);
      },
      material);
}

} // namespace

template <int dim>
Assembly<dim>::Assembly(const Discretisation<dim> &discretisation, Material material,
                        double density, const std::vector<bool> &fixed)
    : discretisation_(discretisation), material_(material) {
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
  for (const bool is_fixed : fixed)
    unknown_of_.push_back(is_fixed ? -1 : n_free_++);
  check(n_free_ > 0, "solid: every node is fixed; nothing is left to compute");
}

template <int dim> void Assembly<dim>::build_pattern() {
  const auto &d = discretisation_;
  const int size = dim * d.nodes_per_cell;
  const auto unknown = [&](int cell, int k) {
    const auto node = d.cell_nodes[static_cast<std::size_t>(cell * d.nodes_per_cell + k / dim)];
    return unknown_of_[static_cast<std::size_t>(dim * node + k % dim)];
  };
  std::vector<Eigen::Triplet<double>> entries;
  for (int cell = 0; cell < d.n_cells(); ++cell)
    for (int i = 0; i < size; ++i)
      for (int j = 0; j < size; ++j)
        if (unknown(cell, i) >= 0 && unknown(cell, j) >= 0)
          entries.emplace_back(unknown(cell, i), unknown(cell, j), 0.0);
  tangent_.resize(n_free_, n_free_);
  tangent_.setFromTriplets(entries.begin(), entries.end());
  tangent_.makeCompressed();
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
  return product;
}

template <int dim> void Assembly<dim>::clear() {
  std::fill_n(tangent_.valuePtr(), tangent_.nonZeros(), 0.0);
  condensed_force_.setZero();
  mode_residual_ = 0;
}

template <int dim>
double Assembly<dim>::linearise(const Eigen::VectorXd &displacement, const Eigen::VectorXd &modes) {
  clear();
  double min_det = 0;
  with_element<dim>(discretisation_.kind, [&]<int nodes, int n_modes>() {
    min_det =
        std::visit([&](const auto &law) { return sweep<nodes, n_modes>(law, displacement, modes); },
                   material_);
  });
  return min_det;
}

template <int dim>
template <int nodes, int modes, class Law>
double Assembly<dim>::sweep(const Law &law, const Eigen::VectorXd &displacement,
                            const Eigen::VectorXd &mode_values) {
  constexpr int columns = nodes + modes;
  double min_det = std::numeric_limits<double>::infinity(), modes_squared = 0, stiffest = 0;
  for (int cell = 0; cell < discretisation_.n_cells(); ++cell) {
    const auto u = gather<dim, nodes, modes>(discretisation_, cell, displacement, mode_values);
    auto element = element_system<dim, columns>(discretisation_, law, cell, u, true);
    min_det = std::min(min_det, element.min_det);
    if (!(min_det > 0))
      return min_det;
    mirror(element.tangent);
    modes_squared += element.force.template rightCols<modes>().squaredNorm();
    stiffest =
        std::max(stiffest, element.tangent.diagonal().template head<dim * nodes>().maxCoeff());
    scatter<nodes, modes>(cell, condense<dim, nodes, modes>(element));
  }
  mode_residual_ = std::sqrt(modes_squared);
  stiffest_ = stiffest;
  return min_det;
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
  const double length =
      displacement.cwiseAbs().maxCoeff() + std::pow(weight_at(discretisation_, 0, 0), 1.0 / dim);
  return 16 * std::numeric_limits<double>::epsilon() *
         (k * stiffest_at_rest_ + c * mass_.diagonal().maxCoeff()) * length *
         std::sqrt(discretisation_.n_cells());
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
                                              const Eigen::VectorXd &mode_values) const {
  const auto &d = discretisation_;
  Eigen::VectorXd force = Eigen::VectorXd::Zero(d.n_dofs());
  with_element<dim>(d.kind, [&]<int nodes, int modes>() {
    std::visit(
        [&](const auto &law) {
          for (int cell = 0; cell < d.n_cells(); ++cell) {
            const auto u = gather<dim, nodes, modes>(d, cell, displacement, mode_values);
            const auto element = element_system<dim, nodes + modes>(d, law, cell, u, false);
            for (int a = 0; a < nodes; ++a)
              force.template segment<dim>(
                  dim * d.cell_nodes[static_cast<std::size_t>(cell * nodes + a)]) +=
                  element.force.col(a);
          }
        },
        material_);
  });
  return force;
}

template <int dim>
double Assembly<dim>::smallest_det(const Eigen::VectorXd &displacement,
                                   const Eigen::VectorXd &modes) const {
  double smallest = std::numeric_limits<double>::infinity();
  for_each_point(discretisation_, displacement, modes, [&](int, int, const Mat<dim> &F) {
    const double det = F.determinant();
    smallest = std::isnan(det) ? -std::numeric_limits<double>::infinity() : std::min(smallest, det);
  });
  return smallest;
}

template <int dim>
double Assembly<dim>::strain_energy(const Eigen::VectorXd &displacement,
                                    const Eigen::VectorXd &modes) const {
  double energy = 0;
  for_each_point(discretisation_, displacement, modes, [&](int cell, int q, const Mat<dim> &F) {
    energy += weight_at(discretisation_, cell, q) *
              std::visit([&](const auto &law) { return law.template energy<dim>(F); }, material_);
  });
  return energy;
}

template <int dim>
Eigen::MatrixXd Assembly<dim>::mean_stress(const Eigen::VectorXd &displacement,
                                           const Eigen::VectorXd &modes) const {
  const auto &d = discretisation_;
  Eigen::MatrixXd mean = Eigen::MatrixXd::Zero(6, d.n_cells());
  Eigen::VectorXd volume = Eigen::VectorXd::Zero(d.n_cells());
  for_each_point(d, displacement, modes, [&](int cell, int q, const Mat<dim> &F) {
    const Mat<3> s = cauchy_stress<dim>(material_, F);
    const double w = weight_at(d, cell, q);
    mean.col(cell) +=
        w * (Eigen::VectorXd(6) << s(0, 0), s(1, 1), s(2, 2), s(0, 1), s(0, 2), s(1, 2)).finished();
    volume[cell] += w;
  });
  return mean.array().rowwise() / volume.transpose().array();
}

template class Assembly<2>;
template class Assembly<3>;

} // namespace sluice::solid
