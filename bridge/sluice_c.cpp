// SPDX-License-Identifier: MIT
#include "bridge/sluice.h"

#include "bridge/participant.hpp"

#include <algorithm>

using namespace sluice;

struct sluice_participant {
  bridge::Participant participant;
  std::string message;
};

namespace {

// Exceptions end here: C has none.
template <class Action> int guarded(sluice_participant *handle, Action &&action) {
  try {
    action(handle->participant);
    return 0;
  } catch (const std::exception &error) {
    handle->message = error.what();
    return 1;
  }
}

} // namespace

extern "C" {

sluice_participant *sluice_open(const char *role, const char *case_file, const char *out_dir,
                                char *message, size_t size) {
  try {
    return new sluice_participant{{role, Config::load(case_file), out_dir}, {}};
  } catch (const std::exception &error) {
    if (size > 0) {
      const std::string text = std::string(error.what()).substr(0, size - 1);
      std::copy_n(text.c_str(), text.size() + 1, message);
    }
    return nullptr;
  }
}

void sluice_close(sluice_participant *participant) { delete participant; }

const char *sluice_message(const sluice_participant *participant) {
  return participant->message.c_str();
}

int sluice_set_mesh(sluice_participant *participant, int dim, size_t n_nodes,
                    const double *positions, int nodes_per_face, size_t n_faces, const int *faces) {
  return guarded(participant, [&](bridge::Participant &bridge) {
    check(dim > 0 && nodes_per_face > 0, "bridge: a mesh of dimension {} with {} nodes per face",
          dim, nodes_per_face);
    const size_t n_values = static_cast<size_t>(dim) * n_nodes,
                 n_numbers = static_cast<size_t>(nodes_per_face) * n_faces;
    bridge.set_mesh(
        {dim, nodes_per_face, {positions, positions + n_values}, {faces, faces + n_numbers}});
  });
}

int sluice_initialize(sluice_participant *participant) {
  return guarded(participant, [](bridge::Participant &bridge) { bridge.initialize(); });
}
int sluice_advance(sluice_participant *participant, double dt) {
  return guarded(participant, [&](bridge::Participant &bridge) { bridge.advance(dt); });
}
int sluice_finalize(sluice_participant *participant) {
  return guarded(participant, [](bridge::Participant &bridge) { bridge.finalize(); });
}

int sluice_write_data(sluice_participant *participant, const char *field, const double *values,
                      size_t n_values) {
  return guarded(participant, [&](bridge::Participant &bridge) {
    bridge.write_data(field, {values, n_values});
  });
}
int sluice_read_data(sluice_participant *participant, const char *field, double relative_time,
                     double *values, size_t n_values) {
  return guarded(participant, [&](bridge::Participant &bridge) {
    bridge.read_data(field, relative_time, {values, n_values});
  });
}
int sluice_report_failure(sluice_participant *participant, const char *reason) {
  return guarded(participant, [&](bridge::Participant &bridge) { bridge.report_failure(reason); });
}

int sluice_is_coupling_ongoing(const sluice_participant *participant) {
  return participant->participant.is_coupling_ongoing();
}
int sluice_is_time_window_complete(const sluice_participant *participant) {
  return participant->participant.is_time_window_complete();
}
int sluice_requires_writing_checkpoint(const sluice_participant *participant) {
  return participant->participant.requires_writing_checkpoint();
}
int sluice_requires_reading_checkpoint(const sluice_participant *participant) {
  return participant->participant.requires_reading_checkpoint();
}
double sluice_max_time_step_size(const sluice_participant *participant) {
  return participant->participant.max_time_step_size();
}
double sluice_time(const sluice_participant *participant) {
  return participant->participant.time();
}

} // extern "C"
