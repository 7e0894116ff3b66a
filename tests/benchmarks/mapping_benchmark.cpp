// SPDX-License-Identifier: MIT
// Accuracy, conservation and cost of every map on non-matching surfaces; prints a Markdown table.
// Usage: mapping_benchmark [largest size, one of 1k 4k 16k 64k; default 64k]
#include "bridge/base/timer.hpp"
#include "bridge/mapping.hpp"
#include "tests/support/mapping_case.hpp"

#include <fmt/format.h>

#include <cstdio>
#include <string>
#include <vector>

using namespace sluice;
using namespace sluice::bridge;
using namespace sluice::bridge::benchmark;

namespace {

struct Method {
  std::string name;
  MapKind kind;
};

const std::vector<Method> methods{{"nearest", MapKind::nearest},
                                  {"projection", MapKind::projection},
                                  {"mortar", MapKind::mortar},
                                  {"rbf", MapKind::rbf}};

// Least CPU time of the runs that fit into a fifth of a second, at least one [ms].
template <class Body> double cpu_ms(Body &&body) {
  double best = 1e300;
  const Stopwatch watch;
  do {
    const double begin = process_cpu_time();
    body();
    best = std::min(best, 1e3 * (process_cpu_time() - begin));
  } while (watch.seconds() < 0.2);
  return best;
}

void print_row(Surface surface, const InterfaceMesh &fluid, const InterfaceMesh &solid,
               const Method &method) {
  Mapping map;
  const double set_up = cpu_ms([&] { map = make_mapping(method.kind, fluid, solid); });
  const auto f = scalars(surface, solid), u = displacements(solid);
  const auto forces = nodal_forces(surface, fluid);
  std::vector<double> mapped_f, mapped_u, mapped_forces;
  const double force_ms = cpu_ms([&] { mapped_forces = map.conservative(forces); });
  const double motion_ms = cpu_ms([&] { mapped_u = map.consistent(u); });
  mapped_f = map.consistent(f);
  const FieldError f_error = error(mapped_f, scalars(surface, fluid));
  const FieldError u_error = error(mapped_u, displacements(fluid));
  const ForceError force = force_error(surface, fluid, forces, solid, mapped_forces);
  const double fluid_work = work(forces, mapped_u), solid_work = work(mapped_forces, u);
  fmt::print("| {} {}/{} | {} | {:.1e} | {:.1e} | {:.1e} | {:.0e} | {:.0e} | {:.1e} | {:.1e} | "
             "{:.0f} % | {:.0e} | {:.1f} | {:.0f} | {:.2f} | {:.2f} |\n",
             surface == Surface::sphere ? "sphere" : "plate", fluid.n_nodes(), solid.n_nodes(),
             method.name, f_error.l2, f_error.largest, u_error.l2, force.force, force.moment,
             force.traction_l2, force.traction_max, 100 * force.empty,
             std::abs(fluid_work - solid_work) / std::abs(fluid_work),
             static_cast<double>(map.matrix().nonZeros()) / static_cast<double>(fluid.n_nodes()),
             set_up, force_ms, motion_ms);
  std::fflush(stdout);
}

struct Size {
  std::string name;
  InterfaceMesh fluid_sphere, solid_sphere, fluid_plate, solid_plate;
};

void print_rows(Surface surface, const InterfaceMesh &fluid, const InterfaceMesh &solid) {
  for (const Method &method : methods)
    print_row(surface, fluid, solid, method);
}

} // namespace

int main(int argc, char **argv) {
  const std::string last = argc > 1 ? argv[1] : "64k";
  std::vector<Size> sizes;
  std::uint64_t state = first_state;
  const std::vector<std::string> names{"1k", "4k", "16k", "64k"};
  for (int k = 0; k < 4; ++k) {
    const int ico[] = {10, 20, 40, 80}, cube[] = {13, 26, 52, 103}, fluid[] = {33, 65, 127, 253},
              solid[] = {32, 64, 126, 252};
    sizes.push_back({names[static_cast<std::size_t>(k)], geodesic_sphere(ico[k]),
                     cubed_sphere(cube[k]), jittered_plate(fluid[k], state),
                     regular_plate(solid[k])});
    if (sizes.back().name == last)
      break;
  }
  fmt::print(
      "| surface fluid/solid | map | f: l2 | f: max | u: l2 | force | moment | traction l2 | "
      "traction max | empty | work | entries a row | set-up ms | forces ms | motion ms |\n"
      "|---|---|---|---|---|---|---|---|---|---|---|---|---|---|---|\n");
  for (const Size &size : sizes) {
    print_rows(Surface::sphere, size.fluid_sphere, size.solid_sphere);
    print_rows(Surface::plate, size.fluid_plate, size.solid_plate);
  }
  if (sizes.size() >= 3) {
    print_rows(Surface::sphere, sizes[2].fluid_sphere, sizes[0].solid_sphere);
    print_rows(Surface::sphere, sizes[0].fluid_sphere, sizes[2].solid_sphere);
  }
  if (sizes.size() >= 4)
    print_rows(Surface::sphere, sizes[3].fluid_sphere, sizes[1].solid_sphere);
}
