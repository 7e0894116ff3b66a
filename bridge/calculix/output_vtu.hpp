// SPDX-License-Identifier: MIT
// Fields for ParaView: solid_NNNN.vtu (text) with the deformed mesh, and the index solid.pvd.
#pragma once

#include "bridge/calculix/restart_file.hpp"

#include <string>
#include <utility>
#include <vector>

namespace sluice::calculix {

class OutputVtu {
public:
  /// Writes into `folder`, which must exist.
  OutputVtu(const Deck &deck, std::filesystem::path folder);

  /// Writes the next file for `time` [s] and renews the index, so that a run which is cut short
  /// leaves a readable series. Throws UserError when the disk is full.
  void write(double time, const Motion &motion);

private:
  void write_index() const;
  std::string text_of(const Motion &motion) const;
  std::string vectors(std::string_view name, const NodeField &field) const;

  std::filesystem::path folder_;
  std::vector<int> numbers_; // of the deck's nodes, in the order of the file
  NodeField positions_;      // [m], column: node number - 1
  std::string cells_;        // the same in every file
  std::size_t n_cells_;
  std::vector<std::pair<double, std::string>> written_;
};

} // namespace sluice::calculix
