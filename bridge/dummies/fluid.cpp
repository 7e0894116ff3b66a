// SPDX-License-Identifier: MIT
// A complete fluid solver in C++: water that moves with its wall as one mass, F = -m_a (v_1 -
// v_0)/dt. Usage: dummy_fluid CASE.toml --out DIR, or --check, as `sluice run` calls it
#include "bridge/participant.hpp"

#include <cstdio>
#include <string_view>
#include <vector>

namespace {

constexpr double added_mass = 80;                         // [kg/m]
const std::vector<double> length{0.15, 0.35, 0.35, 0.15}; // [m] of wall that belongs to a node

void run(sluice::bridge::Participant &bridge) {
  bridge.set_mesh({2, 2, {0, 0, 0, 0.3, 0, 0.7, 0, 1}, {0, 1, 1, 2, 2, 3}});
  bridge.initialize();
  std::vector<double> before(8), after(8), force(8);
  while (bridge.is_coupling_ongoing()) {
    const double dt = bridge.max_time_step_size();
    bridge.read_data("velocity", 0, before);
    bridge.read_data("velocity", dt, after);
    for (std::size_t node = 0; node < 4; ++node)
      force[2 * node] = -added_mass * length[node] * (after[2 * node] - before[2 * node]) / dt;
    bridge.write_data("force", force);
    bridge.advance(dt);
  }
  bridge.finalize();
}

} // namespace

int main(int argc, char **argv) {
  try {
    if (argc == 3 && argv[2] == std::string_view("--check"))
      return 0;
    sluice::check(argc == 4 && argv[2] == std::string_view("--out"),
                  "usage: CASE.toml --out DIR, or CASE.toml --check");
    sluice::bridge::Participant bridge("fluid", sluice::Config::load(argv[1]), argv[3]);
    run_coupled(bridge, [&] { run(bridge); });
  } catch (const std::exception &error) {
    std::fprintf(stderr, "dummy_fluid: %s\n", error.what());
    return 1;
  }
}
