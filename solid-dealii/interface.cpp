// SPDX-License-Identifier: MIT
#include "solid-dealii/interface.hpp"

#include <Eigen/Geometry>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>

namespace sluice::solid {
namespace {

using Facet = std::vector<int>; // body nodes, 2 or 4

// Divides a face's node lattice into linear facets, turned so that the fluid is on the left of a
// segment and sees a quadrilateral counter-clockwise.
void add_facets(const Discretisation<2> &d, const BoundaryFace<2> &face,
                std::vector<Facet> &facets) {
  for (std::size_t k = 0; k + 1 < face.nodes.size(); ++k) {
    Facet f{face.nodes[k], face.nodes[k + 1]};
    const Vec<2> along =
        d.nodes[static_cast<std::size_t>(f[1])] - d.nodes[static_cast<std::size_t>(f[0])];
    if (rotated_left(along).dot(face.normal) < 0)
      std::swap(f[0], f[1]);
    facets.push_back(std::move(f));
  }
}

void add_facets(const Discretisation<3> &d, const BoundaryFace<3> &face,
                std::vector<Facet> &facets) {
  const int n = d.degree + 1;
  const auto node = [&](int i, int j) { return face.nodes[static_cast<std::size_t>(n * j + i)]; };
  const auto position = [&](int a) { return d.nodes[static_cast<std::size_t>(a)]; };
  for (int j = 0; j + 1 < n; ++j)
    for (int i = 0; i + 1 < n; ++i) {
      Facet f{node(i, j), node(i + 1, j), node(i + 1, j + 1), node(i, j + 1)};
      const Vec<3> normal =
          (position(f[2]) - position(f[0])).cross(position(f[3]) - position(f[1]));
      if (normal.dot(face.normal) < 0)
        std::reverse(f.begin(), f.end());
      facets.push_back(std::move(f));
    }
}

// Segments in the order in which they follow each other, line after line, so that nodes are
// numbered along the lines; a closed line starts anywhere.
void sort_along_lines(std::vector<Facet> &facets) {
  std::map<int, Facet> by_start;
  std::map<int, int> ends; // how many segments do at a node
  for (const Facet &f : facets) {
    by_start[f[0]] = f;
    ++ends[f[1]];
  }
  check(by_start.size() == facets.size(),
        "solid: {} wetted segments start at only {} nodes; do two parts touch in a point?",
        facets.size(), by_start.size());
  std::vector<Facet> sorted;
  while (!by_start.empty()) {
    auto at = std::find_if(by_start.begin(), by_start.end(),
                           [&](const auto &entry) { return !ends.contains(entry.first); });
    if (at == by_start.end())
      at = by_start.begin();
    while (at != by_start.end()) {
      sorted.push_back(at->second);
      by_start.erase(at);
      at = by_start.find(sorted.back()[1]);
    }
  }
  facets = std::move(sorted);
}

// Weights of a row along z: the integrals of its shape functions over the depth, whose sum is one.
// Rows are of one cell's degree, so Simpson's rule (degree 2) or the trapezoidal rule repeat.
void add_row_weights(const Discretisation<3> &d, const std::vector<int> &row, Interface<3> &plane) {
  const auto z = [&](std::size_t k) { return d.nodes[static_cast<std::size_t>(row[k])].z(); };
  const std::size_t degree = static_cast<std::size_t>(d.degree);
  const std::vector<double> rule = d.degree == 2 ? std::vector<double>{1.0 / 6, 4.0 / 6, 1.0 / 6}
                                                 : std::vector<double>{0.5, 0.5};
  std::vector<double> weights(row.size(), 0.0);
  const double depth = z(row.size() - 1) - z(0);
  for (std::size_t k = 0; k + degree < row.size(); k += degree)
    for (std::size_t i = 0; i <= degree; ++i)
      weights[k + i] += rule[i] * (z(k + degree) - z(k)) / depth;
  plane.weights.insert(plane.weights.end(), weights.begin(), weights.end());
}

// Whether the fluid is on the left of a -> b, where a quadrilateral that faces it has the lower
// edge a -> b and goes on to c: seen from the fluid the corners run counter-clockwise, so the
// outward normal is (b - a) x (c - b).
bool outward_order(const Vec<3> &a, const Vec<3> &b, const Vec<3> &c) {
  const Vec<3> normal = (b - a).cross(c - b);
  const Vec<2> along = (b - a).head<2>();
  return rotated_left(along).dot(normal.head<2>()) > 0;
}

} // namespace

template <int dim>
Interface<dim> wetted_interface(const Discretisation<dim> &d, const std::vector<int> &wetted) {
  check(d.ranks.sum(static_cast<double>(wetted.size())) > 0,
        "solid: no part of the boundary is wetted; give one [[solid.boundary]] the "
        "kind wetted");
  std::vector<Facet> facets;
  for (const int f : wetted)
    add_facets(d, d.faces[static_cast<std::size_t>(f)], facets);
  if constexpr (dim == 2)
    sort_along_lines(facets);
  Interface<dim> result;
  result.mesh.dim = dim;
  result.mesh.nodes_per_face = dim == 2 ? 2 : 4;
  std::map<int, int> number; // of a body node
  for (const Facet &facet : facets)
    for (const int node : facet) {
      const auto [place, is_new] = number.try_emplace(node, static_cast<int>(result.nodes.size()));
      result.mesh.faces.push_back(place->second);
      if (!is_new)
        continue;
      result.nodes.push_back(node);
      const Vec<dim> &x = d.nodes[static_cast<std::size_t>(node)];
      result.mesh.positions.insert(result.mesh.positions.end(), x.begin(), x.end());
    }
  result.weights.assign(result.nodes.size(), 1.0);
  return result;
}

template <int dim> Interface<dim> wetted_interface(const Discretisation<dim> &d, Side clamped) {
  std::vector<int> wetted;
  for (std::size_t f = 0; f < d.faces.size(); ++f) {
    const Side side = d.faces[f].side;
    if (side != clamped && side != Side::near && side != Side::far)
      wetted.push_back(static_cast<int>(f));
  }
  return wetted_interface(d, wetted);
}

// Lines of facets need not be one open line: holes and several bodies have several.
Interface<3> plane_interface(const Discretisation<3> &d, const std::vector<int> &wetted) {
  const Interface<3> whole = wetted_interface(d, wetted);
  const auto place = [](const Vec<3> &x) { // sections agree to round-off of a generated mesh
    return std::pair(std::llround(1e9 * x.x()), std::llround(1e9 * x.y()));
  };
  const auto at = [&](int node) -> const Vec<3> & {
    return d.nodes[static_cast<std::size_t>(node)];
  };
  std::map<std::pair<long long, long long>, std::vector<int>> rows;
  for (const int node : whole.nodes)
    rows[place(at(node))].push_back(node);
  for (auto &[xy, row] : rows) {
    std::sort(row.begin(), row.end(), [&](int a, int b) { return at(a).z() < at(b).z(); });
    check(row.size() == rows.begin()->second.size(),
          "solid: interface = \"plane\" needs the same section at every depth, but there are {} "
          "nodes above ({:.6g}, {:.6g}) m and {} elsewhere",
          row.size(), at(row[0]).x(), at(row[0]).y(), rows.begin()->second.size());
  }
  Interface<3> plane;
  const auto &first = rows.begin()->second;
  plane.nodes_per_row = static_cast<int>(first.size());
  plane.depth = at(first.back()).z() - at(first.front()).z();
  plane.mesh.dim = 2;
  plane.mesh.nodes_per_face = 2;
  std::map<std::pair<long long, long long>, int> number;
  const auto number_of = [&](int node) {
    const auto [entry, is_new] =
        number.try_emplace(place(at(node)), static_cast<int>(number.size()));
    if (is_new) {
      const auto &row = rows.at(entry->first);
      plane.nodes.insert(plane.nodes.end(), row.begin(), row.end());
      add_row_weights(d, row, plane);
      plane.mesh.positions.insert(plane.mesh.positions.end(), {at(node).x(), at(node).y()});
    }
    return entry->second;
  };
  // The edge of every quadrilateral in the lowest section is a segment; seen from the fluid it runs
  // the same way round in every one.
  const double lowest = at(first.front()).z();
  for (std::size_t f = 0; f < whole.mesh.n_faces(); ++f)
    for (int k = 0; k < 4; ++k) {
      const auto corner = [&](int c) {
        return whole.nodes[static_cast<std::size_t>(
            whole.mesh.faces[4 * f + static_cast<std::size_t>(c % 4)])];
      };
      const int a = corner(k), b = corner(k + 1);
      const bool is_along = place(at(a)) != place(at(b));
      if (is_along && std::max(at(a).z(), at(b).z()) < lowest + 1e-6 * plane.depth)
        for (const int node :
             outward_order(at(a), at(b), at(corner(k + 2))) ? std::array{a, b} : std::array{b, a})
          plane.mesh.faces.push_back(number_of(node));
    }
  return plane;
}

template <int dim> std::vector<double> Interface<dim>::gather(const Eigen::VectorXd &field) const {
  std::vector<double> values(static_cast<std::size_t>(mesh.dim * n_nodes()), 0.0);
  for (std::size_t k = 0; k < nodes.size(); ++k)
    for (int c = 0; c < mesh.dim; ++c)
      values[static_cast<std::size_t>(mesh.dim) * (k / static_cast<std::size_t>(nodes_per_row)) +
             static_cast<std::size_t>(c)] += weights[k] * field[dim * nodes[k] + c];
  return values;
}

template <int dim>
std::vector<double> Interface<dim>::gather_forces(const Eigen::VectorXd &load) const {
  std::vector<double> forces(static_cast<std::size_t>(mesh.dim * n_nodes()), 0.0);
  for (std::size_t k = 0; k < nodes.size(); ++k)
    for (int c = 0; c < mesh.dim; ++c)
      forces[static_cast<std::size_t>(mesh.dim) * (k / static_cast<std::size_t>(nodes_per_row)) +
             static_cast<std::size_t>(c)] += load[dim * nodes[k] + c] / depth;
  return forces;
}

template <int dim>
Eigen::VectorXd Interface<dim>::scatter(std::span<const double> forces, int n_dofs) const {
  check(static_cast<int>(forces.size()) == mesh.dim * n_nodes(),
        "solid: {} force components for {} interface nodes", forces.size(), n_nodes());
  Eigen::VectorXd load = Eigen::VectorXd::Zero(n_dofs);
  for (std::size_t k = 0; k < nodes.size(); ++k)
    for (int c = 0; c < mesh.dim; ++c)
      load[dim * nodes[k] + c] += depth * weights[k] *
                                  forces[static_cast<std::size_t>(mesh.dim) *
                                             (k / static_cast<std::size_t>(nodes_per_row)) +
                                         static_cast<std::size_t>(c)];
  return load;
}

template <int dim> FreeEnd<dim> free_end(const Discretisation<dim> &d, Side clamped) {
  const Side side = static_cast<Side>(static_cast<int>(clamped) ^ 1);
  const int along = side == Side::lower || side == Side::upper ? 0 : 1;
  const auto position = [&](int node) -> const Vec<dim> & {
    return d.nodes[static_cast<std::size_t>(node)];
  };
  std::vector<int> nodes = d.side_nodes(side);
  if constexpr (dim == 3) {
    const auto near = d.side_nodes(Side::near);
    std::erase_if(nodes, [&](int n) { return !std::binary_search(near.begin(), near.end(), n); });
  }
  std::vector<double> mine; // number in the body and place along the end
  for (const int node : nodes)
    mine.insert(mine.end(),
                {d.node_numbers[static_cast<std::size_t>(node)], position(node)[along]});
  struct EndNode {
    double along;
    int node;
  };
  std::map<double, EndNode> by_number;
  const auto of_ranks = d.ranks.gather_everywhere(mine);
  for (std::size_t r = 0; r < of_ranks.size(); ++r)
    for (std::size_t k = 0; 2 * k < of_ranks[r].size(); ++k)
      by_number.try_emplace(
          of_ranks[r][2 * k],
          EndNode{of_ranks[r][2 * k + 1], static_cast<int>(r) == d.ranks.rank() ? nodes[k] : -1});
  std::vector<EndNode> line;
  for (const auto &[number, node] : by_number)
    line.push_back(node);
  std::sort(line.begin(), line.end(),
            [](const EndNode &a, const EndNode &b) { return a.along < b.along; });
  FreeEnd<dim> end;
  end.ranks = d.ranks;
  end.front = line.front().node;
  end.back = line.back().node;
  const double middle = 0.5 * (line.front().along + line.back().along);
  const auto after = std::find_if(line.begin() + 1, line.end() - 1,
                                  [&](const EndNode &n) { return n.along >= middle; });
  const auto before = after - 1;
  end.after_middle = after->node;
  end.before_middle = before->node;
  end.weight_after = (middle - before->along) / (after->along - before->along);
  return end;
}

template struct Interface<2>;
template struct Interface<3>;
template Interface<2> wetted_interface(const Discretisation<2> &, const std::vector<int> &);
template Interface<3> wetted_interface(const Discretisation<3> &, const std::vector<int> &);
template Interface<2> wetted_interface(const Discretisation<2> &, Side);
template Interface<3> wetted_interface(const Discretisation<3> &, Side);
template FreeEnd<2> free_end(const Discretisation<2> &, Side);
template FreeEnd<3> free_end(const Discretisation<3> &, Side);

} // namespace sluice::solid
