// SPDX-License-Identifier: MIT
#include "bridge/calculix/model.hpp"

#include "bridge/calculix/box_deck.hpp"

namespace sluice::calculix {

namespace {

Model model_of(Deck deck, std::string_view interface_set, std::string_view probe_set, int dim) {
  Interface surface = interface_of(deck, interface_set, dim);
  std::vector<int> probe;
  if (!probe_set.empty())
    probe = deck.node_set(probe_set);
  return {std::move(deck), std::move(surface), std::move(probe)};
}

} // namespace

Model read_model(const Config &config, const CalculixParams &params) {
  if (params.input.empty())
    return model_of(parse_deck(box_deck(params.box), "the box of [solid]"), box_interface_set,
                    box_probe_set, params.dimension);
  const auto file = std::filesystem::path(config.file_name()).parent_path() / params.input;
  return model_of(read_deck(file), params.interface_set, params.probe_set, params.dimension);
}

} // namespace sluice::calculix
