// SPDX-License-Identifier: MIT
// The C++ interface of preCICE v3, as far as README.md of this folder says, spoken by Sluice's
// bridge: an adapter that was written for it compiles and links against libprecice unchanged.
// Written from the documentation of that interface; the meaning of every call is the one given
// there.
#pragma once

#include <cstddef>
#include <memory>
#include <stdexcept>
#include <string>
#include <type_traits>
#include <utility>

namespace precice {

/// Contiguous elements that somebody else owns.
template <class T> class span {
public:
  using element_type = T;
  constexpr span() = default;
  constexpr span(T *first, std::size_t size) : data_(first), size_(size) {}
  template <std::size_t n> constexpr span(T (&array)[n]) : data_(array), size_(n) {}
  /// Of a vector, an array, a string: whatever has data() and size().
  template <class Range, class = std::enable_if_t<
                             std::is_convertible_v<decltype(std::declval<Range &>().data()), T *>>>
  constexpr span(Range &&range) : data_(range.data()), size_(range.size()) {}
  constexpr T *data() const { return data_; }
  constexpr std::size_t size() const { return size_; }
  constexpr bool empty() const { return size_ == 0; }
  constexpr T *begin() const { return data_; }
  constexpr T *end() const { return data_ + size_; }
  constexpr T &operator[](std::size_t k) const { return data_[k]; }

private:
  T *data_ = nullptr;
  std::size_t size_ = 0;
};

/// A name: also a text in quotes, without its final zero.
class string_view : public span<const char> {
public:
  using span<const char>::span;
  string_view(const char *text) : span<const char>(text, std::char_traits<char>::length(text)) {}
  template <std::size_t n> string_view(const char (&text)[n]) : string_view(&text[0]) {}
  string_view(const std::string &text) : span<const char>(text.data(), text.size()) {}
};

using VertexID = int;

/// Whatever goes wrong, at this side or at the partner's, with the reason.
class Error : public std::runtime_error {
public:
  using std::runtime_error::runtime_error;
};

class Participant {
public:
  /// `solverProcessIndex` of `solverProcessSize` ranks: one rank only, so far.
  Participant(string_view participantName, string_view configurationFileName,
              int solverProcessIndex, int solverProcessSize);
  ~Participant();
  Participant(Participant &&) noexcept;

  void initialize();
  void advance(double computedTimeStepSize);
  void finalize();

  int getMeshDimensions(string_view meshName) const;
  int getDataDimensions(string_view meshName, string_view dataName) const;
  bool isCouplingOngoing() const;
  bool isTimeWindowComplete() const;
  double getMaxTimeStepSize() const;

  bool requiresInitialData();
  bool requiresWritingCheckpoint();
  bool requiresReadingCheckpoint();
  bool requiresMeshConnectivityFor(string_view meshName) const;

  VertexID setMeshVertex(string_view meshName, span<const double> position);
  void setMeshVertices(string_view meshName, span<const double> coordinates, span<VertexID> ids);
  int getMeshVertexSize(string_view meshName) const;
  void setMeshEdge(string_view meshName, VertexID first, VertexID second);
  void setMeshEdges(string_view meshName, span<const VertexID> ids);
  void setMeshTriangle(string_view meshName, VertexID first, VertexID second, VertexID third);
  void setMeshTriangles(string_view meshName, span<const VertexID> ids);

  void writeData(string_view meshName, string_view dataName, span<const VertexID> ids,
                 span<const double> values);
  void readData(string_view meshName, string_view dataName, span<const VertexID> ids,
                double relativeReadTime, span<double> values) const;

  /// Sluice measures itself: these do nothing.
  void startProfilingSection(string_view) {}
  void stopLastProfilingSection() {}

private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

} // namespace precice
