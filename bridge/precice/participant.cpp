// SPDX-License-Identifier: MIT
// The calls of preCICE's interface, handed on to Coupling; every error leaves as precice::Error.
#include "bridge/base/check.hpp"
#include "bridge/precice/coupling.hpp"

#include <precice/precice.hpp>

namespace precice {

namespace {

std::string text_of(string_view name) { return {name.data(), name.size()}; }

template <class Action> auto translated(Action &&action) {
  try {
    return action();
  } catch (const std::exception &error) {
    throw Error(error.what());
  }
}

} // namespace

class Participant::Impl {
public:
  Impl(const std::string &name, const std::string &file)
      : coupling(sluice::precice_layer::read_configuration(file), name) {}
  sluice::bridge::InterfaceMesh &own(string_view mesh) { return coupling.own_mesh(text_of(mesh)); }
  void add_faces(string_view name, std::span<const int> nodes, int nodes_per_face) {
    sluice::bridge::InterfaceMesh &mesh = own(name);
    // Edges in space only help to name triangles; there is nothing to be done with them.
    if (mesh.nodes_per_face == nodes_per_face)
      mesh.faces.insert(mesh.faces.end(), nodes.begin(), nodes.end());
    sluice::check(nodes_per_face <= mesh.dim, "precice: the plane mesh '{}' has no triangles",
                  text_of(name));
  }
  sluice::precice_layer::Coupling coupling;
};

Participant::Participant(string_view participantName, string_view configurationFileName,
                         int solverProcessIndex, int solverProcessSize) {
  translated([&] {
    sluice::check(
        solverProcessIndex == 0 && solverProcessSize == 1,
        "precice: {} runs on {} ranks; Sluice's preCICE layer couples one rank each so far",
        text_of(participantName), solverProcessSize);
    impl_ = std::make_unique<Impl>(text_of(participantName), text_of(configurationFileName));
  });
}
Participant::~Participant() = default;
Participant::Participant(Participant &&) noexcept = default;

void Participant::initialize() {
  translated([&] { impl_->coupling.initialize(); });
}
void Participant::advance(double computedTimeStepSize) {
  translated([&] { impl_->coupling.advance(computedTimeStepSize); });
}
void Participant::finalize() {
  translated([&] { impl_->coupling.finalize(); });
}

int Participant::getMeshDimensions(string_view meshName) const {
  return translated([&] {
    const auto &meshes = impl_->coupling.config().meshes;
    const auto mesh = meshes.find(text_of(meshName));
    sluice::check(mesh != meshes.end(), "precice: there is no mesh '{}'", text_of(meshName));
    return mesh->second.dimensions;
  });
}
int Participant::getDataDimensions(string_view meshName, string_view dataName) const {
  return translated([&] {
    return impl_->coupling.config().components({text_of(dataName), text_of(meshName)});
  });
}
bool Participant::isCouplingOngoing() const { return impl_->coupling.is_ongoing(); }
bool Participant::isTimeWindowComplete() const { return impl_->coupling.is_window_complete(); }
double Participant::getMaxTimeStepSize() const { return impl_->coupling.time_left(); }

bool Participant::requiresInitialData() { return impl_->coupling.requires_initial_data(); }
bool Participant::requiresWritingCheckpoint() {
  return impl_->coupling.requires_writing_checkpoint();
}
bool Participant::requiresReadingCheckpoint() {
  return impl_->coupling.requires_reading_checkpoint();
}
bool Participant::requiresMeshConnectivityFor(string_view) const { return true; }

VertexID Participant::setMeshVertex(string_view meshName, span<const double> position) {
  VertexID id = 0;
  setMeshVertices(meshName, position, {&id, 1});
  return id;
}
void Participant::setMeshVertices(string_view meshName, span<const double> coordinates,
                                  span<VertexID> ids) {
  translated([&] {
    sluice::bridge::InterfaceMesh &mesh = impl_->own(meshName);
    const auto dim = static_cast<std::size_t>(mesh.dim);
    sluice::check(coordinates.size() == dim * ids.size(),
                  "precice: {} coordinates for {} vertices of '{}' in {} dimensions",
                  coordinates.size(), ids.size(), text_of(meshName), mesh.dim);
    for (std::size_t k = 0; k < ids.size(); ++k)
      ids[k] = static_cast<VertexID>(mesh.positions.size() / dim + k);
    mesh.positions.insert(mesh.positions.end(), coordinates.begin(), coordinates.end());
  });
}
int Participant::getMeshVertexSize(string_view meshName) const {
  return translated(
      [&] { return static_cast<int>(impl_->coupling.mesh(text_of(meshName)).n_nodes()); });
}
void Participant::setMeshEdge(string_view meshName, VertexID first, VertexID second) {
  const VertexID ids[] = {first, second};
  setMeshEdges(meshName, ids);
}
void Participant::setMeshEdges(string_view meshName, span<const VertexID> ids) {
  translated([&] { impl_->add_faces(meshName, {ids.data(), ids.size()}, 2); });
}
void Participant::setMeshTriangle(string_view meshName, VertexID first, VertexID second,
                                  VertexID third) {
  const VertexID ids[] = {first, second, third};
  setMeshTriangles(meshName, ids);
}
void Participant::setMeshTriangles(string_view meshName, span<const VertexID> ids) {
  translated([&] { impl_->add_faces(meshName, {ids.data(), ids.size()}, 3); });
}

void Participant::writeData(string_view meshName, string_view dataName, span<const VertexID> ids,
                            span<const double> values) {
  translated([&] {
    impl_->coupling.write({text_of(dataName), text_of(meshName)}, {ids.data(), ids.size()},
                          {values.data(), values.size()});
  });
}
void Participant::readData(string_view meshName, string_view dataName, span<const VertexID> ids,
                           double relativeReadTime, span<double> values) const {
  translated([&] {
    impl_->coupling.read({text_of(dataName), text_of(meshName)}, {ids.data(), ids.size()},
                         relativeReadTime, {values.data(), values.size()});
  });
}

} // namespace precice
