// SPDX-License-Identifier: MIT
#include "fluid/rheology.hpp"

#include <algorithm>

namespace sluice::fluid {

namespace {

ViscosityLaw make_law(const RheologyParams &p, double newtonian_viscosity) {
  if (p.law == "power-law" && p.exponent == 1) // no shear rate is needed
    return Newtonian{std::clamp(p.consistency, p.lowest, p.highest)};
  if (p.law == "power-law")
    return PowerLaw{p.consistency, p.exponent};
  if (p.law == "carreau-yasuda")
    return CarreauYasuda{p.at_rest, p.at_infinity, p.time, p.exponent, p.sharpness};
  if (p.law == "cross")
    return Cross{p.at_rest, p.at_infinity, p.time, p.exponent};
  if (p.law == "bingham")
    return HerschelBulkley{p.consistency, 1, p.yield_stress, p.growth};
  if (p.law == "herschel-bulkley")
    return HerschelBulkley{p.consistency, p.exponent, p.yield_stress, p.growth};
  return Newtonian{newtonian_viscosity};
}

} // namespace

Rheology::Rheology(const RheologyParams &params, double newtonian_viscosity) : params_(params) {
  check(params.lowest <= params.highest,
        "[fluid.rheology]: lowest_viscosity_pa_s = {} exceeds highest_viscosity_pa_s = {}",
        params.lowest, params.highest);
  law_ = make_law(params, newtonian_viscosity);
}

double Rheology::exponent() const {
  if (params_.law == "power-law" || params_.law == "carreau-yasuda")
    return params_.exponent;
  return params_.law == "herschel-bulkley" ? std::max(params_.exponent, 1.0) : 1;
}

} // namespace sluice::fluid
