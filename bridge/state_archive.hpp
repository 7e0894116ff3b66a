// SPDX-License-Identifier: MIT
// What the bridge must remember to go on bit for bit, as bytes. A class lists its members once,
//   template <class Archive> void archive(Archive &a) { a(tick_, span_, history_); }
// and the same list writes them (StateWriter) and reads them back (StateReader).
#pragma once

#include "bridge/message.hpp"

#include <Eigen/Core>

#include <deque>
#include <map>
#include <optional>
#include <string>
#include <type_traits>
#include <variant>
#include <vector>

namespace sluice::bridge {

class StateWriter {
public:
  template <class... T> void operator()(T &...values) { (put(values), ...); }
  /// All of it, and a checksum.
  std::vector<std::byte> bytes() const {
    PayloadWriter end;
    end.number(checksum(payload_.bytes()));
    std::vector<std::byte> all(payload_.bytes().begin(), payload_.bytes().end());
    all.insert(all.end(), end.bytes().begin(), end.bytes().end());
    return all;
  }

private:
  void put(double value) { payload_.real(value); }
  template <class T>
  requires std::is_integral_v<T>
  void put(T value) { payload_.number(static_cast<std::uint64_t>(value)); }
  void put(std::string &text) { payload_.text(text); }
  void put(Eigen::VectorXd &v) { payload_.reals({v.data(), static_cast<std::size_t>(v.size())}); }
  void put(std::vector<double> &values) { payload_.reals(values); }
  template <class T> void put(std::vector<T> &values) { put_all(values); }
  template <class T> void put(std::deque<T> &values) { put_all(values); }
  template <class Range> void put_all(Range &values) {
    payload_.number(values.size());
    for (auto &value : values)
      put(value);
  }
  template <class T, std::size_t n> void put(std::array<T, n> &values) {
    for (T &value : values)
      put(value);
  }
  template <class T> void put(std::map<long, T> &values) {
    payload_.number(values.size());
    for (auto &[key, value] : values) {
      put(key);
      put(value);
    }
  }
  template <class T> void put(std::optional<T> &value) {
    payload_.number(value.has_value());
    if (value)
      put(*value);
  }
  template <class... T> void put(std::variant<T...> &value) {
    payload_.number(value.index());
    std::visit([&](auto &chosen) { put(chosen); }, value);
  }
  template <class T>
  requires requires(T &value, StateWriter &a) { value.archive(a); }
  void put(T &value) { value.archive(*this); }

  PayloadWriter payload_;
};

/// Throws MalformedMessage where the bytes are not what the writer wrote.
class StateReader {
public:
  explicit StateReader(std::span<const std::byte> bytes) : payload_(intact(bytes)) {}
  template <class... T> void operator()(T &...values) { (get(values), ...); }
  void finish() const { payload_.finish(); }

private:
  static std::span<const std::byte> intact(std::span<const std::byte> bytes) {
    const std::size_t size = bytes.size() - std::min(bytes.size(), sizeof(std::uint64_t));
    PayloadReader end(bytes.subspan(size));
    if (end.number() != checksum(bytes.first(size)))
      throw MalformedMessage("its checksum is wrong");
    return bytes.first(size);
  }
  void get(double &value) { value = payload_.real(); }
  template <class T>
  requires std::is_integral_v<T>
  void get(T &value) { value = static_cast<T>(payload_.number()); }
  void get(std::string &text) { text = payload_.text(); }
  void get(Eigen::VectorXd &v) {
    const std::vector<double> values = payload_.reals();
    v = Eigen::Map<const Eigen::VectorXd>(values.data(), static_cast<Eigen::Index>(values.size()));
  }
  void get(std::vector<double> &values) { values = payload_.reals(); }
  template <class T> void get(std::vector<T> &values) { get_all(values); }
  template <class T> void get(std::deque<T> &values) { get_all(values); }
  // One by one: a damaged count finds the end of the bytes before it takes the memory.
  template <class Range> void get_all(Range &values) {
    values.clear();
    for (std::uint64_t n = payload_.number(); n > 0; --n)
      get(values.emplace_back());
  }
  template <class T, std::size_t n> void get(std::array<T, n> &values) {
    for (T &value : values)
      get(value);
  }
  template <class T> void get(std::map<long, T> &values) {
    values.clear();
    for (std::uint64_t n = payload_.number(); n > 0; --n) {
      long key = 0;
      get(key);
      get(values[key]);
    }
  }
  template <class T> void get(std::optional<T> &value) {
    value.reset();
    if (payload_.number() != 0)
      get(value.emplace());
  }
  template <class... T> void get(std::variant<T...> &value) {
    if (payload_.number() != value.index())
      throw MalformedMessage("the saved state is of another kind");
    std::visit([&](auto &chosen) { get(chosen); }, value);
  }
  template <class T>
  requires requires(T &value, StateReader &a) { value.archive(a); }
  void get(T &value) { value.archive(*this); }

  PayloadReader payload_;
};

} // namespace sluice::bridge
