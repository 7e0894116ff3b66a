// SPDX-License-Identifier: MIT
#include "solid-dealii/interface.hpp"

#include <Eigen/Geometry>

#include <algorithm>
#include <map>

namespace sluice::solid {
namespace {

using Facet = std::vector<int>; // body nodes, 2 or 4

bool is_wetted(Side side, Side clamped) {
  return side != clamped && side != Side::near && side != Side::far;
}

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

// Segments in the order in which they follow each other, so that nodes are numbered along the line.
void sort_along_line(std::vector<Facet> &facets) {
  std::map<int, Facet> by_start;
  std::map<int, bool> is_end;
  for (const Facet &f : facets) {
    by_start[f[0]] = f;
    is_end[f[1]] = true;
  }
  const auto first = std::find_if(facets.begin(), facets.end(),
                                  [&](const Facet &f) { return !is_end.contains(f[0]); });
  std::vector<Facet> sorted;
  for (auto at = by_start.find(first == facets.end() ? facets[0][0] : (*first)[0]);
       at != by_start.end() && sorted.size() < facets.size(); at = by_start.find(at->second[1]))
    sorted.push_back(at->second);
  facets = std::move(sorted);
}

} // namespace

template <int dim> Interface<dim> wetted_interface(const Discretisation<dim> &d, Side clamped) {
  std::vector<Facet> facets;
  for (const auto &face : d.faces)
    if (is_wetted(face.side, clamped))
      add_facets(d, face, facets);
  if constexpr (dim == 2)
    sort_along_line(facets);
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
  return result;
}

template <int dim> std::vector<double> Interface<dim>::gather(const Eigen::VectorXd &field) const {
  std::vector<double> values;
  values.reserve(dim * nodes.size());
  for (const int node : nodes)
    for (int c = 0; c < dim; ++c)
      values.push_back(field[dim * node + c]);
  return values;
}

template <int dim>
Eigen::VectorXd Interface<dim>::scatter(std::span<const double> forces, int n_dofs) const {
  check(forces.size() == dim * nodes.size(), "solid: {} force components for {} interface nodes",
        forces.size(), nodes.size());
  Eigen::VectorXd load = Eigen::VectorXd::Zero(n_dofs);
  std::size_t k = 0;
  for (const int node : nodes)
    for (int c = 0; c < dim; ++c)
      load[dim * node + c] += forces[k++];
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
  std::sort(nodes.begin(), nodes.end(),
            [&](int a, int b) { return position(a)[along] < position(b)[along]; });
  FreeEnd<dim> end;
  end.front = nodes.front();
  end.back = nodes.back();
  const double middle = 0.5 * (position(end.front)[along] + position(end.back)[along]);
  const auto after = std::find_if(nodes.begin() + 1, nodes.end() - 1,
                                  [&](int n) { return position(n)[along] >= middle; });
  end.after_middle = *after;
  end.before_middle = *(after - 1);
  const double from = position(end.before_middle)[along], to = position(end.after_middle)[along];
  end.weight_after = (middle - from) / (to - from);
  return end;
}

template struct Interface<2>;
template struct Interface<3>;
template Interface<2> wetted_interface(const Discretisation<2> &, Side);
template Interface<3> wetted_interface(const Discretisation<3> &, Side);
template FreeEnd<2> free_end(const Discretisation<2> &, Side);
template FreeEnd<3> free_end(const Discretisation<3> &, Side);

} // namespace sluice::solid
