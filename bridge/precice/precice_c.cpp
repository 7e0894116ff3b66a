// SPDX-License-Identifier: MIT
// That interface has no way to report an error and one participant per program: hence the exit, and
// the one object here.
#include <precice/precice.hpp>
#include <precice/precicec.h>

#include <cstdio>
#include <cstdlib>
#include <optional>

namespace {

std::optional<precice::Participant> participant;

template <class Action> auto run(Action &&action) {
  try {
    if (!participant)
      throw precice::Error("precice: precicec_createParticipant comes first");
    return action(*participant);
  } catch (const std::exception &error) {
    std::fprintf(stderr, "%s\n", error.what());
    participant.reset(); // the partner is told
    std::exit(1);
  }
}

precice::span<const int> ids_of(int size, const int *ids) {
  return {ids, static_cast<std::size_t>(size)};
}
template <class T> precice::span<T> values_of(const char *mesh, const char *data, int size, T *v) {
  const int n = participant ? participant->getDataDimensions(mesh, data) : 0;
  return {v, static_cast<std::size_t>(n) * static_cast<std::size_t>(size)};
}
template <class T> precice::span<T> positions_of(const char *mesh, int size, T *x) {
  const int n = participant ? participant->getMeshDimensions(mesh) : 0;
  return {x, static_cast<std::size_t>(n) * static_cast<std::size_t>(size)};
}

} // namespace

extern "C" {

void precicec_createParticipant(const char *name, const char *file, int rank, int size) {
  try {
    participant.emplace(name, file, rank, size);
  } catch (const std::exception &error) {
    std::fprintf(stderr, "%s\n", error.what());
    std::exit(1);
  }
}
void precicec_initialize() {
  run([](auto &p) { p.initialize(); });
}
void precicec_advance(double dt) {
  run([&](auto &p) { p.advance(dt); });
}
void precicec_finalize() {
  run([](auto &p) { p.finalize(); });
  participant.reset();
}
int precicec_getMeshDimensions(const char *mesh) {
  return run([&](auto &p) { return p.getMeshDimensions(mesh); });
}
int precicec_getDataDimensions(const char *mesh, const char *data) {
  return run([&](auto &p) { return p.getDataDimensions(mesh, data); });
}
int precicec_isCouplingOngoing() {
  return run([](auto &p) { return p.isCouplingOngoing(); });
}
int precicec_isTimeWindowComplete() {
  return run([](auto &p) { return p.isTimeWindowComplete(); });
}
double precicec_getMaxTimeStepSize() {
  return run([](auto &p) { return p.getMaxTimeStepSize(); });
}
int precicec_requiresInitialData() {
  return run([](auto &p) { return p.requiresInitialData(); });
}
int precicec_requiresWritingCheckpoint() {
  return run([](auto &p) { return p.requiresWritingCheckpoint(); });
}
int precicec_requiresReadingCheckpoint() {
  return run([](auto &p) { return p.requiresReadingCheckpoint(); });
}
int precicec_requiresMeshConnectivityFor(const char *mesh) {
  return run([&](auto &p) { return p.requiresMeshConnectivityFor(mesh); });
}
int precicec_setMeshVertex(const char *mesh, const double *position) {
  return run([&](auto &p) { return p.setMeshVertex(mesh, positions_of(mesh, 1, position)); });
}
void precicec_setMeshVertices(const char *mesh, int size, const double *positions, int *ids) {
  run([&](auto &p) {
    p.setMeshVertices(mesh, positions_of(mesh, size, positions),
                      {ids, static_cast<std::size_t>(size)});
  });
}
int precicec_getMeshVertexSize(const char *mesh) {
  return run([&](auto &p) { return p.getMeshVertexSize(mesh); });
}
void precicec_setMeshEdge(const char *mesh, int first, int second) {
  run([&](auto &p) { p.setMeshEdge(mesh, first, second); });
}
void precicec_setMeshTriangle(const char *mesh, int first, int second, int third) {
  run([&](auto &p) { p.setMeshTriangle(mesh, first, second, third); });
}
void precicec_setMeshTriangles(const char *mesh, int size, const int *ids) {
  run([&](auto &p) { p.setMeshTriangles(mesh, ids_of(3 * size, ids)); });
}
void precicec_writeData(const char *mesh, const char *data, int size, const int *ids,
                        const double *values) {
  run([&](auto &p) {
    p.writeData(mesh, data, ids_of(size, ids), values_of(mesh, data, size, values));
  });
}
void precicec_readData(const char *mesh, const char *data, int size, const int *ids,
                       double relative_time, double *values) {
  run([&](auto &p) {
    p.readData(mesh, data, ids_of(size, ids), relative_time, values_of(mesh, data, size, values));
  });
}
void precicec_startProfilingSection(const char *) {}
void precicec_stopLastProfilingSection() {}

} // extern "C"
