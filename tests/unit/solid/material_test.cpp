// SPDX-License-Identifier: MIT
#include "solid-dealii/material.hpp"

#include <gtest/gtest.h>

#include <random>

namespace sluice::solid {
namespace {

template <int dim> Mat<dim> random_deformation(std::mt19937 &random) {
  std::uniform_real_distribution<double> entry(-0.3, 0.3);
  Mat<dim> F = Mat<dim>::Identity();
  for (int i = 0; i < dim; ++i)
    for (int j = 0; j < dim; ++j)
      F(i, j) += entry(random);
  return F;
}

template <int dim, class Law> Mat<dim> stress(const Law &law, const Mat<dim> &F) {
  return law.template response<dim>(F, F.determinant()).stress;
}

// tau = dW/dF F^T, with dW/dF by central differences.
template <int dim, class Law> Mat<dim> stress_from_energy(const Law &law, const Mat<dim> &F) {
  constexpr double h = 1e-6;
  Mat<dim> P;
  for (int i = 0; i < dim; ++i)
    for (int j = 0; j < dim; ++j) {
      Mat<dim> dF = Mat<dim>::Zero();
      dF(i, j) = h;
      P(i, j) = (law.template energy<dim>(F + dF) - law.template energy<dim>(F - dF)) / (2 * h);
    }
  return P * F.transpose();
}

// Change of tau along F(s) = exp(s L) F, less its rotation: d tau/ds - L tau - tau L^T = (J c) : L.
template <int dim, class Law>
Mat<dim> rate_from_stress(const Law &law, const Mat<dim> &F, const Mat<dim> &L) {
  constexpr double h = 1e-6;
  const Mat<dim> ahead = (Mat<dim>::Identity() + h * L) * F;
  const Mat<dim> behind = (Mat<dim>::Identity() - h * L) * F;
  const Mat<dim> change = (stress<dim>(law, ahead) - stress<dim>(law, behind)) / (2 * h);
  const Mat<dim> tau = stress<dim>(law, F);
  return change - L * tau - tau * L.transpose();
}

template <int dim, class Law> void check_law(const Law &law) {
  std::mt19937 random(7);
  for (int sample = 0; sample < 20; ++sample) {
    const Mat<dim> F = random_deformation<dim>(random);
    const Mat<dim> L = random_deformation<dim>(random);
    const auto response = law.template response<dim>(F, F.determinant());
    // Central differences: truncation h^2 = 1e-12 and round-off 1e-16/h = 1e-10, of order-1 values.
    EXPECT_LT((response.stress - stress_from_energy<dim>(law, F)).norm(), 1e-8);
    EXPECT_LT((response.tangent_times(L) - rate_from_stress<dim>(law, F, L)).norm(), 1e-8);
  }
}

constexpr Lame unit_lame{1.7, 0.9};

TEST(Material, neo_hookean_stress_and_tangent_are_derivatives_of_the_energy) {
  check_law<2>(NeoHookean{unit_lame});
  check_law<3>(NeoHookean{unit_lame});
}

TEST(Material, st_venant_kirchhoff_stress_and_tangent_are_derivatives_of_the_energy) {
  check_law<2>(SaintVenantKirchhoff{unit_lame});
  check_law<3>(SaintVenantKirchhoff{unit_lame});
}

template <class Law> void check_plane_strain(const Law &law) {
  std::mt19937 random(11);
  const Mat<2> F = random_deformation<2>(random);
  Mat<3> whole = Mat<3>::Identity();
  whole.topLeftCorner<2, 2>() = F;
  const Mat<2> in_plane = stress<3>(law, whole).template topLeftCorner<2, 2>();
  EXPECT_LT((stress<2>(law, F) - in_plane).norm(), 1e-15);
  EXPECT_NEAR(law.template energy<2>(F), law.template energy<3>(whole), 1e-15);
}

TEST(Material, two_dimensions_are_three_with_no_stretch_out_of_plane) {
  check_plane_strain(NeoHookean{unit_lame});
  check_plane_strain(SaintVenantKirchhoff{unit_lame});
}

TEST(Material, a_rotation_leaves_no_stress) {
  const Mat<3> R = Eigen::AngleAxisd(1.1, Vec<3>(1, 2, 3).normalized()).toRotationMatrix();
  // R R^T = I to a few units of round-off.
  EXPECT_LT(stress<3>(NeoHookean{unit_lame}, R).norm(), 5e-15);
  EXPECT_LT(stress<3>(SaintVenantKirchhoff{unit_lame}, R).norm(), 5e-15);
}

TEST(Material, small_uniaxial_strain_has_the_modulus_asked_for) {
  const double E = 12e6, nu = 0.4, strain = 1e-7;
  for (const auto *law : {"neo-hookean", "st-venant-kirchhoff"}) {
    const Material material = make_material(law, E, nu);
    const Vec<3> stretch(1 + strain, 1 - nu * strain, 1 - nu * strain);
    const Mat<3> F = stretch.asDiagonal();
    const Mat<3> tau = std::visit([&](const auto &m) { return stress<3>(m, F); }, material);
    EXPECT_NEAR(tau(0, 0) / (E * strain), 1, 1e-6) << law;
    EXPECT_NEAR(tau(1, 1) / (E * strain), 0, 1e-6) << law;
  }
}

TEST(Material, constants_out_of_range_are_refused) {
  EXPECT_THROW(lame_constants(-1, 0.3), UserError);
  EXPECT_THROW(lame_constants(1, 0.5), UserError);
  EXPECT_THROW(make_material("rubber", 1, 0.3), UserError);
}

} // namespace
} // namespace sluice::solid
