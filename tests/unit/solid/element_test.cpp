// SPDX-License-Identifier: MIT
#include "solid-dealii/assembly.hpp"
#include "solid-dealii/cell_system.hpp"
#include "solid-dealii/newton.hpp"

#include <gtest/gtest.h>

#include <random>

namespace sluice::solid {
namespace {

constexpr ElementKind kinds[] = {ElementKind::incompatible_modes, ElementKind::q1, ElementKind::q2,
                                 ElementKind::q3, ElementKind::q2_p1};
const Lame lame{1.7, 0.9};
const MooneyRivlin split_law{{0.3, 0.15}, {2.3}};

// The element q3 exists in the plane only; q2-p1 needs a split law.
bool exists(ElementKind kind, int dim) { return dim == 2 || kind != ElementKind::q3; }
Material material_for(ElementKind kind) {
  return kind == ElementKind::q2_p1 ? Material{split_law} : Material{NeoHookean{lame}};
}

// A box of 2 cells per axis whose vertices are moved by a smooth map: no cell is a parallelepiped.
template <int dim> Box<dim> distorted_box() {
  Box<dim> box;
  box.corner = Vec<dim>::Zero();
  box.size = Vec<dim>::Constant(1.0);
  box.elements.fill(2);
  box.shape = [](const Vec<dim> &x) {
    Vec<dim> y = x;
    for (int d = 0; d < dim; ++d)
      y[d] += 0.15 * std::sin(3.0 * x[(d + 1) % dim] + 0.5 * d) * x[d];
    return y;
  };
  return box;
}

Eigen::VectorXd random_vector(Eigen::Index size, double amplitude, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> entry(-amplitude, amplitude);
  return Eigen::VectorXd::NullaryExpr(size, [&](Eigen::Index) { return entry(random); });
}

// The first cell of a distorted mesh as a function of all its columns, modes included.
template <int dim, int nodes, int modes>
double tangent_error(const Discretisation<dim> &d, const Material &material) {
  constexpr int columns = nodes + modes;
  constexpr double h = 1e-6;
  const Eigen::VectorXd values = random_vector(dim * columns, 0.05, 3);
  const Columns<dim, columns> u = Eigen::Map<const Columns<dim, columns>>(values.data());
  const std::vector<double> stress(voigt_size<dim> * d.weights.size(), 0.1);
  const Overstress<dim> overstress{0.4, stress};
  const auto cell = [&](const Columns<dim, columns> &at, bool with_tangent) {
    return cell_system<dim, nodes, modes>(d, material, overstress, 0, at, with_tangent);
  };
  auto element = cell(u, true);
  mirror(element.tangent);
  double worst = 0;
  for (int k = 0; k < dim * columns; ++k) {
    Columns<dim, columns> ahead = u, behind = u;
    ahead(k % dim, k / dim) += h;
    behind(k % dim, k / dim) -= h;
    const Columns<dim, columns> slope =
        (cell(ahead, false).force - cell(behind, false).force) / (2 * h);
    worst = std::max(worst, (element.tangent.col(k) - slope.reshaped()).norm());
  }
  return worst / element.tangent.norm();
}

template <int dim> void check_tangents() {
  for (const ElementKind kind : kinds) {
    if (!exists(kind, dim))
      continue;
    const auto d = discretise(distorted_box<dim>(), kind);
    std::vector<Material> materials{{split_law}, {Ogden{{0.4, 0.1}, {1.3, 5}, {2.3}}}};
    if (kind != ElementKind::q2_p1)
      materials.insert(materials.end(), {{NeoHookean{lame}}, {LinearElastic{lame}}});
    with_element<dim>(kind, [&]<int nodes, int modes>() {
      // Central differences of order-1 forces: h^2 and round-off over h, both near 1e-10.
      for (const Material &material : materials)
        EXPECT_LT((tangent_error<dim, nodes, modes>(d, material)), 1e-8)
            << "element " << static_cast<int>(kind) << ", law " << material.law.index();
    });
  }
}

TEST(Element, tangent_is_the_derivative_of_the_force_in_two_dimensions) { check_tangents<2>(); }
TEST(Element, tangent_is_the_derivative_of_the_force_in_three_dimensions) { check_tangents<3>(); }

template <int dim> std::vector<bool> whole_boundary(const Discretisation<dim> &d) {
  std::vector<bool> fixed(static_cast<std::size_t>(d.n_dofs()), false);
  for (const auto &face : d.faces)
    for (const int node : face.nodes)
      for (int c = 0; c < dim; ++c)
        fixed[static_cast<std::size_t>(dim * node + c)] = true;
  return fixed;
}

template <int dim> Mat<dim> some_gradient() {
  Mat<dim> H;
  for (int i = 0; i < dim; ++i)
    for (int j = 0; j < dim; ++j)
      H(i, j) = 0.2 * std::cos(1.0 + 2.3 * i + 4.1 * j);
  return H;
}

// Boundary nodes follow u = H X; the inner ones, started elsewhere, must find the same field.
template <int dim> double patch_error(ElementKind kind) {
  const auto d = discretise(distorted_box<dim>(), kind);
  const auto fixed = whole_boundary(d);
  Assembly<dim> assembly(d, material_for(kind), 1, fixed);
  Eigen::VectorXd exact(d.n_dofs());
  for (int a = 0; a < d.n_nodes(); ++a)
    exact.template segment<dim>(dim * a) =
        some_gradient<dim>() * d.nodes[static_cast<std::size_t>(a)];
  Iterate iterate{exact, random_vector(d.n_modes(), 0.003, 5)};
  const Eigen::VectorXd disturbance = random_vector(d.n_dofs(), 0.01, 4);
  for (Eigen::Index k = 0; k < exact.size(); ++k)
    if (!fixed[static_cast<std::size_t>(k)])
      iterate.displacement[k] += disturbance[k];
  Newton<dim> newton(assembly, {1e-13, 30});
  const auto report = newton.solve({1, 0, {}, Eigen::VectorXd::Zero(d.n_dofs())}, iterate);
  EXPECT_TRUE(report.has_converged) << report.failure;
  return (iterate.displacement - exact).norm() + iterate.modes.norm();
}

TEST(Element, a_linear_field_on_a_distorted_mesh_is_found_exactly) {
  for (const ElementKind kind : kinds) {
    EXPECT_LT(patch_error<2>(kind), 1e-12) << "dim 2, element " << static_cast<int>(kind);
    if (exists(kind, 3)) {
      EXPECT_LT(patch_error<3>(kind), 1e-12) << "dim 3, element " << static_cast<int>(kind);
    }
  }
}

template <int dim> Mat<dim> some_rotation() {
  if constexpr (dim == 2)
    return Eigen::Rotation2Dd(1.2).toRotationMatrix();
  else
    return Eigen::AngleAxisd(1.2, Vec<3>(1, 2, 3).normalized()).toRotationMatrix();
}

template <int dim> void check_rigid_motion(ElementKind kind, const Material &material) {
  const auto d = discretise(distorted_box<dim>(), kind);
  std::vector<bool> fixed(static_cast<std::size_t>(d.n_dofs()), false);
  fixed[0] = true;
  const Assembly<dim> assembly(d, material, 1, fixed);
  Eigen::VectorXd u(d.n_dofs());
  for (int a = 0; a < d.n_nodes(); ++a) {
    const Vec<dim> &x = d.nodes[static_cast<std::size_t>(a)];
    u.template segment<dim>(dim * a) = some_rotation<dim>() * x + Vec<dim>::Constant(0.7) - x;
  }
  const Eigen::VectorXd modes = Eigen::VectorXd::Zero(d.n_modes());
  // F = R to round-off times the largest gradient, of order 10: forces of 1e-14.
  EXPECT_LT(assembly.internal_force(u, modes).cwiseAbs().maxCoeff(), 1e-13);
  EXPECT_NEAR(assembly.smallest_det(u, modes), 1, 1e-13);
  EXPECT_NEAR(assembly.strain_energy(u, modes), 0, 1e-13);
}

TEST(Element, a_rigid_rotation_leaves_no_force_and_no_energy) {
  for (const ElementKind kind : kinds)
    for (const Material &material :
         {material_for(kind), Material{split_law}, Material{Ogden{{0.4, 0.1}, {1.3, 5}, {2.3}}}}) {
      check_rigid_motion<2>(kind, material);
      if (exists(kind, 3))
        check_rigid_motion<3>(kind, material);
    }
}

template <int dim> void check_mass(ElementKind kind) {
  const auto d = discretise(distorted_box<dim>(), kind);
  std::vector<bool> fixed(static_cast<std::size_t>(d.n_dofs()), false);
  const Assembly<dim> assembly(d, material_for(kind), 3.0, fixed);
  Eigen::VectorXd ones = Eigen::VectorXd::Zero(d.n_dofs());
  for (int a = 0; a < d.n_nodes(); ++a)
    ones[dim * a] = 1;
  double volume = 0;
  for (const double w : d.weights)
    volume += w;
  EXPECT_NEAR(assembly.mass_times(ones).sum(), 3.0 * volume, 1e-13);
  const Eigen::VectorXd v = random_vector(d.n_dofs(), 1, 6);
  EXPECT_LT((assembly.mass() * v - assembly.mass_times(v)).norm(), 1e-13);
}

TEST(Element, mass_is_density_times_volume_and_the_matrix_applies_it) {
  for (const ElementKind kind : kinds) {
    check_mass<2>(kind);
    if (exists(kind, 3))
      check_mass<3>(kind);
  }
}

// Condensation: a force found with the modes in local equilibrium has the condensed tangent.
TEST(Element, condensed_tangent_is_the_derivative_with_modes_in_equilibrium) {
  const auto d = discretise(distorted_box<2>(), ElementKind::incompatible_modes);
  std::vector<bool> fixed(static_cast<std::size_t>(d.n_dofs()), false);
  Assembly<2> assembly(d, {NeoHookean{lame}}, 1, fixed);
  const Eigen::VectorXd u = random_vector(d.n_dofs(), 0.03, 8);
  const auto force_at = [&](const Eigen::VectorXd &at) {
    Eigen::VectorXd modes = Eigen::VectorXd::Zero(d.n_modes());
    for (int k = 0; k < 8; ++k) {
      assembly.linearise(at, modes);
      modes += assembly.mode_increment(Eigen::VectorXd::Zero(d.n_dofs()));
    }
    assembly.linearise(at, modes);
    EXPECT_LT(assembly.mode_residual(), 1e-13);
    return Eigen::VectorXd(assembly.condensed_force());
  };
  const Eigen::VectorXd along = random_vector(d.n_dofs(), 1, 9);
  const double h = 1e-6;
  const Eigen::VectorXd slope = (force_at(u + h * along) - force_at(u - h * along)) / (2 * h);
  force_at(u);
  const Eigen::VectorXd product = assembly.tangent() * along;
  EXPECT_LT((product - slope).norm() / slope.norm(), 1e-8);
}

TEST(Element, mixed_element_refuses_laws_without_a_volume_energy) {
  const auto d = discretise(distorted_box<2>(), ElementKind::q2_p1);
  const std::vector<bool> fixed(static_cast<std::size_t>(d.n_dofs()), false);
  EXPECT_THROW(Assembly<2>(d, {NeoHookean{lame}}, 1, fixed), UserError);
  EXPECT_THROW(Assembly<2>(d, {split_law, Plane::stress}, 1, fixed), UserError);
}

TEST(Element, a_displacement_that_is_not_a_number_counts_as_inverted) {
  const auto d = discretise(distorted_box<2>(), ElementKind::incompatible_modes);
  Assembly<2> assembly(d, {NeoHookean{lame}}, 1, std::vector<bool>(18, false));
  const Eigen::VectorXd modes = Eigen::VectorXd::Zero(d.n_modes());
  Eigen::VectorXd u = Eigen::VectorXd::Zero(18);
  EXPECT_NEAR(assembly.linearise(u, modes), 1, 1e-15);
  u[9] = std::nan("");
  EXPECT_FALSE(assembly.linearise(u, modes) > 0);
  EXPECT_FALSE(assembly.smallest_det(u, modes) > 0);
}

TEST(Element, an_inverted_mesh_cell_is_refused) {
  Box<2> box{{0, 0}, {1, 1}, {1, 1}, {}};
  box.shape = [](const Vec<2> &x) { return Vec<2>(-x.x(), x.y()); };
  EXPECT_THROW(discretise(box, ElementKind::q1), UserError);
}

} // namespace
} // namespace sluice::solid
