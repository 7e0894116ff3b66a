// SPDX-License-Identifier: MIT
// The part of preCICE's XML that this layer speaks. Whatever else stands in the file, an element or
// an attribute, is refused by name and line: nothing is ever ignored silently.
#pragma once

#include "bridge/mapping.hpp"

#include <filesystem>
#include <map>
#include <string>
#include <vector>

namespace sluice::precice_layer {

/// A field on a mesh.
struct FieldName {
  std::string data, mesh;
  bool operator==(const FieldName &) const = default;
};

struct MeshConfig {
  int dimensions = 3;
  std::vector<std::string> data;
};

struct MapConfig {
  bridge::MapKind kind = bridge::MapKind::nearest;
  bool is_write = false;        ///< direction: from an own mesh to a received one, else back
  bool is_conservative = false; ///< constraint
  std::string from, to;
};

/// A place of an own mesh whose nearest vertex is recorded after every window.
struct WatchPoint {
  std::string name, mesh;
  std::vector<double> coordinate; ///< [m]
};

struct ParticipantConfig {
  std::vector<std::string> provided;           ///< meshes
  std::map<std::string, std::string> received; ///< mesh: the participant it comes from
  std::vector<FieldName> written, read;
  std::vector<MapConfig> maps;
  std::vector<WatchPoint> watch_points;
};

struct Exchange {
  FieldName field;
  std::string from, to;
  bool has_initial = false;
};

/// When a field counts as converged: the change is at most `limit`, times the size if relative.
struct Measure {
  FieldName field;
  double limit = 0;
  bool is_relative = true;
};

struct AccelerationConfig {
  std::string kind; ///< "iqn-ils", "iqn-imvj", "aitken", "constant"; "": none
  std::vector<FieldName> fields;
  double relaxation = 0.1;
  int windows_reused = 10;
  double filter = 1e-2;
};

struct Configuration {
  std::map<std::string, int> data; ///< components: 1, or 0 for as many as the mesh has dimensions
  std::map<std::string, MeshConfig> meshes;
  std::map<std::string, ParticipantConfig> participants;
  std::string acceptor, connector, exchange_directory = ".";
  bool is_parallel = false, is_implicit = false;
  std::string first, second;
  double end_time = 0, window = 0; ///< [s]
  int min_iterations = 1, max_iterations = 100;
  std::vector<Exchange> exchanges;
  std::vector<Measure> measures;
  AccelerationConfig acceleration;
  std::string text; ///< the file itself: both sides must have read the same

  /// Components of a value; throws UserError for a field that the mesh does not have.
  int components(const FieldName &field) const;
};

/// Throws UserError with file, line and name for what is missing, wrong or not supported.
Configuration read_configuration(const std::filesystem::path &file);

} // namespace sluice::precice_layer
