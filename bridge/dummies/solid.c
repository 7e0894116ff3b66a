/* SPDX-License-Identifier: MIT */
/* A complete structural solver in C: a rigid wall on a spring, by the trapezoidal rule.
 * Prints the last displacement. Usage: dummy_solid_c CASE.toml --out DIR, or --check */
#include "bridge/sluice.h"

#include <stdio.h>
#include <string.h>

static const double mass = 1, stiffness = 4e4; /* [kg/m], [N/m^2] */

static int failed(const char *message) {
  fprintf(stderr, "dummy_solid_c: %s\n", message);
  return 1;
}

static void write_motion(double d, double v, double *displacement, double *velocity) {
  for (int k = 0; k < 6; ++k) {
    displacement[k] = k % 2 == 0 ? d : 0;
    velocity[k] = k % 2 == 0 ? v : 0;
  }
}

int main(int argc, char **argv) {
  const double positions[] = {0, 0, 0, 0.5, 0, 1};
  const int faces[] = {0, 1, 1, 2};
  double force[6], displacement[6], velocity[6], d = 0.01, v = 0, saved_d = d, saved_v = v;
  char message[1000];
  if (argc != 4 || strcmp(argv[2], "--out") != 0) /* --check finds nothing to look at here */
    return argc == 3 && !strcmp(argv[2], "--check") ? 0 : failed("usage: CASE.toml --out DIR");
  sluice_participant *bridge = sluice_open("solid", argv[1], argv[3], message, sizeof message);
  if (!bridge)
    return failed(message);
  write_motion(d, v, displacement, velocity);
  int error = sluice_set_mesh(bridge, 2, 3, positions, 2, 2, faces) ||
              sluice_write_data(bridge, "displacement", displacement, 6) ||
              sluice_initialize(bridge);
  while (!error && sluice_is_coupling_ongoing(bridge)) {
    const double dt = sluice_max_time_step_size(bridge);
    if (sluice_requires_writing_checkpoint(bridge))
      saved_d = d, saved_v = v;
    error = sluice_read_data(bridge, "force", dt, force, 6);
    const double sum = force[0] + force[2] + force[4];
    const double v_new = (mass * v + dt * sum - dt * stiffness * (d + 0.25 * dt * v)) /
                         (mass + 0.25 * dt * dt * stiffness);
    d += 0.5 * dt * (v + v_new);
    v = v_new;
    write_motion(d, v, displacement, velocity);
    error = error || sluice_write_data(bridge, "displacement", displacement, 6) ||
            sluice_write_data(bridge, "velocity", velocity, 6) || sluice_advance(bridge, dt);
    if (!error && sluice_requires_reading_checkpoint(bridge))
      d = saved_d, v = saved_v;
  }
  error = error || sluice_finalize(bridge);
  printf("%.15g\n", d);
  const int status = error ? failed(sluice_message(bridge)) : 0;
  sluice_close(bridge);
  return status;
}
