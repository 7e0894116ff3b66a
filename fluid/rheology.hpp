// SPDX-License-Identifier: MIT
// Generalised Newtonian fluids: the dynamic viscosity as a function of the shear rate
// gamma = sqrt(2 E : E), E the strain rate. A law is one class with `operator()(gamma)`, and
// `thins()`: does its viscosity fall with the shear rate, at low ones where it does both?
#pragma once

#include "bridge/base/config.hpp"

#include <cmath>
#include <string>
#include <variant>

namespace sluice::fluid {

/// mu
struct Newtonian {
  double viscosity = 1e-3; // [Pa s]
  double operator()(double) const { return viscosity; }
  bool thins() const { return false; }
};

/// k gamma^(n-1). Source: W. Ostwald, Kolloid-Z. 36 (1925) 99.
struct PowerLaw {
  double consistency = 1e-3, exponent = 1; // [Pa s^n], [-]
  double operator()(double gamma) const { return consistency * std::pow(gamma, exponent - 1); }
  bool thins() const { return exponent < 1; }
};

/// mu_inf + (mu_0 - mu_inf) (1 + (lambda gamma)^a)^((n-1)/a). Source: K. Yasuda, R. C. Armstrong,
/// R. E. Cohen, Rheol. Acta 20 (1981) 163.
struct CarreauYasuda {
  double at_rest = 1, at_infinity = 0;          // [Pa s]
  double time = 1, exponent = 1, sharpness = 2; // [s], [-], [-]
  double operator()(double gamma) const {
    return at_infinity + (at_rest - at_infinity) * std::pow(1 + std::pow(time * gamma, sharpness),
                                                            (exponent - 1) / sharpness);
  }
  bool thins() const { return (exponent < 1) == (at_rest > at_infinity); }
};

/// mu_inf + (mu_0 - mu_inf) / (1 + (lambda gamma)^m). Source: M. M. Cross, J. Colloid Sci. 20
/// (1965) 417.
struct Cross {
  double at_rest = 1, at_infinity = 0; // [Pa s]
  double time = 1, exponent = 1;       // [s], [-]
  double operator()(double gamma) const {
    return at_infinity + (at_rest - at_infinity) / (1 + std::pow(time * gamma, exponent));
  }
  bool thins() const { return at_rest > at_infinity; }
};

/// k gamma^(n-1) + tau_y (1 - exp(-m gamma)) / gamma; n = 1 is Bingham's fluid. The yield stress is
/// regularised after T. C. Papanastasiou, J. Rheol. 31 (1987) 385: unyielded fluid creeps at
/// gamma = tau / (tau_y m).
struct HerschelBulkley {
  double consistency = 1, exponent = 1;   // [Pa s^n], [-]
  double yield_stress = 0, growth = 1000; // [Pa], m [s]
  double operator()(double gamma) const {
    return consistency * std::pow(gamma, exponent - 1) -
           yield_stress * std::expm1(-growth * gamma) / gamma;
  }
  bool thins() const { return yield_stress > 0 || exponent < 1; }
};

using ViscosityLaw = std::variant<Newtonian, PowerLaw, CarreauYasuda, Cross, HerschelBulkley>;

/// Table [fluid.rheology]; without it the fluid is Newtonian with fluid.dynamic_viscosity_pa_s.
struct RheologyParams {
  std::string law = "newtonian";
  double consistency = 1e-3, exponent = 1;
  double at_rest = 1, at_infinity = 0, time = 1, sharpness = 2;
  double yield_stress = 0, growth = 1000;
  double lowest_shear_rate = 1e-3, highest_shear_rate = 1e300; // [1/s]
  double lowest = 0, highest = 1e9;
  double picard_tolerance = 1e-4;
  int picard_passes = 20;

  template <class Reader> void describe(Reader &read) {
    read("law", law, "viscosity as a function of the shear rate")
        .one_of(
            {"newtonian", "power-law", "carreau-yasuda", "cross", "bingham", "herschel-bulkley"});
    read("consistency_pa_s_n", consistency, "k of power-law, bingham and herschel-bulkley")
        .positive();
    read("exponent", exponent, "n of power-law, carreau-yasuda and herschel-bulkley, m of cross")
        .positive()
        .at_most(5);
    read("viscosity_at_rest_pa_s", at_rest, "of carreau-yasuda and cross").positive();
    read("viscosity_at_infinity_pa_s", at_infinity, "of carreau-yasuda and cross").at_least(0);
    read("time_s", time, "lambda of carreau-yasuda and cross").at_least(0);
    read("sharpness", sharpness, "a of carreau-yasuda").positive();
    read("yield_stress_pa", yield_stress, "of bingham and herschel-bulkley").at_least(0);
    read("regularisation_s", growth, "m of the yield stress, after Papanastasiou").positive();
    read("lowest_shear_rate_1_s", lowest_shear_rate, "the law sees no smaller one").positive();
    read("highest_shear_rate_1_s", highest_shear_rate,
         "the law sees no larger one: for singular corners, what points resolve")
        .positive();
    read("lowest_viscosity_pa_s", lowest, "lower bound").at_least(0);
    read("highest_viscosity_pa_s", highest, "upper bound").positive();
    read("picard_tolerance", picard_tolerance,
         "change of velocity from pass to pass, relative, at which passes over the law end")
        .positive();
    read("picard_passes", picard_passes, "largest number of passes over the law").at_least(1);
  }
};

/// A law with its bounds.
class Rheology {
public:
  /// Newtonian.
  explicit Rheology(double viscosity = 1e-3) : law_(Newtonian{viscosity}) {}
  /// `newtonian_viscosity` [Pa s] is that of the law "newtonian".
  Rheology(const RheologyParams &params, double newtonian_viscosity);

  bool is_newtonian() const { return std::holds_alternative<Newtonian>(law_); }
  bool is_inviscid() const { return is_newtonian() && std::get<Newtonian>(law_).viscosity == 0; }
  /// Slope d ln(mu gamma) / d ln gamma where the law is that of a power: above 1 the fluid
  /// thickens. 1 for laws that have no such range, or one below a yield stress.
  double exponent() const;
  bool thins() const {
    return std::visit([](const auto &law) { return law.thins(); }, law_);
  }
  const RheologyParams &params() const { return params_; }

  /// Calls body(viscosity) with a function of the shear rate [1/s] that returns [Pa s]: the choice
  /// of the law is made once, not per point.
  template <class Body> void with_law(Body &&body) const {
    if (is_newtonian())
      return body(std::get<Newtonian>(law_));
    std::visit(
        [&](const auto &law) {
          body([&](double gamma) {
            const double seen =
                std::min(std::hypot(gamma, params_.lowest_shear_rate), params_.highest_shear_rate);
            return std::clamp(law(seen), params_.lowest, params_.highest);
          });
        },
        law_);
  }

private:
  ViscosityLaw law_;
  RheologyParams params_;
};

} // namespace sluice::fluid
