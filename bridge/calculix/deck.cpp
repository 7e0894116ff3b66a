// SPDX-License-Identifier: MIT
#include "bridge/calculix/deck.hpp"

#include "bridge/base/check.hpp"
#include "bridge/base/config.hpp"

#include <fmt/ranges.h>

#include <algorithm>
#include <charconv>
#include <fstream>
#include <sstream>

namespace sluice::calculix {

namespace fs = std::filesystem;

namespace {

constexpr int deepest_include = 10;

std::vector<std::string> fields_of(std::string_view line) {
  std::vector<std::string> fields;
  while (true) {
    const auto comma = line.find(',');
    fields.emplace_back(line.substr(0, comma));
    if (comma == std::string_view::npos)
      return fields;
    line.remove_prefix(comma + 1);
  }
}

std::string without_blanks(std::string_view text) {
  std::string out;
  for (const char c : text)
    if (c != ' ' && c != '\t' && c != '\r')
      out += c;
  return out;
}

int integer(const std::string &field, const Line &line) {
  int value = 0;
  const std::string word = without_blanks(field);
  const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
  check(error == std::errc() && end == word.data() + word.size(),
        "{}: '{}' is not an integer, in '{}'", line.place, word, line.text);
  return value;
}

double real(const std::string &field, const Line &line) {
  std::string word = without_blanks(field);
  std::replace_if(
      word.begin(), word.end(), [](char c) { return c == 'D' || c == 'd'; }, 'e');
  const char *first = word.data() + (word.starts_with('+') ? 1 : 0);
  double value = 0;
  const auto [end, error] = std::from_chars(first, word.data() + word.size(), value);
  check(word.empty() || (error == std::errc() && end == word.data() + word.size()),
        "{}: '{}' is not a number, in '{}'", line.place, word, line.text);
  return value;
}

/// A keyword with its parameters and data lines.
struct Card {
  std::string name;
  std::map<std::string, std::string> parameters;
  Line line;
  std::vector<Line> data;

  std::string parameter(const std::string &key) const {
    const auto found = parameters.find(key);
    return found == parameters.end() ? "" : found->second;
  }
};

// "*NODE, NSET=all" -> "*NODE", {NSET: ALL}; a parameter without a value has an empty one.
Card card_of(const Line &line) {
  Card card{"", {}, line, {}};
  for (const std::string &field : fields_of(line.text)) {
    const std::string word = canonical(field);
    const auto equals = word.find('=');
    if (card.name.empty())
      card.name = word;
    else if (!word.empty())
      card.parameters[word.substr(0, equals)] =
          equals == std::string::npos ? "" : word.substr(equals + 1);
  }
  return card;
}

bool is_keyword(std::string_view text) { return text.starts_with('*'); }
bool is_comment(std::string_view text) { return text.starts_with("**"); }

// File names keep their case; blanks in them are lost, as in ccx.
std::string included_file(const Line &line) {
  for (const std::string &field : fields_of(line.text)) {
    std::string word = without_blanks(field);
    if (!canonical(word).starts_with("INPUT="))
      continue;
    word.erase(0, word.find('=') + 1);
    std::erase(word, '"');
    return word;
  }
  fail("{}: *INCLUDE without INPUT=", line.place);
}

// Without blank lines and comments.
std::vector<Line> lines_of(std::istream &in, const std::string &name) {
  std::vector<Line> lines;
  std::string text;
  for (int number = 1; std::getline(in, text); ++number) {
    text.erase(0, text.find_first_not_of(" \t"));
    text.erase(text.find_last_not_of(" \t\r") + 1);
    if (!text.empty() && !is_comment(text))
      lines.push_back({text, fmt::format("{}:{}", name, number)});
  }
  return lines;
}

void append_file(const fs::path &file, const fs::path &folder, int depth,
                 std::vector<Line> &lines) {
  std::ifstream in(file);
  check(in.good() && fs::is_regular_file(file), "{}: cannot be read", file.string());
  check(depth <= deepest_include, "{}: includes go {} deep; does a file include itself?",
        file.string(), depth);
  for (Line &line : lines_of(in, file.string()))
    if (is_card(line.text, "*INCLUDE"))
      append_file(folder / included_file(line), folder, depth + 1, lines);
    else
      lines.push_back(std::move(line));
}

// A keyword line that ends with a comma goes on in the next one.
std::vector<Line> with_whole_keywords(const std::vector<Line> &lines) {
  std::vector<Line> whole;
  for (const Line &line : lines) {
    const bool goes_on =
        !whole.empty() && is_keyword(whole.back().text) && whole.back().text.ends_with(',');
    if (goes_on)
      whole.back().text += ' ' + line.text;
    else
      whole.push_back(line);
  }
  return whole;
}

std::vector<Card> cards_of(const std::vector<Line> &lines) {
  std::vector<Card> cards;
  for (const Line &line : lines) {
    if (is_keyword(line.text)) {
      cards.push_back(card_of(line));
      continue;
    }
    check(!cards.empty(), "{}: data before the first keyword: '{}'", line.place, line.text);
    cards.back().data.push_back(line);
  }
  return cards;
}

void refuse(const Card &card) {
  check(card.name != "*RESTART", "{}: *RESTART is written by sluice-calculix; leave it out",
        card.line.place);
  check(card.name != "*TRANSFORM",
        "{}: *TRANSFORM is not supported: forces on the interface are given along x, y and z",
        card.line.place);
}

void read_nodes(const Card &card, Deck &deck) {
  const std::string system = card.parameter("SYSTEM");
  check(system.empty() || system == "R",
        "{}: SYSTEM={} is not supported: give nodes in Cartesian coordinates", card.line.place,
        system);
  const std::string set = card.parameter("NSET");
  for (const Line &line : card.data) {
    const auto fields = fields_of(line.text);
    const int number = integer(fields[0], line);
    check(number > 0, "{}: node number {} is not positive", line.place, number);
    Vec<3> &x = deck.nodes[number];
    for (std::size_t d = 0; d < 3; ++d)
      x[static_cast<int>(d)] = d + 1 < fields.size() ? real(fields[d + 1], line) : 0;
    if (!set.empty())
      deck.node_sets[set].push_back(number);
  }
}

std::size_t corners_of(std::string_view type) {
  if (type == "C3D4")
    return 4;
  if (type == "C3D6")
    return 6;
  return type == "C3D8" || type == "C3D8I" || type == "C3D8R" ? 8 : 0;
}

void read_elements(const Card &card, Deck &deck) {
  const std::string type = card.parameter("TYPE");
  const std::size_t corners = corners_of(type);
  if (corners == 0) {
    deck.skipped_types.push_back(type);
    return;
  }
  std::vector<int> numbers; // of one element, which may go over several lines
  for (const Line &line : card.data) {
    for (const std::string &field : fields_of(line.text))
      if (!without_blanks(field).empty())
        numbers.push_back(integer(field, line));
    if (numbers.size() <= corners && &line != &card.data.back())
      continue;
    check(numbers.size() == corners + 1, "{}: an element of type {} has {} nodes, not {}",
          line.place, type, corners, numbers.empty() ? 0 : numbers.size() - 1);
    deck.elements.push_back({type, {numbers.begin() + 1, numbers.end()}});
    numbers.clear();
  }
}

void read_range(const Line &line, const std::vector<std::string> &fields, std::vector<int> &set) {
  check(fields.size() >= 2, "{}: GENERATE needs first, last and increment", line.place);
  const int first = integer(fields[0], line), last = integer(fields[1], line);
  const int by = fields.size() > 2 && !fields[2].empty() ? integer(fields[2], line) : 1;
  check(by > 0, "{}: the increment {} is not positive", line.place, by);
  for (int node = first; node <= last; node += by)
    set.push_back(node);
}

void read_node_set(const Card &card, Deck &deck) {
  const std::string name = card.parameter("NSET");
  check(!name.empty(), "{}: *NSET without NSET=", card.line.place);
  std::vector<int> &set = deck.node_sets[name];
  for (const Line &line : card.data) {
    const auto fields = fields_of(line.text);
    if (card.parameters.contains("GENERATE")) {
      read_range(line, fields, set);
      continue;
    }
    for (const std::string &field : fields) {
      const std::string word = canonical(field);
      if (word.empty())
        continue;
      const auto other = deck.node_sets.find(word);
      if (other != deck.node_sets.end()) {
        const std::vector<int> members = other->second; // the set may name itself
        set.insert(set.end(), members.begin(), members.end());
      } else
        set.push_back(integer(field, line));
    }
  }
}

void check_elements(const Deck &deck) {
  for (const Element &element : deck.elements)
    for (const int node : element.nodes)
      check(deck.nodes.contains(node),
            "{}: an element of type {} names node {}, which is not there", deck.file, element.type,
            node);
}

void finish_sets(Deck &deck) {
  for (auto &[name, nodes] : deck.node_sets) {
    std::sort(nodes.begin(), nodes.end());
    nodes.erase(std::unique(nodes.begin(), nodes.end()), nodes.end());
    // ccx ignores numbers of a set that are no nodes
    std::erase_if(nodes, [&](int node) { return !deck.nodes.contains(node); });
  }
}

void read_model(Deck &deck) {
  for (const Card &card : cards_of(deck.model)) {
    refuse(card);
    if (card.name == "*NODE")
      read_nodes(card, deck);
    else if (card.name == "*ELEMENT")
      read_elements(card, deck);
    else if (card.name == "*NSET")
      read_node_set(card, deck);
  }
  check_elements(deck);
  finish_sets(deck);
}

void check_step(const Deck &deck) {
  check(!deck.step.empty(),
        "{}: has no *STEP; give it one with *DYNAMIC, which says how a window is computed",
        deck.file);
  bool is_dynamic = false;
  for (const Card &card : cards_of(deck.step)) {
    refuse(card);
    is_dynamic = is_dynamic || card.name == "*DYNAMIC";
  }
  check(is_dynamic, "{}: the step is not *DYNAMIC", deck.step.front().place);
}

// What stands before *STEP is the model; what follows *END STEP must be nothing.
void divide(const std::vector<Line> &lines, Deck &deck) {
  const auto begins = [](const Line &line) { return is_card(line.text, "*STEP"); };
  const auto ends = [](const Line &line) { return is_card(line.text, "*ENDSTEP"); };
  const auto step = std::find_if(lines.begin(), lines.end(), begins);
  const auto end = std::find_if(step, lines.end(), ends);
  check(step == lines.end() || end != lines.end(), "{}: the step has no *END STEP",
        step == lines.end() ? "" : step->place);
  if (end != lines.end() && end + 1 != lines.end())
    fail("{}: '{}' follows the first step; one step is allowed, it is repeated for every window",
         (end + 1)->place, (end + 1)->text);
  deck.model.assign(lines.begin(), step);
  deck.step.assign(step, end);
}

Deck deck_of(const std::vector<Line> &lines, std::string name) {
  Deck deck;
  deck.file = std::move(name);
  divide(with_whole_keywords(lines), deck);
  read_model(deck);
  check(!deck.nodes.empty(), "{}: has no *NODE", deck.file);
  check_step(deck);
  return deck;
}

} // namespace

std::string canonical(std::string_view word) {
  std::string out = without_blanks(word);
  std::transform(out.begin(), out.end(), out.begin(),
                 [](unsigned char c) { return static_cast<char>(std::toupper(c)); });
  return out;
}

bool is_card(std::string_view line, std::string_view name) {
  return canonical(line.substr(0, line.find(','))) == name;
}

const std::vector<int> &Deck::node_set(std::string_view name) const {
  const auto found = node_sets.find(canonical(name));
  if (found != node_sets.end() && !found->second.empty())
    return found->second;
  std::vector<std::string> names;
  for (const auto &[known, members] : node_sets)
    if (!members.empty())
      names.push_back(known);
  const std::string nearest = nearest_word(canonical(name), names);
  fail("{}: there is no node set '{}'{}; it has {}", file, name,
       nearest.empty() ? "" : fmt::format(" (did you mean '{}'?)", nearest),
       names.empty() ? "none" : fmt::format("{}", fmt::join(names, ", ")));
}

const std::vector<std::vector<int>> &faces_of(const Element &element) {
  static const std::vector<std::vector<int>> tetrahedron{
      {0, 2, 1}, {0, 1, 3}, {1, 2, 3}, {2, 0, 3}};
  static const std::vector<std::vector<int>> wedge{
      {0, 2, 1}, {3, 4, 5}, {0, 1, 4, 3}, {1, 2, 5, 4}, {2, 0, 3, 5}};
  static const std::vector<std::vector<int>> hexahedron{{0, 3, 2, 1}, {4, 5, 6, 7}, {0, 1, 5, 4},
                                                        {1, 2, 6, 5}, {2, 3, 7, 6}, {3, 0, 4, 7}};
  return element.nodes.size() == 4 ? tetrahedron : element.nodes.size() == 6 ? wedge : hexahedron;
}

Deck read_deck(const fs::path &file) {
  std::vector<Line> lines;
  append_file(file, file.parent_path(), 0, lines);
  return deck_of(lines, file.string());
}

Deck parse_deck(const std::string &text, const std::string &name) {
  std::istringstream in(text);
  return deck_of(lines_of(in, name), name);
}

} // namespace sluice::calculix
