/* SPDX-License-Identifier: MIT */
/* The bridge for C, and for whatever can call C: the verbs of participant.hpp, where their meaning
 * is written down. Functions that can fail return 0, or 1 after which sluice_message says what,
 * where and what to do; the partner has been told by then. Arrays hold dim values per node, node by
 * node. */
#ifndef SLUICE_H
#define SLUICE_H

#include <stddef.h>

#ifdef __cplusplus
extern "C" {
#endif

typedef struct sluice_participant sluice_participant;

/* `role` is "fluid" or "solid". NULL on failure, with the reason in `message` (of `size` bytes). */
sluice_participant *sluice_open(const char *role, const char *case_file, const char *out_dir,
                                char *message, size_t size);
/* Ends the participant; without sluice_finalize the partner is told that this side gave up. */
void sluice_close(sluice_participant *participant);
/* What the last function that returned 1 has to say. */
const char *sluice_message(const sluice_participant *participant);

/* `positions` [m]: dim per node; `faces`: nodes_per_face node numbers from 0 per face, may be NULL.
 */
int sluice_set_mesh(sluice_participant *participant, int dim, size_t n_nodes,
                    const double *positions, int nodes_per_face, size_t n_faces, const int *faces);
int sluice_initialize(sluice_participant *participant);
int sluice_advance(sluice_participant *participant, double dt);
int sluice_finalize(sluice_participant *participant);

int sluice_write_data(sluice_participant *participant, const char *field, const double *values,
                      size_t n_values);
int sluice_read_data(sluice_participant *participant, const char *field, double relative_time,
                     double *values, size_t n_values);
int sluice_report_failure(sluice_participant *participant, const char *reason);

/* Questions: 1 yes, 0 no. */
int sluice_is_coupling_ongoing(const sluice_participant *participant);
int sluice_is_time_window_complete(const sluice_participant *participant);
int sluice_requires_writing_checkpoint(const sluice_participant *participant);
int sluice_requires_reading_checkpoint(const sluice_participant *participant);
/* What is left of the window [s]; the current time [s]. */
double sluice_max_time_step_size(const sluice_participant *participant);
double sluice_time(const sluice_participant *participant);

#ifdef __cplusplus
}
#endif

#endif
