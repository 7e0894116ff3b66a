// SPDX-License-Identifier: MIT
#include "bridge/message.hpp"

#include <fmt/format.h>

#include <bit>
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
  const auto mix = [](std::uint64_t &state, std::uint64_t word) {
    state = (state ^ word) * odd;
    state ^= state >> 32;
  };
  std::array<std::uint64_t, 4> chains{1, 2, 3, 4};
  std::size_t k = 0;
  for (; k + 32 <= bytes.size(); k += 32)
    for (std::size_t c = 0; c < 4; ++c)
      mix(chains[c], get<std::uint64_t>(bytes, k + 8 * c));
  std::array<std::uint64_t, 4> last{};
  if (k < bytes.size())
    std::memcpy(last.data(), bytes.data() + k, bytes.size() - k);
  std::uint64_t state = bytes.size() * odd + 1;
  for (std::size_t c = 0; c < 4; ++c) {
    mix(chains[c], last[c]);
    mix(state, chains[c]);
  }
  return state;
}

void write_header(FrameType type, std::uint64_t sequence, std::span<std::byte> frame) {
  const std::span<const std::byte> payload = frame.subspan(header_size);
  put(frame, 0, magic);
  put(frame, 4, protocol_version);
  put(frame, 6, static_cast<std::uint16_t>(type));
  put(frame, 8, sequence);
  put(frame, 16, static_cast<std::uint64_t>(payload.size()));
  put(frame, 24, checksum(payload));
  put(frame, 32, checksum(frame.first(checked_header_size)));
}

Bytes encode_frame(FrameType type, std::uint64_t sequence, std::span<const std::byte> payload) {
  Bytes frame(header_size + payload.size());
  if (!payload.empty())
    std::memcpy(frame.data() + header_size, payload.data(), payload.size());
  write_header(type, sequence, frame);
  return frame;
}

FrameHeader decode_header(std::span<const std::byte, header_size> bytes) {
  if (get<std::array<char, 4>>(bytes, 0) != magic)
    throw MalformedMessage(
        "the bytes do not start a Sluice frame (another program at this address?)");
  if (get<std::uint64_t>(bytes, 32) != checksum(bytes.first(checked_header_size)))
    throw MalformedMessage("a frame's header is damaged (checksum)");
  if (const auto version = get<std::uint16_t>(bytes, 4); version != protocol_version)
    throw MalformedMessage(fmt::format("protocol version {} there, {} here; build both programs "
                                       "from the same sources",
                                       version, protocol_version));
  const auto type = get<std::uint16_t>(bytes, 6);
  if (!is_known(type))
    throw MalformedMessage(fmt::format("unknown frame type {}", type));
  return {static_cast<FrameType>(type), get<std::uint64_t>(bytes, 8), get<std::uint64_t>(bytes, 16),
          get<std::uint64_t>(bytes, 24)};
}

void check_payload(const FrameHeader &header, std::span<const std::byte> payload) {
  if (payload.size() != header.length || checksum(payload) != header.checksum)
    throw MalformedMessage(
        fmt::format("the payload of a {} frame is damaged (checksum)", name_of(header.type)));
}

void PayloadWriter::append(const void *data, std::size_t size) {
  const auto *first = static_cast<const std::byte *>(data);
  frame_.insert(frame_.end(), first, first + size);
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

void PayloadReader::take(void *into, std::size_t size) {
  if (size > rest_.size())
    throw MalformedMessage(
        fmt::format("a payload ends early: {} bytes needed, {} left", size, rest_.size()));
  if (size > 0)
    std::memcpy(into, rest_.data(), size);
  rest_ = rest_.subspan(size);
}

// The count is compared with what is left before anything is allocated.
std::size_t PayloadReader::count(std::size_t element_size) {
  const std::uint64_t n = number();
  if (n > rest_.size() / element_size)
    throw MalformedMessage(
        fmt::format("a payload announces {} values of {} bytes with {} bytes left", n, element_size,
                    rest_.size()));
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
std::string PayloadReader::text() {
  std::string value(count(1), '\0');
  take(value.data(), value.size());
  return value;
}
std::vector<double> PayloadReader::reals() {
  std::vector<double> values(count(sizeof(double)));
  take(values.data(), values.size() * sizeof(double));
  return values;
}
std::vector<int> PayloadReader::integers() {
  std::vector<int> values(count(sizeof(int)));
  take(values.data(), values.size() * sizeof(int));
  return values;
}
void PayloadReader::finish() const {
  if (!rest_.empty())
    throw MalformedMessage(fmt::format("{} bytes too many at the end of a payload", rest_.size()));
}

} // namespace sluice::bridge
