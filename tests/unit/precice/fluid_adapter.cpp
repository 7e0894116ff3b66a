// SPDX-License-Identifier: MIT
// A solver with an adapter for preCICE v3, as its users write it: water that moves with its wall as
// one mass of 80 kg, F = -m_a (v_1 - v_0)/dt. Usage: fluid_adapter precice-config.xml
#include <precice/precice.hpp>

#include <cstdio>
#include <vector>

int main(int argc, char **argv) {
  if (argc != 2)
    return 2;
  try {
    precice::Participant participant("Fluid", argv[1], 0, 1);
    const std::string mesh = "Fluid-Mesh";
    const int dim = participant.getMeshDimensions(mesh);
    const std::vector<double> y{0, 0.3, 0.7, 1}, length{0.15, 0.35, 0.35, 0.15};
    std::vector<double> positions, force(static_cast<std::size_t>(dim) * y.size()),
        before(force.size()), after(force.size());
    for (const double height : y)
      positions.insert(positions.end(), {0, height});
    std::vector<int> ids(y.size());
    participant.setMeshVertices(mesh, positions, ids);
    for (int k = 0; k < 3; ++k)
      participant.setMeshEdge(mesh, ids[k], ids[k + 1]);
    if (participant.requiresInitialData())
      participant.writeData(mesh, "Force", ids, force);
    participant.initialize();
    while (participant.isCouplingOngoing()) {
      if (participant.requiresWritingCheckpoint()) {
      } // no state
      const double dt = participant.getMaxTimeStepSize();
      participant.readData(mesh, "Velocity", ids, 0, before);
      participant.readData(mesh, "Velocity", ids, dt, after);
      for (std::size_t k = 0; k < y.size(); ++k)
        force[2 * k] = -80 * length[k] * (after[2 * k] - before[2 * k]) / dt;
      participant.writeData(mesh, "Force", ids, force);
      participant.advance(dt);
      if (participant.requiresReadingCheckpoint()) {
      }
    }
    participant.finalize();
  } catch (const precice::Error &error) {
    std::fprintf(stderr, "%s\n", error.what());
    return 1;
  }
}
