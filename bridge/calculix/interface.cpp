// SPDX-License-Identifier: MIT
#include "bridge/calculix/interface.hpp"

#include "bridge/base/check.hpp"

#include <Eigen/Geometry>
#include <fmt/ranges.h>

#include <algorithm>
#include <cassert>
#include <limits>
#include <optional>

namespace sluice::calculix {
namespace {

using Face = std::vector<int>; // deck nodes, seen from outside in counter-clockwise order

/// Nodes that lie closer than this, relative to the set's extent, are in the same place.
constexpr double same_place = 1e-6;

Vec<3> centre(const Deck &deck, const std::vector<int> &nodes) {
  Vec<3> sum = Vec<3>::Zero();
  for (const int node : nodes)
    sum += deck.nodes.at(node);
  return sum / static_cast<double>(nodes.size());
}

void turn_outwards(const Deck &deck, const Element &element, Face &face) {
  const auto x = [&](std::size_t a) { return deck.nodes.at(face[a]); };
  const Vec<3> normal = (x(1) - x(0)).cross(x(face.size() - 1) - x(0));
  if (normal.dot(centre(deck, face) - centre(deck, element.nodes)) < 0)
    std::reverse(face.begin() + 1, face.end());
}

// Outer faces with all nodes in `set`: those that belong to one element only.
std::vector<Face> outer_faces(const Deck &deck, const std::vector<int> &set) {
  std::map<std::vector<int>, std::optional<Face>> found; // by sorted nodes; none: met twice
  for (const Element &element : deck.elements)
    for (const std::vector<int> &corners : faces_of(element)) {
      Face face;
      for (const int corner : corners)
        face.push_back(element.nodes[static_cast<std::size_t>(corner)]);
      if (!std::all_of(face.begin(), face.end(),
                       [&](int node) { return std::binary_search(set.begin(), set.end(), node); }))
        continue;
      turn_outwards(deck, element, face);
      std::vector<int> key = face;
      std::sort(key.begin(), key.end());
      const auto [entry, is_new] = found.try_emplace(key, face);
      if (!is_new)
        entry->second.reset();
    }
  std::vector<Face> faces;
  for (const auto &[key, face] : found)
    if (face)
      faces.push_back(*face);
  return faces;
}

std::string skipped_note(const Deck &deck) {
  if (deck.skipped_types.empty())
    return "";
  return fmt::format(" (elements of type {} are not read; C3D4, C3D6, C3D8, C3D8I and C3D8R are)",
                     fmt::join(deck.skipped_types, ", "));
}

void check_covered(const Deck &deck, std::string_view name, const std::vector<int> &set,
                   const std::vector<Face> &faces) {
  std::vector<int> covered;
  for (const Face &face : faces)
    covered.insert(covered.end(), face.begin(), face.end());
  std::sort(covered.begin(), covered.end());
  for (const int node : set)
    check(std::binary_search(covered.begin(), covered.end(), node),
          "{}: node {} of set {} at ({:.6g}, {:.6g}, {:.6g}) m is a corner of no outer face whose "
          "nodes are all in the set; the set must hold whole faces{}",
          deck.file, node, name, deck.nodes.at(node).x(), deck.nodes.at(node).y(),
          deck.nodes.at(node).z(), skipped_note(deck));
}

/// Nodes of a slab with the same x and y, in order of z.
class Columns {
public:
  Columns(const Deck &deck, const std::vector<int> &set) : deck_(deck) {
    Vec<3> low = Vec<3>::Constant(std::numeric_limits<double>::infinity()), high = -low;
    for (const int node : set) {
      low = low.cwiseMin(deck.nodes.at(node));
      high = high.cwiseMax(deck.nodes.at(node));
    }
    tolerance_ = same_place * (high - low).norm();
    depth_ = high.z() - low.z();
    for (const int node : set)
      add(node);
    for (std::vector<int> &column : nodes_)
      std::sort(column.begin(), column.end(), [&](int a, int b) { return z(a) < z(b); });
  }

  double depth() const { return depth_; }
  double tolerance() const { return tolerance_; }
  int of(int node) const { return column_of_.at(node); }
  const std::vector<std::vector<int>> &nodes() const { return nodes_; }
  double z(int node) const { return deck_.nodes.at(node).z(); }

private:
  void add(int node) {
    const Vec<3> &x = deck_.nodes.at(node);
    for (auto it = by_x_.lower_bound(x.x() - tolerance_);
         it != by_x_.end() && it->first <= x.x() + tolerance_; ++it) {
      const int first = nodes_[static_cast<std::size_t>(it->second)].front();
      if (std::abs(deck_.nodes.at(first).y() - x.y()) > tolerance_)
        continue;
      nodes_[static_cast<std::size_t>(it->second)].push_back(node);
      column_of_[node] = it->second;
      return;
    }
    column_of_[node] = static_cast<int>(nodes_.size());
    by_x_.emplace(x.x(), static_cast<int>(nodes_.size()));
    nodes_.push_back({node});
  }

  const Deck &deck_;
  double tolerance_ = 0, depth_ = 0;
  std::vector<std::vector<int>> nodes_;
  std::map<int, int> column_of_;
  std::multimap<double, int> by_x_;
};

// The trapezoidal rule over the depth.
std::vector<Share> shares_of(const Columns &columns, const std::vector<int> &column) {
  std::vector<Share> shares;
  const double depth = columns.z(column.back()) - columns.z(column.front());
  for (std::size_t k = 0; k < column.size(); ++k) {
    const double below = columns.z(column[k == 0 ? k : k - 1]);
    const double above = columns.z(column[std::min(k + 1, column.size() - 1)]);
    shares.push_back({column[k], (above - below) / (2 * depth)});
  }
  return shares;
}

// The two places of a face that stands on the plane, in an order that leaves the fluid on its left;
// none for a face in a plane z = constant.
std::optional<std::pair<int, int>> segment_of(const Deck &deck, const Columns &columns,
                                              const Face &face) {
  std::vector<int> places;
  for (const int node : face)
    places.push_back(columns.of(node));
  std::sort(places.begin(), places.end());
  places.erase(std::unique(places.begin(), places.end()), places.end());
  if (places.size() != 2)
    return std::nullopt;
  const auto at = [&](int place) {
    return deck.nodes.at(columns.nodes()[static_cast<std::size_t>(place)].front());
  };
  const Vec<3> normal = (deck.nodes.at(face[1]) - deck.nodes.at(face[0]))
                            .cross(deck.nodes.at(face.back()) - deck.nodes.at(face[0]));
  const Vec<3> along = at(places[1]) - at(places[0]);
  if (rotated_left(along.head<2>()).dot(normal.head<2>()) < 0)
    std::swap(places[0], places[1]);
  return std::pair(places[0], places[1]);
}

Interface slab_interface(const Deck &deck, std::string_view name, const std::vector<int> &set,
                         const std::vector<Face> &faces) {
  const Columns columns(deck, set);
  Interface result;
  result.depth = columns.depth();
  check(result.depth > columns.tolerance(),
        "{}: set {} has no extent along z; a plane case (solid.dimension = 2) needs a slab between "
        "two planes z = constant, with the set's nodes on both",
        deck.file, name);
  std::vector<std::pair<int, int>> segments;
  for (const Face &face : faces)
    if (const auto segment = segment_of(deck, columns, face))
      segments.push_back(*segment);
  std::sort(segments.begin(), segments.end()); // one for each element along z
  segments.erase(std::unique(segments.begin(), segments.end()), segments.end());
  for (const auto &[a, b] : segments)
    result.mesh.faces.insert(result.mesh.faces.end(), {a, b});
  for (const std::vector<int> &column : columns.nodes()) {
    const Vec<3> &x = deck.nodes.at(column.front());
    check(columns.z(column.back()) - columns.z(column.front()) >=
              result.depth - columns.tolerance(),
          "{}: the nodes of set {} at x = {:.6g} m, y = {:.6g} m do not reach over its depth of "
          "{:.6g} m; a plane case needs a slab whose front and back meshes are the same",
          deck.file, name, x.x(), x.y(), result.depth);
    result.mesh.positions.insert(result.mesh.positions.end(), {x.x(), x.y()});
    result.shares.push_back(shares_of(columns, column));
  }
  return result;
}

void append_face(const Face &face, const std::map<int, int> &number, std::size_t nodes_per_face,
                 std::vector<int> &faces) {
  const auto append = [&](std::initializer_list<std::size_t> corners) {
    for (const std::size_t corner : corners)
      faces.push_back(number.at(face[corner]));
  };
  if (face.size() == nodes_per_face && nodes_per_face == 4)
    return append({0, 1, 2, 3});
  append({0, 1, 2});
  if (face.size() == 4)
    append({2, 3, 0});
}

Interface space_interface(const Deck &deck, const std::vector<int> &set,
                          const std::vector<Face> &faces) {
  Interface result;
  const bool has_triangles =
      std::any_of(faces.begin(), faces.end(), [](const Face &face) { return face.size() == 3; });
  result.mesh.dim = 3;
  result.mesh.nodes_per_face = has_triangles ? 3 : 4;
  std::map<int, int> number;
  for (const int node : set) {
    number[node] = static_cast<int>(result.shares.size());
    result.shares.push_back({{node, 1.0}});
    const Vec<3> &x = deck.nodes.at(node);
    result.mesh.positions.insert(result.mesh.positions.end(), x.begin(), x.end());
  }
  for (const Face &face : faces)
    append_face(face, number, static_cast<std::size_t>(result.mesh.nodes_per_face),
                result.mesh.faces);
  return result;
}

} // namespace

std::vector<NodalForce> Interface::scatter(std::span<const double> forces) const {
  assert(forces.size() == mesh.positions.size());
  const auto dim = static_cast<std::size_t>(mesh.dim);
  std::vector<NodalForce> result;
  for (std::size_t a = 0; a < shares.size(); ++a) {
    Vec<3> force = Vec<3>::Zero();
    for (std::size_t d = 0; d < dim; ++d)
      force[static_cast<int>(d)] = depth * forces[dim * a + d];
    for (const Share &share : shares[a])
      result.push_back({share.node, share.weight * force});
  }
  return result;
}

std::vector<double> Interface::collect(std::span<const NodalForce> forces) const {
  std::vector<double> sums(mesh.positions.size(), 0.0);
  const auto dim = static_cast<std::size_t>(mesh.dim);
  auto force = forces.begin();
  for (std::size_t a = 0; a < shares.size(); ++a)
    for (std::size_t k = 0; k < shares[a].size(); ++k, ++force) {
      assert(force != forces.end() && force->node == shares[a][k].node);
      for (std::size_t d = 0; d < dim; ++d)
        sums[dim * a + d] += force->force[static_cast<int>(d)] / depth;
    }
  return sums;
}

std::vector<double> Interface::gather(const NodeField &field) const {
  std::vector<double> values;
  for (const std::vector<Share> &node : shares) {
    Vec<3> mean = Vec<3>::Zero();
    for (const Share &share : node)
      mean += share.weight * field.col(share.node - 1);
    values.insert(values.end(), mean.begin(), mean.begin() + mesh.dim);
  }
  return values;
}

Interface interface_of(const Deck &deck, std::string_view name, int dim) {
  const std::vector<int> &set = deck.node_set(name);
  const std::vector<Face> faces = outer_faces(deck, set);
  check_covered(deck, name, set, faces);
  return dim == 2 ? slab_interface(deck, name, set, faces) : space_interface(deck, set, faces);
}

} // namespace sluice::calculix
