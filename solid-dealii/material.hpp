// SPDX-License-Identifier: MIT
// The material of a body: one law, with true plane strain or plane stress in two dimensions.
//
// Laws answer for a batch of points (one cell), so the choice of law costs one call per cell.
// In plane stress the stretch out of the plane follows from tau33 = 0 at every point.
#pragma once

#include "solid-dealii/laws_split.hpp"

#include <span>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

namespace sluice::solid {

/// Neo-Hookean distortion with its own volume energy, Mooney-Rivlin, Yeoh.
using MooneyRivlin = InvariantLaw<MooneyRivlinEnergy>;
using Yeoh = InvariantLaw<YeohEnergy>;

using Law =
    std::variant<NeoHookean, SaintVenantKirchhoff, LinearElastic, MooneyRivlin, Yeoh, Ogden>;

enum class Plane { strain, stress };

/// Viscous stress beside that of the law (viscosity.hpp): `factor` times the stress of the law's
/// part that relaxes, and F h F^T with h per point (second Piola-Kirchhoff [Pa], Voigt).
template <int dim> struct Overstress {
  double factor = 0;
  std::span<const double> stress = {}; ///< [point][component]; empty: none
};

struct Material {
  Law law;
  Plane plane = Plane::strain;

  /// Whether MetricResponse can hold its tangent; else ask for VoigtResponse.
  bool has_metric_tangent() const;
  /// The energy of volume of a split law; null for the others.
  const Volume *volume() const;
  /// Whether the law is one of small strain, for which no element can be inverted.
  bool is_small_strain() const { return std::holds_alternative<LinearElastic>(law); }
};

/// Strain energy per reference volume [J/m^3] at a deformation gradient.
template <int dim> double strain_energy_density(const Material &material, const Mat<dim> &F);

/// Cauchy stress [Pa] with its part out of the plane.
template <int dim> Mat<3> cauchy_stress(const Material &material, const Mat<dim> &F);

/// Fills `responses`, one per deformation gradient; needs det F > 0.
template <int dim, class Response>
void respond(const Material &material, std::span<const Mat<dim>> F,
             const Overstress<dim> &overstress, std::span<Response> responses);

/// The part of `respond` that belongs to the distortion; a split law in plane strain only.
template <int dim>
void respond_distortion(const Material &material, std::span<const Mat<dim>> F,
                        const Overstress<dim> &overstress, std::span<VoigtResponse<dim>> responses);

/// Second Piola-Kirchhoff stress [Pa] of the part of the law that relaxes: of the distortion for a
/// split law, all of it for the others.
template <int dim>
Eigen::Matrix<double, voigt_size<dim>, 1> relaxing_stress(const Material &material,
                                                          const Mat<dim> &F);

/// Constants of a law as a case file gives them; each law uses its own.
struct LawConstants {
  double youngs_modulus = 0;      ///< [Pa]
  double poisson_ratio = 0;       ///< [1]
  double c10 = 0, c01 = 0;        ///< [Pa] Mooney-Rivlin
  double c20 = 0, c30 = 0;        ///< [Pa] Yeoh
  std::vector<double> mu = {};    ///< [Pa] Ogden
  std::vector<double> alpha = {}; ///< [1] Ogden
};

/// `law` is "linear-elastic", "st-venant-kirchhoff", "neo-hookean", "neo-hookean-split",
/// "mooney-rivlin", "yeoh" or "ogden". Throws UserError for constants without a positive shear
/// modulus at small strain.
Material make_material(std::string_view law, const LawConstants &constants,
                       Plane plane = Plane::strain);
inline Material make_material(std::string_view law, double youngs_modulus, double poisson_ratio) {
  return make_material(law, LawConstants{youngs_modulus, poisson_ratio});
}

} // namespace sluice::solid
