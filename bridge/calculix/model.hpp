// SPDX-License-Identifier: MIT
// What [solid] names: the deck, its wetted surface and its probe.
#pragma once

#include "bridge/calculix/interface.hpp"
#include "bridge/calculix/params.hpp"

namespace sluice::calculix {

struct Model {
  Deck deck;
  Interface surface;
  std::vector<int> probe; ///< nodes, empty for none
};

/// The user's deck, or that of the box. Throws UserError for everything that is wrong with them.
Model read_model(const Config &config, const CalculixParams &params);

} // namespace sluice::calculix
