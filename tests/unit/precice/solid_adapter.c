/* SPDX-License-Identifier: MIT */
/* A solver with an adapter for preCICE v3 in C: a rigid wall of 1 kg on a spring, by the
 * trapezoidal rule in two sub-steps where the second argument says so. Prints the last displacement
 * and the iterations of all windows. Usage: solid_adapter precice-config.xml [nan] */
#include <precice/precicec.h>

#include <math.h>
#include <stdio.h>
#include <string.h>

int main(int argc, char **argv) {
  const double positions[] = {0, 0, 0, 0.5, 0, 1}, mass = 1, stiffness = 4e4;
  double force[6], velocity[6] = {0}, d = 0.01, v = 0, saved_d = d, saved_v = v;
  int ids[3], iterations = 0, windows = 0;
  const int spoils = argc > 2 && !strcmp(argv[2], "nan");
  if (argc < 2)
    return 2;
  precicec_createParticipant("Solid", argv[1], 0, 1);
  if (precicec_getMeshDimensions("Solid-Mesh") != 2)
    return 3;
  precicec_setMeshVertices("Solid-Mesh", 3, positions, ids);
  precicec_setMeshEdge("Solid-Mesh", ids[0], ids[1]);
  precicec_setMeshEdge("Solid-Mesh", ids[1], ids[2]);
  if (precicec_requiresInitialData())
    precicec_writeData("Solid-Mesh", "Velocity", 3, ids, velocity);
  precicec_initialize();
  while (precicec_isCouplingOngoing()) {
    if (precicec_requiresWritingCheckpoint())
      saved_d = d, saved_v = v;
    const double dt = precicec_getMaxTimeStepSize();
    precicec_readData("Solid-Mesh", "Force", 3, ids, dt, force);
    const double sum = force[0] + force[2] + force[4];
    const double v_new = (mass * v + dt * sum - dt * stiffness * (d + 0.25 * dt * v)) /
                         (mass + 0.25 * dt * dt * stiffness);
    d += 0.5 * dt * (v + v_new);
    v = v_new;
    for (int k = 0; k < 3; ++k)
      velocity[2 * k] = spoils && windows == 4 ? NAN : v;
    precicec_writeData("Solid-Mesh", "Velocity", 3, ids, velocity);
    precicec_advance(dt);
    ++iterations;
    if (precicec_requiresReadingCheckpoint())
      d = saved_d, v = saved_v;
    if (precicec_isTimeWindowComplete())
      ++windows;
  }
  precicec_finalize();
  printf("%.15g %d %d\n", d, iterations, windows);
  return 0;
}
