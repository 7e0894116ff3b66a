// SPDX-License-Identifier: MIT
#include "solid-dealii/material.hpp"

namespace sluice::solid {
namespace {

template <class L>
concept SplitLaw = requires(const L &law, const Mat<3> &F) {
  law.distortion(F);
  law.volume;
};

// The law's response in space; of a split law the sum of its two parts.
template <class L> auto whole_response(const L &law, const Mat<3> &F) {
  if constexpr (SplitLaw<L>) {
    auto r = law.distortion(F);
    law.volume.template add_to<3>(r, F.determinant());
    return r;
  } else
    return law.template respond<3>(F);
}

template <class Response, int dim>
void add_overstress(const Overstress<dim> &overstress, std::size_t point, Response &r) {
  r.scale(1 + overstress.factor);
  if (overstress.stress.empty())
    return;
  const Mat<dim> f = r.push.inverse().transpose();
  const Eigen::Map<const Eigen::Matrix<double, voigt_size<dim>, 1>> h(overstress.stress.data() +
                                                                      voigt_size<dim> * point);
  const Mat<dim> tau = f * from_voigt<dim>(h) * f.transpose();
  r.stress += tau;
  if (r.carried != Mat<dim>::Zero())
    r.carried += tau;
}

template <int dim> VoigtResponse<dim> restrict_to(const VoigtResponse<3> &r) {
  if constexpr (dim == 3)
    return r;
  else
    return in_plane(r);
}

// The stretch out of the plane at which tau33 vanishes, by Newton's method.
template <class L> double free_thickness(const L &law, const Mat<2> &F) {
  double stretch = 1 / std::sqrt(F.determinant());
  for (int k = 0; k < 50; ++k) {
    const VoigtResponse<3> r = to_voigt(whole_response(law, in_space(F, stretch)));
    // d tau33 = (c3333 + 2 carried33) d ln(stretch); of small strain: c3333 d stretch.
    const double slope = (r.tangent(2, 2) + 2 * r.carried(2, 2)) / r.push.inverse()(2, 2);
    const double change = -r.stress(2, 2) / slope;
    stretch = std::max(0.2 * stretch, stretch + change);
    if (std::abs(change) < 1e-14 * stretch)
      break;
  }
  return stretch;
}

// Plane stress: the response at the free thickness with its out-of-plane strain eliminated.
template <class L> VoigtResponse<2> plane_stress_response(const L &law, const Mat<2> &F) {
  const VoigtResponse<3> whole = to_voigt(whole_response(law, in_space(F, free_thickness(law, F))));
  VoigtResponse<2> r = in_plane(whole);
  const Vec<3> coupling(whole.tangent(0, 2), whole.tangent(1, 2), whole.tangent(3, 2));
  r.tangent -= coupling * coupling.transpose() / whole.tangent(2, 2);
  return r;
}

// Stress and tangent of one point in the shape that is asked for.
template <class Response, int dim, class L>
Response response_at(const L &law, Plane plane, const Mat<dim> &F,
                     const Overstress<dim> &overstress, std::size_t point) {
  if constexpr (std::is_same_v<Response, MetricResponse<dim>>) {
    if constexpr (SplitLaw<L>)
      fail("solid: the tangent of a split law has no closed form; ask for the general one");
    else {
      Response r = law.template respond<dim>(F);
      add_overstress(overstress, point, r);
      return r;
    }
  } else {
    if constexpr (dim == 2)
      if (plane == Plane::stress)
        return plane_stress_response(law, F);
    Response r;
    if constexpr (SplitLaw<L>) {
      r = restrict_to<dim>(law.distortion(in_space(F)));
      add_overstress(overstress, point, r);
      law.volume.template add_to<dim>(r, F.determinant());
    } else {
      r = restrict_to<dim>(to_voigt(law.template respond<3>(in_space(F))));
      add_overstress(overstress, point, r);
    }
    return r;
  }
}

template <class L, int dim> Mat<3> with_thickness(const L &law, Plane plane, const Mat<dim> &F) {
  if constexpr (dim == 2)
    if (plane == Plane::stress)
      return in_space(F, free_thickness(law, F));
  return in_space(F);
}

Volume volume_of(double shear_modulus, double poisson_ratio, std::string_view law) {
  check(shear_modulus > 0,
        "solid: the constants of the law '{}' give a shear modulus of {} Pa at small strain; it "
        "must be positive",
        law, shear_modulus);
  const double nu = poisson_ratio;
  check(nu > -1 && nu < 0.5, "solid: Poisson's ratio is {}; it must lie between -1 and 0.5", nu);
  return {2 * shear_modulus * (1 + nu) / (3 * (1 - 2 * nu))};
}

template <class Energy>
Law invariant_law(const Energy &energy, double poisson_ratio, std::string_view name) {
  return InvariantLaw<Energy>{energy, volume_of(energy.shear_modulus(), poisson_ratio, name)};
}

Law ogden_law(const LawConstants &c) {
  check(
      !c.mu.empty() && c.mu.size() == c.alpha.size(),
      "solid: Ogden's law has {} moduli and {} exponents; give as many of the one as of the other",
      c.mu.size(), c.alpha.size());
  for (const double alpha : c.alpha)
    check(alpha != 0, "solid: an exponent of Ogden's law is 0; leave that term out");
  Ogden law{c.mu, c.alpha, {}};
  law.volume = volume_of(law.shear_modulus(), c.poisson_ratio, "ogden");
  return law;
}

Law law_named(std::string_view name, const LawConstants &c) {
  if (name == "mooney-rivlin")
    return invariant_law(MooneyRivlinEnergy{c.c10, c.c01}, c.poisson_ratio, name);
  if (name == "yeoh")
    return invariant_law(YeohEnergy{c.c10, c.c20, c.c30}, c.poisson_ratio, name);
  if (name == "ogden")
    return ogden_law(c);
  const Lame lame = lame_constants(c.youngs_modulus, c.poisson_ratio);
  if (name == "neo-hookean")
    return NeoHookean{lame};
  if (name == "linear-elastic")
    return LinearElastic{lame};
  if (name == "neo-hookean-split")
    return invariant_law(MooneyRivlinEnergy{0.5 * lame.mu, 0}, c.poisson_ratio, name);
  check(name == "st-venant-kirchhoff",
        "solid: unknown material '{}'; give linear-elastic, st-venant-kirchhoff, neo-hookean, "
        "neo-hookean-split, mooney-rivlin, yeoh or ogden",
        name);
  return SaintVenantKirchhoff{lame};
}

} // namespace

bool Material::has_metric_tangent() const {
  return plane == Plane::strain && std::visit([]<class L>(const L &) { return !SplitLaw<L>; }, law);
}

const Volume *Material::volume() const {
  return std::visit(
      []<class L>(const L &l) -> const Volume * {
        if constexpr (SplitLaw<L>)
          return &l.volume;
        else
          return nullptr;
      },
      law);
}

template <int dim> double strain_energy_density(const Material &material, const Mat<dim> &F) {
  return std::visit(
      [&](const auto &law) { return law.energy(with_thickness(law, material.plane, F)); },
      material.law);
}

template <int dim> Mat<3> cauchy_stress(const Material &material, const Mat<dim> &F) {
  return std::visit(
      [&](const auto &law) {
        const Mat<3> whole = with_thickness(law, material.plane, F);
        const auto r = whole_response(law, whole);
        return Mat<3>(r.stress / r.push.inverse().determinant());
      },
      material.law);
}

template <int dim, class Response>
void respond(const Material &material, std::span<const Mat<dim>> F,
             const Overstress<dim> &overstress, std::span<Response> responses) {
  std::visit(
      [&](const auto &law) {
        for (std::size_t q = 0; q < F.size(); ++q)
          responses[q] = response_at<Response, dim>(law, material.plane, F[q], overstress, q);
      },
      material.law);
}

template <int dim>
void respond_distortion(const Material &material, std::span<const Mat<dim>> F,
                        const Overstress<dim> &overstress,
                        std::span<VoigtResponse<dim>> responses) {
  std::visit(
      [&]<class L>(const L &law) {
        if constexpr (SplitLaw<L>)
          for (std::size_t q = 0; q < F.size(); ++q) {
            responses[q] = restrict_to<dim>(law.distortion(in_space(F[q])));
            add_overstress(overstress, q, responses[q]);
          }
        else
          fail("solid: the law {} has no volume term of its own", L::name);
      },
      material.law);
}

template <int dim>
Eigen::Matrix<double, voigt_size<dim>, 1> relaxing_stress(const Material &material,
                                                          const Mat<dim> &F) {
  return std::visit(
      [&]<class L>(const L &law) {
        const auto pulled_back = [](const auto &r) {
          return to_voigt<dim>(r.push.transpose() * r.stress * r.push);
        };
        if constexpr (SplitLaw<L>)
          return pulled_back(restrict_to<dim>(law.distortion(in_space(F))));
        else
          return pulled_back(law.template respond<dim>(F));
      },
      material.law);
}

Material make_material(std::string_view law, const LawConstants &constants, Plane plane) {
  return {law_named(law, constants), plane};
}

template double strain_energy_density(const Material &, const Mat<2> &);
template double strain_energy_density(const Material &, const Mat<3> &);
template Mat<3> cauchy_stress(const Material &, const Mat<2> &);
template Mat<3> cauchy_stress(const Material &, const Mat<3> &);
template void respond(const Material &, std::span<const Mat<2>>, const Overstress<2> &,
                      std::span<MetricResponse<2>>);
template void respond(const Material &, std::span<const Mat<3>>, const Overstress<3> &,
                      std::span<MetricResponse<3>>);
template void respond(const Material &, std::span<const Mat<2>>, const Overstress<2> &,
                      std::span<VoigtResponse<2>>);
template void respond(const Material &, std::span<const Mat<3>>, const Overstress<3> &,
                      std::span<VoigtResponse<3>>);
template void respond_distortion(const Material &, std::span<const Mat<2>>, const Overstress<2> &,
                                 std::span<VoigtResponse<2>>);
template void respond_distortion(const Material &, std::span<const Mat<3>>, const Overstress<3> &,
                                 std::span<VoigtResponse<3>>);
template Eigen::Matrix<double, 3, 1> relaxing_stress(const Material &, const Mat<2> &);
template Eigen::Matrix<double, 6, 1> relaxing_stress(const Material &, const Mat<3> &);

} // namespace sluice::solid
