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
#include <memory>
#include <span>
#include <stdexcept>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace sluice::bridge {

/// Leaves new elements as they are: a buffer that is filled next need not be cleared first.
template <class T> struct Uninitialised : std::allocator<T> {
  template <class U> struct rebind { using other = Uninitialised<U>; };
  template <class U, class... Args> void construct(U *place, Args &&...args) {
    if constexpr (sizeof...(Args) == 0)
      ::new (static_cast<void *>(place)) U;
    else
      ::new (static_cast<void *>(place)) U(std::forward<Args>(args)...);
  }
};
using Bytes = std::vector<std::byte, Uninitialised<std::byte>>;

inline constexpr std::uint16_t protocol_version = 3;
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

/// 64-bit checksum over 8-byte words, in four chains that are joined at the end (word k goes to
/// chain k mod 4: a processor works on all four at once). Each step is a bijection of the state for
/// a given word and of the word for a given state, so that an error confined to one word is always
/// found.
std::uint64_t checksum(std::span<const std::byte> bytes);

/// Fills the first header_size bytes of `frame` for the payload behind them.
void write_header(FrameType type, std::uint64_t sequence, std::span<std::byte> frame);
/// Header and payload in one block, ready to send.
Bytes encode_frame(FrameType type, std::uint64_t sequence, std::span<const std::byte> payload);
/// Throws MalformedMessage for a wrong magic number, checksum, version or type.
FrameHeader decode_header(std::span<const std::byte, header_size> bytes);
/// Throws MalformedMessage when `payload` is not what `header` announced.
void check_payload(const FrameHeader &header, std::span<const std::byte> payload);

/// Appends values to a payload. Room for the header stays in front of it, so that a frame is never
/// copied as a whole.
class PayloadWriter {
public:
  PayloadWriter() : frame_(header_size) {}
  PayloadWriter &number(std::uint64_t value);
  PayloadWriter &real(double value);
  PayloadWriter &text(std::string_view value);          ///< length, characters
  PayloadWriter &reals(std::span<const double> values); ///< count, values
  PayloadWriter &integers(std::span<const int> values); ///< count, values of 4 bytes
  /// The payload.
  std::span<const std::byte> bytes() const { return std::span(frame_).subspan(header_size); }
  /// The whole frame, its header written.
  std::span<const std::byte> frame(FrameType type, std::uint64_t sequence) {
    write_header(type, sequence, frame_);
    return frame_;
  }

private:
  void append(const void *data, std::size_t size);
  Bytes frame_;
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
