// SPDX-License-Identifier: MIT
#include "solid-dealii/supports.hpp"

#include <algorithm>

namespace sluice::solid {
namespace {

// What a side of the box is without [[solid.boundary]].
std::vector<BoundaryParams> default_boundaries(const SolidParams &params) {
  std::vector<BoundaryParams> all;
  for (const char *side : {"left", "right", "lower", "upper"})
    all.push_back({side, side == params.clamped_side ? "clamped" : "wetted", {}});
  if (params.dimension == 3)
    for (const char *side : {"near", "far"})
      all.push_back({side, "symmetry", {}});
  return all;
}

// The axis that all faces of a flat part are normal to.
template <int dim>
int normal_axis(const Discretisation<dim> &d, const std::vector<int> &faces,
                const std::string &name) {
  int axis = 0;
  d.faces[static_cast<std::size_t>(faces.front())].normal.cwiseAbs().maxCoeff(&axis);
  for (const int f : faces) {
    const Vec<dim> &n = d.faces[static_cast<std::size_t>(f)].normal;
    check(std::abs(n[axis]) > 1 - 1e-6,
          "solid: boundary '{}' is a symmetry plane, but its faces are not all normal to one axis "
          "(one has the normal {:.3g} along axis {}); clamp it, or turn the mesh",
          name, n[axis], axis);
  }
  return axis;
}

} // namespace

template <int dim> Supports supports_of(const Discretisation<dim> &d, const SolidParams &params) {
  Supports s;
  // Counts, not flags: a node may be on a rank whose cells have no face of the part.
  Eigen::VectorXd fixed = Eigen::VectorXd::Zero(d.n_dofs()), held = fixed;
  for (const auto &part :
       params.boundaries.empty() ? default_boundaries(params) : params.boundaries) {
    const std::vector<int> &faces = d.boundary(part.name);
    if (part.kind == "wetted")
      s.wetted.insert(s.wetted.end(), faces.begin(), faces.end());
    else if (part.kind == "symmetry") {
      if (faces.empty())
        continue; // on this rank
      const int axis = normal_axis(d, faces, part.name);
      for (const int node : d.nodes_of(faces))
        fixed[dim * node + axis] += 1;
    } else if (part.kind == "clamped") {
      for (const int node : d.nodes_of(faces))
        held.template segment<dim>(dim * node).array() += 1;
    }
  }
  std::sort(s.wetted.begin(), s.wetted.end());
  s.wetted.erase(std::unique(s.wetted.begin(), s.wetted.end()), s.wetted.end());
  fixed += held;
  d.components.add_up(fixed);
  d.components.add_up(held);
  for (const double count : fixed)
    s.fixed.push_back(count > 0);
  for (int node = 0; node < d.n_nodes(); ++node)
    if (held[dim * node] > 0)
      s.held.push_back(node);
  return s;
}

template <int dim>
Eigen::VectorXd own_load(const Discretisation<dim> &d, const SolidParams &params) {
  Eigen::VectorXd load = Eigen::VectorXd::Zero(d.n_dofs());
  if (!params.gravity.empty()) {
    const Vec<dim> weight = params.density * Eigen::Map<const Vec<dim>>(params.gravity.data());
    for (int k = 0; k < d.n_cells(); ++k)
      for (int q = 0; q < d.points_per_cell; ++q)
        for (int a = 0; a < d.nodes_per_cell; ++a)
          load.template segment<dim>(
              dim * d.cell_nodes[static_cast<std::size_t>(k * d.nodes_per_cell + a)]) +=
              d.weights[static_cast<std::size_t>(k * d.points_per_cell + q)] *
              d.values[static_cast<std::size_t>(q * d.nodes_per_cell + a)] * weight;
    d.components.add_up(load);
  }
  for (const auto &part : params.boundaries)
    if (!part.traction.empty()) {
      const Vec<dim> traction = Eigen::Map<const Vec<dim>>(part.traction.data());
      load += traction_forces<dim>(d, d.boundary(part.name),
                                   [&](const Vec<dim> &) { return traction; });
    }
  return load;
}

template Supports supports_of(const Discretisation<2> &, const SolidParams &);
template Supports supports_of(const Discretisation<3> &, const SolidParams &);
template Eigen::VectorXd own_load(const Discretisation<2> &, const SolidParams &);
template Eigen::VectorXd own_load(const Discretisation<3> &, const SolidParams &);

} // namespace sluice::solid
