// SPDX-License-Identifier: MIT
#include "bridge/base/config.hpp"

#include <toml++/toml.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <numeric>
#include <optional>
#include <sstream>
#include <utility>

namespace sluice {

struct Config::Document {
  std::string name;
  toml::table root;
  std::vector<std::string> overrides;
};

namespace {

std::string place(const std::string &file, const toml::source_region &source) {
  if (!source.begin)
    return file;
  const std::string &origin = source.path ? *source.path : file;
  return fmt::format("{}:{}:{}", origin, source.begin.line, source.begin.column);
}

toml::table parse_text(std::string_view text, const std::string &name) {
  try {
    return toml::parse(text, name);
  } catch (const toml::parse_error &error) {
    fail("{}: {}", place(name, error.source()), error.description());
  }
}

std::string trimmed(std::string_view text) {
  const auto first = text.find_first_not_of(" \t");
  if (first == std::string_view::npos)
    return "";
  return std::string(text.substr(first, text.find_last_not_of(" \t") - first + 1));
}

// "a.b.c=value" -> a table with that one entry. A value that is not TOML is taken as a string, so
// that `--set bridge.scheme=serial-explicit` needs no quotes on the command line.
toml::table parse_override(const std::string &text) {
  const auto equals = text.find('=');
  const std::string key = trimmed(text.substr(0, equals));
  check(equals != std::string::npos && key.find('.') != std::string::npos,
        "--set {}: expected TABLE.KEY=VALUE, for example --set fluid.spacing_m=0.001", text);
  const std::string value = trimmed(text.substr(equals + 1));
  check(!value.empty(), "--set {}: no value after '='", text);
  const std::string origin = "--set " + text;
  try {
    return toml::parse(key + " = " + value, origin);
  } catch (const toml::parse_error &) {
    std::string escaped;
    for (const char c : value) {
      if (c == '"' || c == '\\')
        escaped += '\\';
      escaped += c;
    }
    return parse_text(key + " = \"" + escaped + "\"", origin);
  }
}

void merge(toml::table &into, const toml::table &from) {
  for (const auto &[key, node] : from) {
    if (auto *sub = node.as_table(); sub && into[key.str()].is_table())
      merge(*into[key.str()].as_table(), *sub);
    else
      into.insert_or_assign(key.str(), node);
  }
}

void append_canonical(const toml::node &node, const std::string &path, std::string_view secret,
                      std::string &text) {
  if (const auto *table = node.as_table()) {
    for (const auto &[key, value] : *table)
      append_canonical(value, fmt::format("{}{}{}", path, path.empty() ? "" : ".", key.str()),
                       secret, text);
  } else if (const auto *array = node.as_array();
             array && !array->empty() && array->get(0)->is_table()) {
    for (std::size_t k = 0; k < array->size(); ++k)
      append_canonical(*array->get(k), fmt::format("{}[{}]", path, k), secret, text);
  } else if (path != secret) {
    std::ostringstream out;
    node.visit([&](const auto &n) { out << n; });
    text += path + " = " + out.str() + "\n";
  }
}

std::size_t edit_distance(std::string_view a, std::string_view b) {
  std::vector<std::size_t> row(b.size() + 1);
  std::iota(row.begin(), row.end(), std::size_t{0});
  for (std::size_t i = 1; i <= a.size(); ++i) {
    std::size_t diagonal = row[0];
    row[0] = i;
    for (std::size_t j = 1; j <= b.size(); ++j) {
      const std::size_t above = row[j];
      row[j] = std::min({row[j] + 1, row[j - 1] + 1, diagonal + (a[i - 1] != b[j - 1])});
      diagonal = above;
    }
  }
  return row[b.size()];
}

} // namespace

std::string nearest_word(std::string_view word, std::span<const std::string> candidates) {
  std::string best;
  std::size_t best_distance = std::max<std::size_t>(3, word.size() / 2) + 1;
  for (const std::string &candidate : candidates)
    if (const auto d = edit_distance(word, candidate); d < best_distance) {
      best_distance = d;
      best = candidate;
    }
  return best;
}

Config Config::load(const std::filesystem::path &file, std::span<const std::string> overrides) {
  check(!std::filesystem::is_directory(file),
        "{}: is a folder; give the path of the .toml file in it", file.string());
  std::ifstream in(file, std::ios::binary);
  check(in.good(), "{}: cannot open the case file; give the path of a .toml file", file.string());
  std::stringstream text;
  text << in.rdbuf();
  return parse(text.str(), file.string(), overrides);
}

Config Config::parse(std::string_view text, std::string_view name,
                     std::span<const std::string> overrides) {
  auto document = std::make_shared<Document>();
  document->name = name;
  document->root = parse_text(text, document->name);
  for (const std::string &text_of_override : overrides) {
    merge(document->root, parse_override(text_of_override));
    document->overrides.push_back(text_of_override);
  }
  Config config;
  config.document_ = document;
  return config;
}

const std::string &Config::file_name() const { return document_->name; }

std::string Config::canonical_text(std::string_view secret) const {
  std::string text;
  append_canonical(document_->root, "", secret, text);
  return text;
}

bool Config::has_table(std::string_view name) const {
  const auto node = document_->root.at_path(name);
  return node.is_table() || node.is_array_of_tables();
}

std::size_t Config::array_size(std::string_view name) const {
  const auto node = document_->root.at_path(name);
  if (!node)
    return 0;
  check(node.is_array_of_tables(), "{}: '{}' must be an array of tables, written [[{}]]",
        place(document_->name, node.node()->source()), name, name);
  return node.as_array()->size();
}

void Config::allow_tables(std::initializer_list<std::string_view> names) const {
  std::vector<std::string> known(names.begin(), names.end());
  const auto is_known = [&](const std::string &path) {
    return std::find(known.begin(), known.end(), path) != known.end();
  };
  const auto check_table = [&](const toml::node &node, const std::string &path) {
    if (is_known(path) || is_known(path.substr(0, path.find('.')) + ".*"))
      return;
    const std::string near = nearest_word(path, known);
    const std::string origin = place(document_->name, node.source());
    if (near.empty())
      fail("{}: unknown table [{}]", origin, path);
    fail("{}: unknown table [{}]; did you mean [{}]?", origin, path, near);
  };
  for (const auto &[key, node] : document_->root) {
    const std::string path(key.str());
    check(node.is_table() || node.is_array_of_tables(),
          "{}: '{}' stands outside any table; put it under a [table]",
          place(document_->name, node.source()), path);
    check_table(node, path);
    if (const auto *table = node.as_table())
      for (const auto &[sub_key, sub_node] : *table)
        if (sub_node.is_table() || sub_node.is_array_of_tables())
          check_table(sub_node, path + "." + std::string(sub_key.str()));
  }
}

struct TableReader::State {
  const Config::Document &document;
  std::string table_name;
  const toml::table *table = nullptr;
  std::vector<std::string> known;
  std::optional<std::string> missing; // what to say of the first required key that is absent

  const toml::node *find(std::string_view key) {
    known.emplace_back(key);
    return table ? table->get(key) : nullptr;
  }
};

TableReader::TableReader(const Config &config, std::string table, std::size_t array_index)
    : state_(std::make_unique<State>(State{*config.document_, std::move(table), nullptr, {}, {}})) {
  const auto node = state_->document.root.at_path(state_->table_name);
  if (!node)
    return;
  if (array_index == Config::no_index) {
    check(node.is_table(), "{}: '{}' must be a table, written [{}]",
          place(state_->document.name, node.node()->source()), state_->table_name,
          state_->table_name);
    state_->table = node.as_table();
  } else {
    state_->table = node.as_array()->get(array_index)->as_table();
  }
}

TableReader::~TableReader() = default;

void TableReader::fail_at(std::string_view key, std::string_view message) const {
  const toml::node *node = state_->table ? state_->table->get(key) : nullptr;
  if (!node)
    node = state_->table;
  const std::string origin =
      node ? place(state_->document.name, node->source()) : state_->document.name;
  fail("{}: [{}] {}", origin, state_->table_name, message);
}

void TableReader::reject_unknown_keys() const {
  if (!state_->table)
    return;
  for (const auto &[key, node] : *state_->table) {
    if (node.is_table() || node.is_array_of_tables())
      continue;
    const std::string name(key.str());
    if (std::find(state_->known.begin(), state_->known.end(), name) != state_->known.end())
      continue;
    const std::string near = nearest_word(name, state_->known);
    const std::string origin = place(state_->document.name, node.source());
    if (near.empty())
      fail("{}: unknown key '{}' in [{}]; valid keys are {}", origin, name, state_->table_name,
           fmt::join(state_->known, ", "));
    fail("{}: unknown key '{}' in [{}]; did you mean '{}'?", origin, name, state_->table_name,
         near);
  }
}

void TableReader::reject_missing_keys() const {
  if (state_->missing)
    fail_at("", *state_->missing);
}

namespace {

std::optional<double> number(const toml::node &node) {
  if (!node.is_number())
    return std::nullopt;
  const auto value = node.value<double>();
  return value && std::isfinite(*value) ? value : std::nullopt;
}

template <class Vector> std::optional<Vector> vector_of(const toml::node &node) {
  const auto *array = node.as_array();
  if (!array || array->size() != static_cast<std::size_t>(Vector::RowsAtCompileTime))
    return std::nullopt;
  Vector v;
  for (std::size_t k = 0; k < array->size(); ++k) {
    const auto x = number(*array->get(k));
    if (!x)
      return std::nullopt;
    v[static_cast<Eigen::Index>(k)] = *x;
  }
  return v;
}

template <class T> std::optional<T> exactly(const toml::node &node) {
  return node.value_exact<T>();
}

std::optional<int> whole_number(const toml::node &node) {
  const auto value = node.value_exact<std::int64_t>();
  return value && std::in_range<int>(*value) ? std::optional(static_cast<int>(*value))
                                             : std::nullopt;
}

} // namespace

namespace {

template <class Vector> std::optional<std::vector<Vector>> vectors_of(const toml::node &node) {
  const auto *array = node.as_array();
  if (!array)
    return std::nullopt;
  std::vector<Vector> all;
  for (const auto &element : *array) {
    const auto v = vector_of<Vector>(element);
    if (!v)
      return std::nullopt;
    all.push_back(*v);
  }
  return all;
}

// Every element of a list, each by `parse`.
template <class T>
std::optional<std::vector<T>> list_of(const toml::node &node,
                                      std::optional<T> (*parse)(const toml::node &)) {
  const auto *array = node.as_array();
  if (!array)
    return std::nullopt;
  std::vector<T> all;
  for (const auto &element : *array) {
    auto x = parse(element);
    if (!x)
      return std::nullopt;
    all.push_back(std::move(*x));
  }
  return all;
}

std::optional<std::vector<double>> numbers_of(const toml::node &node) {
  return list_of<double>(node, number);
}
std::optional<std::vector<std::string>> texts_of(const toml::node &node) {
  return list_of<std::string>(node, exactly<std::string>);
}

} // namespace

template <class T, class Parse>
void TableReader::read_parsed(std::string_view key, T &value, std::string_view help, bool required,
                              Parse parse, std::string_view shape) {
  const toml::node *node = state_->find(key);
  if (!node) {
    if (required && !state_->missing)
      state_->missing = fmt::format("required key '{}' is missing ({})", key, help);
    return;
  }
  const auto read = parse(*node);
  if (!read)
    fail_at(key, fmt::format("'{}' needs {}: {}", key, shape, help));
  value = static_cast<T>(*read);
}

void TableReader::read_value(std::string_view key, double &value, std::string_view help,
                             bool required) {
  read_parsed(key, value, help, required, number,
              "a number in the unit that the key names (no unit inside the value)");
}
void TableReader::read_value(std::string_view key, int &value, std::string_view help,
                             bool required) {
  read_parsed(key, value, help, required, whole_number,
              "a whole number between -2147483648 and 2147483647");
}
void TableReader::read_value(std::string_view key, bool &value, std::string_view help,
                             bool required) {
  read_parsed(key, value, help, required, exactly<bool>, "true or false");
}
void TableReader::read_value(std::string_view key, std::string &value, std::string_view help,
                             bool required) {
  read_parsed(key, value, help, required, exactly<std::string>, "a text in quotes");
}
void TableReader::read_value(std::string_view key, Vec<2> &value, std::string_view help,
                             bool required) {
  read_parsed(key, value, help, required, vector_of<Vec<2>>, "two numbers [x, y]");
}
void TableReader::read_value(std::string_view key, Vec<3> &value, std::string_view help,
                             bool required) {
  read_parsed(key, value, help, required, vector_of<Vec<3>>, "three numbers [x, y, z]");
}
void TableReader::read_value(std::string_view key, std::vector<Vec<2>> &value,
                             std::string_view help, bool required) {
  read_parsed(key, value, help, required, vectors_of<Vec<2>>, "a list of points [[x, y], ...]");
}
void TableReader::read_value(std::string_view key, std::vector<double> &value,
                             std::string_view help, bool required) {
  read_parsed(key, value, help, required, numbers_of, "a list of numbers");
}
void TableReader::read_value(std::string_view key, std::vector<std::string> &value,
                             std::string_view help, bool required) {
  read_parsed(key, value, help, required, texts_of, "a list of texts in quotes");
}

namespace {

std::string text_of(const toml::node *node) {
  std::ostringstream out;
  if (node)
    node->visit([&](const auto &n) { out << n; });
  return out.str();
}

} // namespace

Entry &Entry::check(bool holds, std::string_view what) {
  if (!holds && !reader_.state_->missing)
    reader_.fail_at(
        key_,
        fmt::format("{} = {} {}", key_,
                    text_of(reader_.state_->table ? reader_.state_->table->get(key_) : nullptr),
                    what));
  return *this;
}

namespace {

// Conditions hold for every number of a key; an absent key keeps its (valid) default.
template <class Predicate> bool all_numbers(const toml::node *node, Predicate holds) {
  if (!node)
    return true;
  if (const auto *array = node->as_array())
    return std::all_of(array->begin(), array->end(),
                       [&](const toml::node &n) { return all_numbers(&n, holds); });
  const auto x = number(*node);
  return x && holds(*x);
}

} // namespace

Entry &Entry::positive() {
  const auto *table = reader_.state_->table;
  return check(all_numbers(table ? table->get(key_) : nullptr, [](double x) { return x > 0; }),
               "must be greater than zero");
}

Entry &Entry::at_least(double lowest) {
  const auto *table = reader_.state_->table;
  return check(
      all_numbers(table ? table->get(key_) : nullptr, [&](double x) { return x >= lowest; }),
      fmt::format("must be at least {}", lowest));
}

Entry &Entry::at_most(double highest) {
  const auto *table = reader_.state_->table;
  return check(
      all_numbers(table ? table->get(key_) : nullptr, [&](double x) { return x <= highest; }),
      fmt::format("must be at most {}", highest));
}

Entry &Entry::one_of(std::initializer_list<std::string_view> choices) {
  const auto *table = reader_.state_->table;
  const toml::node *node = table ? table->get(key_) : nullptr;
  if (!node)
    return *this;
  const auto value = node->value<std::string>().value_or("");
  std::vector<std::string> valid(choices.begin(), choices.end());
  const std::string near = nearest_word(value, valid);
  return check(std::find(valid.begin(), valid.end(), value) != valid.end(),
               fmt::format("is not one of {}{}", fmt::join(valid, ", "),
                           near.empty() ? "" : fmt::format("; did you mean '{}'?", near)));
}

} // namespace sluice
