// SPDX-License-Identifier: MIT
// A CalculiX input file (.inp) as far as coupling needs it: nodes, elements with faces, node sets,
// and the text of its model and of its one step. Everything else is ccx's business and passed on
// word for word. Source: Dhondt, CalculiX CrunchiX User's Manual 2.20, chapter 7.
//
// Not read: element types other than the linear ones below; cards that change what a node's
// coordinates or a force's components mean are refused.
#pragma once

#include "bridge/base/vec.hpp"

#include <filesystem>
#include <map>
#include <string>
#include <string_view>
#include <vector>

namespace sluice::calculix {

/// A line of the input and where it stands ("gate.inp:12"), for messages.
struct Line {
  std::string text;
  std::string place;
};

struct Element {
  std::string type; ///< "C3D4", "C3D6", "C3D8", "C3D8I" or "C3D8R"
  std::vector<int> nodes;
};

struct Deck {
  std::string file;
  std::vector<Line> model;     ///< all before *STEP, includes put in, comments left out
  std::vector<Line> step;      ///< from *STEP to the line before *END STEP
  std::map<int, Vec<3>> nodes; ///< [m], reference configuration
  std::vector<Element> elements;
  std::map<std::string, std::vector<int>> node_sets; ///< names in upper case, as ccx takes them
  std::vector<std::string> skipped_types;            ///< element types that were not read

  /// The nodes of a set, each once; throws UserError naming the sets that there are.
  const std::vector<int> &node_set(std::string_view name) const;
};

/// Faces of an element as lists of its corner numbers, counted from 0.
const std::vector<std::vector<int>> &faces_of(const Element &element);

/// Reads `file` and what it includes (file names relative to the folder of `file`). Throws
/// UserError with file and line for what cannot be read, a card that coupling does not allow, or a
/// file that does not have exactly one *STEP with *DYNAMIC.
Deck read_deck(const std::filesystem::path &file);
/// The same for the text of a file that `name` stands for in messages; includes are not possible.
Deck parse_deck(const std::string &text, const std::string &name);

/// `word` without blanks, in upper case.
std::string canonical(std::string_view word);

/// Whether `line` is the card `name` ("*DYNAMIC"), whatever its parameters.
bool is_card(std::string_view line, std::string_view name);

} // namespace sluice::calculix
