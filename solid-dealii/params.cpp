// SPDX-License-Identifier: MIT
#include "solid-dealii/params.hpp"

#include <filesystem>

namespace sluice::solid {
namespace {

void check_vector(const Config &config, const std::string &what, const std::vector<double> &v,
                  int dimension) {
  check(v.empty() || static_cast<int>(v.size()) == dimension,
        "{}: [solid] {} has {} components; dimension = {}", config.file_name(), what, v.size(),
        dimension);
}

} // namespace

SolidParams read_params(const Config &config) {
  SolidParams p = config.read<SolidParams>("solid");
  p.boundaries = config.read_all<BoundaryParams>("solid.boundary");
  p.probes = config.read_all<ProbeParams>("solid.probe");
  if (!p.mesh.empty()) {
    p.mesh = (std::filesystem::path(config.file_name()).parent_path() / p.mesh).string();
    check(!p.boundaries.empty(),
          "{}: [solid] mesh = {} needs [[solid.boundary]] tables: name what is clamped and what is "
          "wetted",
          config.file_name(), p.mesh);
  }
  check_vector(config, "gravity_m_s2", p.gravity, p.dimension);
  for (const auto &boundary : p.boundaries)
    check_vector(config, "boundary '" + boundary.name + "': traction_pa", boundary.traction,
                 p.dimension);
  for (const auto &probe : p.probes)
    check(static_cast<int>(probe.position.size()) == p.dimension,
          "{}: [solid] probe '{}': position_m has {} components; dimension = {}",
          config.file_name(), probe.name, probe.position.size(), p.dimension);
  check(p.plane == "strain" || p.dimension == 2,
        "{}: [solid] plane = \"stress\" needs dimension = 2", config.file_name());
  check(
      p.plane == "strain" || !p.viscosity.has_stress(),
      "{}: [solid] plane = \"stress\" goes with neither stiffness_damping_s nor branch_ratio; use "
      "mass_damping_per_s, or dimension = 3",
      config.file_name());
  check(p.interface == "own" || p.dimension == 3,
        "{}: [solid] interface = \"plane\" needs dimension = 3", config.file_name());
  return p;
}

} // namespace sluice::solid
