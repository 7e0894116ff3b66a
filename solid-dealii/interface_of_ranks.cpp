// SPDX-License-Identifier: MIT
#include "solid-dealii/interface_of_ranks.hpp"

#include <map>

namespace sluice::solid {
namespace {

std::vector<double> as_doubles(const std::vector<int> &numbers) {
  return {numbers.begin(), numbers.end()};
}

} // namespace

template <int dim>
InterfaceOfRanks<dim>::InterfaceOfRanks(Interface<dim> part,
                                        const Discretisation<dim> &discretisation)
    : discretisation_(discretisation), part_(std::move(part)) {
  const Ranks &ranks = discretisation.ranks;
  check(ranks.is_one() || part_.nodes_per_row == 1,
        "solid: interface = \"plane\" works on one rank, not on {}", ranks.size());
  if (ranks.is_one()) {
    mesh_ = part_.mesh;
    return;
  }
  // Every node is told by the lowest rank that has it in a wetted face, in the order of the ranks.
  std::vector<double> numbers;
  for (const int node : part_.nodes)
    numbers.push_back(discretisation.node_numbers[static_cast<std::size_t>(node)]);
  const auto numbers_of_ranks = ranks.gather_everywhere(numbers);
  const auto positions = ranks.gather(part_.mesh.positions),
             faces = ranks.gather(as_doubles(part_.mesh.faces));
  mesh_.dim = part_.mesh.dim;
  mesh_.nodes_per_face = part_.mesh.nodes_per_face;
  std::map<double, int> place; // in mesh_, by the node's number in the body
  for (std::size_t r = 0; r < numbers_of_ranks.size(); ++r) {
    places_.emplace_back();
    for (std::size_t k = 0; k < numbers_of_ranks[r].size(); ++k) {
      if (!place.try_emplace(numbers_of_ranks[r][k], static_cast<int>(place.size())).second)
        continue;
      places_.back().push_back(static_cast<int>(place.size()) - 1);
      if (static_cast<int>(r) == ranks.rank())
        told_.push_back(static_cast<int>(k));
      if (ranks.is_root())
        mesh_.positions.insert(mesh_.positions.end(), &positions[r][dim * k],
                               &positions[r][dim * k] + dim);
    }
    if (ranks.is_root())
      for (const double corner : faces[r])
        mesh_.faces.push_back(place.at(numbers_of_ranks[r][static_cast<std::size_t>(corner)]));
  }
}

template <int dim>
std::vector<double> InterfaceOfRanks<dim>::to_root(const std::vector<double> &of_part) const {
  if (discretisation_.ranks.is_one())
    return of_part;
  std::vector<double> told;
  for (const int node : told_)
    told.insert(told.end(), &of_part[static_cast<std::size_t>(dim * node)],
                &of_part[static_cast<std::size_t>(dim * node)] + dim);
  const auto of_ranks = discretisation_.ranks.gather(told);
  std::vector<double> whole(mesh_.positions.size());
  for (std::size_t r = 0; r < of_ranks.size(); ++r)
    for (std::size_t k = 0; k < of_ranks[r].size(); ++k)
      whole[static_cast<std::size_t>(dim * places_[r][k / dim]) + k % dim] = of_ranks[r][k];
  return whole;
}

template <int dim>
Eigen::VectorXd InterfaceOfRanks<dim>::scatter(std::span<const double> of_root) const {
  const auto &d = discretisation_;
  if (d.ranks.is_one())
    return part_.scatter(of_root, d.n_dofs());
  Ranks::Lists for_ranks(d.ranks.is_root() ? places_.size() : 0);
  for (std::size_t r = 0; r < for_ranks.size(); ++r)
    for (const int place : places_[r])
      for (int c = 0; c < dim; ++c)
        for_ranks[r].push_back(of_root[static_cast<std::size_t>(dim * place + c)]);
  const auto mine = d.ranks.scatter(for_ranks);
  Eigen::VectorXd load = Eigen::VectorXd::Zero(d.n_dofs());
  for (std::size_t k = 0; k < mine.size(); ++k)
    load[dim * part_.nodes[static_cast<std::size_t>(told_[k / dim])] +
         static_cast<Eigen::Index>(k % dim)] = mine[k];
  d.components.add_up(load); // also for ranks that hold such a node without a wetted face
  return load;
}

template class InterfaceOfRanks<2>;
template class InterfaceOfRanks<3>;

} // namespace sluice::solid
