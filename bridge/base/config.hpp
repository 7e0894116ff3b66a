// SPDX-License-Identifier: MIT
// Reading a case file. One TOML file describes all participants of a case; each reads its own
// tables.
//
// A parameter struct names every key once, in `describe`, with its unit (the key's suffix) and its
// meaning; that one function gives reading, defaults, ranges and the error for an unknown key:
//
//   struct FluidParams {
//     double density = 1000;
//     template <class Reader> void describe(Reader &read) {
//       read("density_kg_m3", density, "mass per volume of the fluid").positive();
//     }
//   };
//   auto params = config.read<FluidParams>("fluid");
//
// A key is required when its member is declared as `required(...)` in describe; every error names
// file, line and column and, for an unknown key, the nearest valid one.
#pragma once

#include "bridge/base/check.hpp"
#include "bridge/base/vec.hpp"

#include <filesystem>
#include <initializer_list>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace sluice {

class TableReader;

/// Range conditions on the value just read; each throws UserError with the place in the file.
class Entry {
public:
  Entry(const TableReader &reader, std::string_view key) : reader_(reader), key_(key) {}
  Entry &positive();
  Entry &at_least(double lowest);
  Entry &at_most(double highest);
  Entry &one_of(std::initializer_list<std::string_view> choices);
  Entry &check(bool holds, std::string_view what); ///< `what` completes "key = value ..."

private:
  const TableReader &reader_;
  std::string key_;
};

/// Reads the keys of one table. Made by Config::read; remembers which keys are valid.
class TableReader {
public:
  TableReader(const class Config &config, std::string table, std::size_t array_index);
  ~TableReader();
  TableReader(const TableReader &) = delete;
  TableReader &operator=(const TableReader &) = delete;

  /// Optional key: `value` keeps its default when the key is absent.
  template <class T> Entry operator()(std::string_view key, T &value, std::string_view help) {
    read_value(key, value, help, false);
    return {*this, key};
  }
  /// Required key: absence is an error, reported once the whole table is read. Conditions do not
  /// apply after it, as values may rest on the one that is missing.
  template <class T> Entry required(std::string_view key, T &value, std::string_view help) {
    read_value(key, value, help, true);
    return {*this, key};
  }
  /// Throws UserError "file:line:column: [table] message" at the key (or at the table).
  [[noreturn]] void fail_at(std::string_view key, std::string_view message) const;
  /// Throws for the first key in the table that was not read, naming the nearest valid one.
  void reject_unknown_keys() const;
  /// Throws for the first required key that was absent. Asked last: a misspelt one says more.
  void reject_missing_keys() const;

private:
  friend class Entry;
  void read_value(std::string_view key, double &value, std::string_view help, bool required);
  void read_value(std::string_view key, int &value, std::string_view help, bool required);
  void read_value(std::string_view key, bool &value, std::string_view help, bool required);
  void read_value(std::string_view key, std::string &value, std::string_view help, bool required);
  void read_value(std::string_view key, Vec<2> &value, std::string_view help, bool required);
  void read_value(std::string_view key, Vec<3> &value, std::string_view help, bool required);
  /// A polyline or polygon: array of [x, y].
  void read_value(std::string_view key, std::vector<Vec<2>> &value, std::string_view help,
                  bool required);
  void read_value(std::string_view key, std::vector<double> &value, std::string_view help,
                  bool required);
  void read_value(std::string_view key, std::vector<std::string> &value, std::string_view help,
                  bool required);

  template <class T, class Parse>
  void read_parsed(std::string_view key, T &value, std::string_view help, bool required,
                   Parse parse, std::string_view shape);

  struct State;
  std::unique_ptr<State> state_;
};

/// A parsed case file with `--set` overrides applied.
class Config {
public:
  /// Throws UserError on a missing file, a syntax error or a malformed override.
  /// An override is "TABLE.KEY=VALUE" with VALUE in TOML; a bare word is taken as a string.
  static Config load(const std::filesystem::path &file,
                     std::span<const std::string> overrides = {});
  static Config parse(std::string_view text, std::string_view name,
                      std::span<const std::string> overrides = {});

  /// Reads table `name` ("fluid" or "fluid.walls"); a missing table reads as an empty one.
  template <class Params> Params read(std::string_view name) const {
    return read_element<Params>(name, no_index, Others::refused);
  }
  /// Reads an array of tables `[[name]]`, in file order; empty when absent.
  template <class Params> std::vector<Params> read_all(std::string_view name) const {
    std::vector<Params> all;
    for (std::size_t k = 0, n = array_size(name); k < n; ++k)
      all.push_back(read_element<Params>(name, k, Others::refused));
    return all;
  }
  /// The same for a reader that needs some keys of another's table; the rest is not its business.
  template <class Params> Params peek(std::string_view name) const {
    return read_element<Params>(name, no_index, Others::allowed);
  }
  template <class Params> std::vector<Params> peek_all(std::string_view name) const {
    std::vector<Params> all;
    for (std::size_t k = 0, n = array_size(name); k < n; ++k)
      all.push_back(read_element<Params>(name, k, Others::allowed));
    return all;
  }
  /// Throws for a top-level or nested table that is not among `names` ("fluid", "fluid.walls" ...);
  /// "fluid.*" stands for any table of one level below, which its owner checks.
  void allow_tables(std::initializer_list<std::string_view> names) const;

  bool has_table(std::string_view name) const;
  const std::string &file_name() const;
  /// Every key and value in a fixed order, one per line: what both sides compare at connect.
  /// Without the key `secret` ("bridge.token").
  std::string canonical_text(std::string_view secret = "") const;

  static constexpr std::size_t no_index = static_cast<std::size_t>(-1);

private:
  friend class TableReader;
  enum class Others { refused, allowed }; ///< keys of the table that Params does not describe
  template <class Params>
  Params read_element(std::string_view name, std::size_t index, Others others) const {
    TableReader reader(*this, std::string(name), index);
    Params params;
    params.describe(reader);
    if (others == Others::refused)
      reader.reject_unknown_keys();
    reader.reject_missing_keys();
    return params;
  }
  std::size_t array_size(std::string_view name) const;

  struct Document;
  std::shared_ptr<const Document> document_;
};

/// The candidate nearest to `word` in edit distance, or "" when none is near.
std::string nearest_word(std::string_view word, std::span<const std::string> candidates);

} // namespace sluice
