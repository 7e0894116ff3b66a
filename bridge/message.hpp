// SPDX-License-Identifier: MIT
// The bytes on the wire: framed, versioned, checksummed records, little-endian throughout.
//
// A frame is a header of 40 bytes and a payload. The header carries its own checksum, so that an
// announced length is only believed when the header is intact, and no more is ever allocated than
// the limit that the receiver names for the frame it awaits. README.md has the byte layout.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

namespace sluice::bridge {

using Bytes = std::vector<std::byte>;

inline constexpr std::uint16_t protocol_version = 1;
inline constexpr std::size_t header_size = 40; // [bytes]

enum class FrameType : std::uint16_t {
  hello = 1,      ///< role and token; the first frame of either side
  case_text = 2,  ///< the whole case file in canonical form
  mesh = 3,       ///< interface mesh
  map_report = 4, ///< fluid: what the map looks like
  initial = 5,    ///< solid: initial displacement and velocity
  forces = 6,     ///< fluid: mapped forces of one iteration
  iterate = 7,    ///< solid: verdict on the iteration and the next iterate
  goodbye = 8,    ///< orderly end
  heartbeat = 9,  ///< no payload: this process lives
  abort = 10      ///< the sender's last message
};

/// "forces", "abort" ...; "frame 17" for an unknown number.
std::string name_of(FrameType type);

/// The bytes are not what the protocol allows. Becomes a UserError where the partner is known.
class MalformedMessage : public std::runtime_error {
public:
  using std::runtime_error::runtime_error;
};

struct FrameHeader {
  FrameType type = FrameType::heartbeat;
  std::uint64_t sequence = 0; ///< frames sent before this one by the same side
  std::uint64_t length = 0;   ///< payload [bytes]
  std::uint64_t checksum = 0; ///< of the payload
};

/// 64-bit checksum over 8-byte words. Each step is a bijection of the state for a given word and of
/// the word for a given state, so that an error confined to one word is always found.
std::uint64_t checksum(std::span<const std::byte> bytes);

/// Header and payload in one block, ready to send.
Bytes encode_frame(FrameType type, std::uint64_t sequence, std::span<const std::byte> payload);
/// Throws MalformedMessage for a wrong magic number, checksum, version or type.
FrameHeader decode_header(std::span<const std::byte, header_size> bytes);
/// Throws MalformedMessage when `payload` is not what `header` announced.
void check_payload(const FrameHeader &header, std::span<const std::byte> payload);

/// Appends values to a payload.
class PayloadWriter {
public:
  PayloadWriter &number(std::uint64_t value);
  PayloadWriter &real(double value);
  PayloadWriter &text(std::string_view value);          ///< length, characters
  PayloadWriter &reals(std::span<const double> values); ///< count, values
  PayloadWriter &integers(std::span<const int> values); ///< count, values of 4 bytes
  const Bytes &bytes() const { return bytes_; }

private:
  void append(const void *data, std::size_t size);
  Bytes bytes_;
};

/// Reads them back in the same order; throws MalformedMessage where the bytes do not suffice. Never
/// allocates more than the payload's own size.
class PayloadReader {
public:
  explicit PayloadReader(std::span<const std::byte> bytes) : rest_(bytes) {}
  std::uint64_t number();
  double real();
  std::string text();
  std::vector<double> reals();
  std::vector<int> integers();
  void finish() const; ///< throws when bytes are left

private:
  void take(void *into, std::size_t size);
  std::size_t count(std::size_t element_size);
  std::span<const std::byte> rest_;
};

} // namespace sluice::bridge
