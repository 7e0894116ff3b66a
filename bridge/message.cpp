// SPDX-License-Identifier: MIT
#include "bridge/message.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cassert>
#include <cstring>

namespace sluice::bridge {

static_assert(std::endian::native == std::endian::little,
              "the wire is little-endian and values are copied as they lie in memory");

namespace {

constexpr std::array<char, 4> magic{'S', 'L', 'C', 'E'};
constexpr std::size_t checked_header_size = header_size - 8; // what the header's checksum covers

template <class T> void put(std::span<std::byte> bytes, std::size_t offset, const T &value) {
  std::memcpy(bytes.data() + offset, &value, sizeof value);
}

template <class T> T get(std::span<const std::byte> bytes, std::size_t offset) {
  T value;
  std::memcpy(&value, bytes.data() + offset, sizeof value);
  return value;
}

constexpr std::array<std::string_view, 11> type_names{
    "",       "hello",   "case_text", "mesh",      "map_report", "initial",
    "forces", "iterate", "goodbye",   "heartbeat", "abort"};

bool is_known(std::uint16_t type) { return type >= 1 && type < type_names.size(); }

} // namespace

std::string name_of(FrameType type) {
  const auto number = static_cast<std::uint16_t>(type);
  return is_known(number) ? std::string(type_names[number]) : fmt::format("frame {}", number);
}

std::uint64_t checksum(std::span<const std::byte> bytes) {
  constexpr std::uint64_t odd = 0x9E3779B97F4A7C15u; // 2^64 / golden ratio
  std::uint64_t state = bytes.size() * odd + 1;
  for (std::size_t k = 0; k < bytes.size(); k += 8) {
    std::uint64_t word = 0;
    std::memcpy(&word, bytes.data() + k, std::min<std::size_t>(8, bytes.size() - k));
    state = (state ^ word) * odd;
    state ^= state >> 32;
  }
  return state;
}

namespace {

void write_header(FrameType type, std::uint64_t sequence, std::uint64_t length,
                  std::span<std::byte> header) {
  put(header, 0, magic);
  put(header, 4, protocol_version);
  put(header, 6, static_cast<std::uint16_t>(type));
  put(header, 8, sequence);
  put(header, 16, length);
  put(header, 24, checksum(header.first(checked_header_size)));
}

} // namespace

Bytes encode_frame(FrameType type, std::uint64_t sequence, std::span<const std::byte> payload) {
  Bytes frame(header_size);
  write_header(type, sequence, payload.size(), frame);
  frame.insert(frame.end(), payload.begin(), payload.end());
  return frame;
}

FrameHeader decode_header(std::span<const std::byte, header_size> bytes) {
  if (get<std::array<char, 4>>(bytes, 0) != magic)
    throw MalformedMessage(
        "the bytes do not start a Sluice frame (another program at this address?)");
  if (const auto version = get<std::uint16_t>(bytes, 4); version != protocol_version)
    throw MalformedMessage(fmt::format("protocol version {} there, {} here; build both programs "
                                       "from the same sources",
                                       version, protocol_version));
  if (get<std::uint64_t>(bytes, checked_header_size) != checksum(bytes.first(checked_header_size)))
    throw MalformedMessage("a frame's header is damaged (checksum)");
  const auto type = get<std::uint16_t>(bytes, 6);
  if (!is_known(type))
    throw MalformedMessage(fmt::format("unknown frame type {}", type));
  return {static_cast<FrameType>(type), get<std::uint64_t>(bytes, 8),
          get<std::uint64_t>(bytes, 16)};
}

void PayloadWriter::append(const void *data, std::size_t size) {
  const auto *first = static_cast<const std::byte *>(data);
  own_.insert(own_.end(), first, first + size);
}

PayloadWriter &PayloadWriter::number(std::uint64_t value) {
  append(&value, sizeof value);
  return *this;
}
PayloadWriter &PayloadWriter::real(double value) {
  append(&value, sizeof value);
  return *this;
}
PayloadWriter &PayloadWriter::text(std::string_view value) {
  number(value.size());
  append(value.data(), value.size());
  return *this;
}
PayloadWriter &PayloadWriter::reals(std::span<const double> values) {
  number(values.size());
  append(values.data(), values.size_bytes());
  return *this;
}
PayloadWriter &PayloadWriter::integers(std::span<const int> values) {
  static_assert(sizeof(int) == 4);
  number(values.size());
  append(values.data(), values.size_bytes());
  return *this;
}
PayloadWriter &PayloadWriter::borrowed(std::span<const double> values) {
  constexpr std::size_t worth_a_piece = 512; // values; fewer are copied faster than gathered
  if (values.size() < worth_a_piece)
    return reals(values);
  number(values.size());
  borrowed_.push_back({own_.size(), std::as_bytes(values)});
  return *this;
}

std::span<const std::byte> PayloadWriter::bytes() const {
  assert(borrowed_.empty());
  return std::span(own_).subspan(header_size);
}

std::vector<std::span<const std::byte>> PayloadWriter::frame(FrameType type,
                                                             std::uint64_t sequence) {
  std::uint64_t length = own_.size() - header_size;
  std::vector<std::span<const std::byte>> parts;
  parts.reserve(2 * borrowed_.size() + 1);
  std::size_t done = 0;
  for (const Borrowed &lot : borrowed_) {
    parts.push_back(std::span(own_).subspan(done, lot.at - done));
    parts.push_back(lot.bytes);
    length += lot.bytes.size();
    done = lot.at;
  }
  if (done < own_.size())
    parts.push_back(std::span(own_).subspan(done));
  write_header(type, sequence, length, own_);
  return parts;
}

void PayloadReader::take(void *into, std::size_t size) {
  if (size > left_)
    throw MalformedMessage(
        fmt::format("a payload ends early: {} bytes needed, {} left", size, left_));
  left_ -= size;
  if (size == 0)
    return;
  if (source_)
    return source_->read({static_cast<std::byte *>(into), size});
  std::memcpy(into, at_hand_.data(), size);
  at_hand_ = at_hand_.subspan(size);
}

// The count is compared with what is left before anything is allocated.
std::size_t PayloadReader::count(std::size_t element_size) {
  const std::uint64_t n = number();
  if (n > left_ / element_size)
    throw MalformedMessage(fmt::format(
        "a payload announces {} values of {} bytes with {} bytes left", n, element_size, left_));
  return static_cast<std::size_t>(n);
}

std::uint64_t PayloadReader::number() {
  std::uint64_t value = 0;
  take(&value, sizeof value);
  return value;
}
double PayloadReader::real() {
  double value = 0;
  take(&value, sizeof value);
  return value;
}

template <class Values> Values PayloadReader::grown() {
  constexpr std::size_t size = sizeof(typename Values::value_type), chunk = (1 << 20) / size;
  const std::size_t n = count(size);
  Values values;
  while (values.size() < n) {
    const std::size_t have = values.size();
    values.resize(std::min(n, have + chunk));
    take(values.data() + have, size * (values.size() - have));
  }
  return values;
}
std::string PayloadReader::text() { return grown<std::string>(); }
std::vector<double> PayloadReader::reals() { return grown<std::vector<double>>(); }
std::vector<int> PayloadReader::integers() { return grown<std::vector<int>>(); }

void PayloadReader::reals(std::span<double> into) {
  if (const std::size_t n = count(sizeof(double)); n != into.size())
    throw MalformedMessage(fmt::format("{} values came instead of {}", n, into.size()));
  take(into.data(), into.size_bytes());
}
void PayloadReader::finish() const {
  if (left_ > 0)
    throw MalformedMessage(fmt::format("{} bytes too many at the end of a payload", left_));
}

} // namespace sluice::bridge
