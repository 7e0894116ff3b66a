// SPDX-License-Identifier: MIT
// Every law against automatic differentiation of its energy (Sacado, forward mode twice).
#include "solid-dealii/material.hpp"

#include <gtest/gtest.h>

#include <Sacado.hpp>

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

constexpr Lame unit_lame{1.7, 0.9};

std::vector<Material> all_laws() {
  return {{NeoHookean{unit_lame}},          {SaintVenantKirchhoff{unit_lame}},
          {LinearElastic{unit_lame}},       {MooneyRivlin{{0.3, 0.15}, {2.3}}},
          {Yeoh{{0.4, -0.1, 0.05}, {2.3}}}, {Ogden{{0.6, 0.02, -0.1}, {1.3, 5, -2}, {2.3}}}};
}

// Squares of the principal stretches for any number type: roots of the characteristic polynomial of
// b by the cosine formula, exact where they are distinct.
template <class Number>
std::array<Number, 3> squared_stretches(const Eigen::Matrix<Number, 3, 3> &F) {
  const Invariants<Number> i(F);
  const Number mean = i.b / 3.0;
  const Number p = sqrt((i.bb - 3.0 * mean * mean) / 6.0);
  const Number second = 0.5 * (i.b * i.b - i.bb);
  const Number det = i.j * i.j - mean * second + 2.0 * mean * mean * mean; // of b - mean I
  const Number angle = acos(det / (2.0 * p * p * p)) / 3.0;
  std::array<Number, 3> squares;
  for (int k = 0; k < 3; ++k)
    squares[static_cast<std::size_t>(k)] = mean + 2.0 * p * cos(angle + 2.0 * k * M_PI / 3.0);
  return squares;
}

// W with its first and second derivatives with respect to the nine components of F, row by row.
struct Derivatives {
  double energy;
  Eigen::Matrix<double, 9, 1> first;
  Eigen::Matrix<double, 9, 9> second;
};

Derivatives differentiate(const Material &material, const Mat<3> &F) {
  using Inner = Sacado::Fad::SFad<double, 9>;
  using Number = Sacado::Fad::SFad<Inner, 9>;
  Eigen::Matrix<Number, 3, 3> variables;
  for (int k = 0; k < 9; ++k) {
    Number &x = variables(k / 3, k % 3);
    x = Number(9, k, Inner(9, k, F(k / 3, k % 3)));
  }
  const Number w = std::visit(
      [&]<class L>(const L &law) -> Number {
        if constexpr (std::is_same_v<L, Ogden>)
          return law.template energy_of<Number>(squared_stretches<Number>(variables));
        else
          return law.template energy<Number>(variables);
      },
      material.law);
  Derivatives d{w.val().val(), {}, {}};
  for (int a = 0; a < 9; ++a) {
    d.first[a] = w.dx(a).val();
    for (int b = 0; b < 9; ++b)
      d.second(a, b) = w.dx(a).dx(b);
  }
  return d;
}

template <int dim> VoigtResponse<dim> response(const Material &material, const Mat<dim> &F) {
  VoigtResponse<dim> r;
  respond<dim, VoigtResponse<dim>>(material, std::span(&F, 1), {}, std::span(&r, 1));
  return r;
}

// d(tau)/ds along F(s) = exp(s L) F is carried by the rotation of the gradients and by J c:
// second derivative of W along L F is L : [ (J c : L) + L carried ].
void check_against_energy(const Material &material) {
  std::mt19937 random(7);
  for (int sample = 0; sample < 20; ++sample) {
    const Mat<3> F = random_deformation<3>(random), L = random_deformation<3>(random);
    const Derivatives d = differentiate(material, F);
    const auto r = response<3>(material, F);
    const auto row_major = [](const Mat<3> &m) {
      return Eigen::Matrix<double, 9, 1>(m.transpose().reshaped());
    };
    // Virtual work of a column G: P G = tau push G.
    const Mat<3> P = r.stress * r.push;
    EXPECT_LT((row_major(P) - d.first).norm(), 1e-12 * d.first.norm() + 1e-13);
    EXPECT_NEAR(strain_energy_density<3>(material, F), d.energy, 1e-13);
    const Mat<3> along = L * r.push.inverse().transpose(); // L F, or L for small strain
    const Mat<3> change = (r.tangent_times(L) + L * r.carried) * r.push;
    const Eigen::Matrix<double, 9, 1> expected = d.second * row_major(along);
    // Round-off of second derivatives; the cosine formula of the stretches costs two digits.
    EXPECT_LT((row_major(change) - expected).norm(), 1e-10 * expected.norm())
        << "law " << material.law.index();
  }
}

TEST(Material, stress_and_tangent_are_the_automatic_derivatives_of_the_energy) {
  for (const Material &material : all_laws())
    check_against_energy(material);
}

TEST(Material, ogdens_tangent_is_continuous_where_stretches_meet) {
  const Material material{Ogden{{0.6, 0.02}, {1.3, 5}, {2.3}}};
  const Mat<3> Q = Eigen::AngleAxisd(0.7, Vec<3>(1, 2, 3).normalized()).toRotationMatrix();
  const auto at = [&](double gap) {
    const Vec<3> stretches(1.2, 1.2 + gap, 0.8);
    return response<3>(material, Q * stretches.asDiagonal() * Q.transpose());
  };
  const auto limit = at(0);
  for (const double gap : {1e-9, 1e-7, 4e-7, 1e-6, 1e-5}) {
    // The tangent changes by about its own size per unit of stretch; 1e-9 is the quotient's error.
    EXPECT_LT((at(gap).tangent - limit.tangent).norm() / limit.tangent.norm(), 10 * gap + 1e-8);
  }
  const auto rest = response<3>(material, Mat<3>::Identity());
  EXPECT_LT(rest.stress.norm(), 1e-15);
  EXPECT_NEAR(rest.tangent(3, 3), std::get<Ogden>(material.law).shear_modulus(), 1e-14);
}

TEST(Material, closed_and_general_form_of_a_tangent_agree) {
  std::mt19937 random(3);
  for (const Material &material : all_laws()) {
    if (!material.has_metric_tangent())
      continue;
    const Mat<2> F = random_deformation<2>(random), L = random_deformation<2>(random);
    MetricResponse<2> closed;
    respond<2, MetricResponse<2>>(material, std::span(&F, 1), {}, std::span(&closed, 1));
    const auto general = response<2>(material, F);
    EXPECT_LT((closed.stress - general.stress).norm(), 1e-14);
    EXPECT_LT((closed.tangent_times(L) - general.tangent_times(L)).norm(), 1e-13);
  }
}

TEST(Material, plane_strain_is_space_with_no_stretch_out_of_plane) {
  std::mt19937 random(11);
  const Mat<2> F = random_deformation<2>(random);
  for (const Material &material : all_laws()) {
    const auto whole = response<3>(material, in_space(F));
    EXPECT_LT((response<2>(material, F).stress - whole.stress.topLeftCorner<2, 2>()).norm(), 1e-14);
    EXPECT_NEAR(strain_energy_density<2>(material, F),
                strain_energy_density<3>(material, in_space(F)), 1e-14);
    EXPECT_GT(std::abs(cauchy_stress<2>(material, F)(2, 2)), 1e-3) << "the plane holds it";
  }
}

// Tangent of plane stress by central differences of its stress: second Piola-Kirchhoff against C.
TEST(Material, plane_stress_has_no_stress_out_of_plane_and_a_consistent_tangent) {
  std::mt19937 random(13);
  for (Material material : all_laws()) {
    material.plane = Plane::stress;
    for (int sample = 0; sample < 5; ++sample) {
      const Mat<2> F = random_deformation<2>(random), L = random_deformation<2>(random);
      EXPECT_NEAR(cauchy_stress<2>(material, F)(2, 2), 0, 1e-12) << material.law.index();
      const auto piola = [&](const Mat<2> &at) {
        const auto r = response<2>(material, at);
        return Mat<2>(r.stress * r.push);
      };
      constexpr double h = 1e-6;
      const auto r = response<2>(material, F);
      const Mat<2> along = L * r.push.inverse().transpose();
      const Mat<2> slope = (piola(F + h * along) - piola(F - h * along)) / (2 * h);
      const Mat<2> change = (r.tangent_times(L) + L * r.carried) * r.push;
      // Central differences: truncation h^2 = 1e-12 and round-off 1e-16/h = 1e-10, order-1 values.
      EXPECT_LT((change - slope).norm(), 1e-8) << material.law.index();
    }
  }
}

TEST(Material, a_rotation_leaves_no_stress) {
  const Mat<3> R = Eigen::AngleAxisd(1.1, Vec<3>(1, 2, 3).normalized()).toRotationMatrix();
  for (const Material &material : all_laws())
    if (!material.is_small_strain()) { // R R^T = I to a few units of round-off
      EXPECT_LT(response<3>(material, R).stress.norm(), 1e-14) << material.law.index();
    }
}

TEST(Material, small_uniaxial_strain_has_the_modulus_asked_for) {
  const double E = 12e6, nu = 0.4, strain = 1e-7, mu = E / (2 * (1 + nu));
  LawConstants constants{E, nu};
  constants.c10 = 0.35 * mu; // Mooney-Rivlin: 2 (c10 + c01) = mu
  constants.c01 = 0.15 * mu;
  constants.c20 = 0.1 * mu;
  constants.mu = {mu, 0.2 * mu}; // (1.6 + 0.2 * 2)/2 = 1
  constants.alpha = {1.6, 2};
  for (const auto *law : {"neo-hookean", "st-venant-kirchhoff", "linear-elastic",
                          "neo-hookean-split", "mooney-rivlin", "ogden", "yeoh"}) {
    if (std::string_view(law) == "yeoh")
      constants.c10 = 0.5 * mu;
    const Material material = make_material(law, constants);
    const Vec<3> stretch(1 + strain, 1 - nu * strain, 1 - nu * strain);
    const Mat<3> tau = response<3>(material, stretch.asDiagonal()).stress;
    // The second order of the strain.
    EXPECT_NEAR(tau(0, 0) / (E * strain), 1, 1e-6) << law;
    EXPECT_NEAR(tau(1, 1) / (E * strain), 0, 1e-6) << law;
  }
}

// Uniaxial stretch l of incompressible rubber: P = 2 (l - l^-2)(c10 + c01/l), the formula that the
// constants are published with. K/mu = 1e7 leaves a volume change of 1e-7.
TEST(Material, mooney_rivlin_under_tension_is_the_textbook_curve) {
  const double c10 = 0.3, c01 = 0.1;
  const Material material{MooneyRivlin{{c10, c01}, {8e6}}};
  for (const double l : {0.6, 1.5, 3.0}) {
    Mat<3> F = Vec<3>(l, 1 / std::sqrt(l), 1 / std::sqrt(l)).asDiagonal();
    const Mat<3> tau = response<3>(material, F).stress;
    const double P = (tau(0, 0) - tau(1, 1)) / l; // the pressure falls out of the difference
    EXPECT_NEAR(P, 2 * (l - 1 / (l * l)) * (c10 + c01 / l), 1e-8);
  }
}

TEST(Material, constants_out_of_range_are_refused) {
  EXPECT_THROW(lame_constants(-1, 0.3), UserError);
  EXPECT_THROW(lame_constants(1, 0.5), UserError);
  EXPECT_THROW(make_material("rubber", 1, 0.3), UserError);
  EXPECT_THROW(make_material("mooney-rivlin", 1, 0.3), UserError) << "no constants: no stiffness";
  LawConstants uneven{0, 0.4};
  uneven.mu = {1, 2};
  uneven.alpha = {2};
  EXPECT_THROW(make_material("ogden", uneven), UserError);
}

} // namespace
} // namespace sluice::solid
