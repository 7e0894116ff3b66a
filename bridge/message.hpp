// SPDX-License-Identifier: MIT
// The bytes on the wire: framed, versioned records, little-endian throughout.
//
// A frame is a header of 32 bytes and a payload. The header carries a checksum, so that an
// announced length is only believed when the header is intact, and no more is ever allocated than
// the limit that the receiver names for the frame it awaits. The payload is left to the stream,
// which keeps bytes as they are (the kernel's memory on one host, TCP's checksums between hosts).
// Fields are neither copied into a frame nor out of one: they are sent from where they lie and read
// to where they belong. README.md has the byte layout.
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

inline constexpr std::uint16_t protocol_version = 5;
inline constexpr std::size_t header_size = 32; // [bytes]

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
};

/// 64-bit checksum over 8-byte words (the last one filled up with zeros). Each step is a bijection
/// of the state for a given word and of the word for a given state, so that an error confined to
/// one word is always found.
std::uint64_t checksum(std::span<const std::byte> bytes);

/// Header and payload in one block, for tests.
Bytes encode_frame(FrameType type, std::uint64_t sequence, std::span<const std::byte> payload);
/// Throws MalformedMessage for a wrong magic number, checksum, version or type.
FrameHeader decode_header(std::span<const std::byte, header_size> bytes);

/// Collects the values of a payload.
class PayloadWriter {
public:
  PayloadWriter() : own_(header_size) {}
  PayloadWriter &number(std::uint64_t value);
  PayloadWriter &real(double value);
  PayloadWriter &text(std::string_view value);          ///< length, characters
  PayloadWriter &reals(std::span<const double> values); ///< count, values
  PayloadWriter &integers(std::span<const int> values); ///< count, values of 4 bytes
  /// The same bytes as reals(), but read only when the frame is sent: they must stay until then.
  PayloadWriter &borrowed(std::span<const double> values);
  /// The payload, where nothing is borrowed.
  std::span<const std::byte> bytes() const;
  /// Header and payload, in pieces to be sent one after the other; valid until the writer changes.
  std::vector<std::span<const std::byte>> frame(FrameType type, std::uint64_t sequence);

private:
  struct Borrowed {
    std::size_t at; // so many bytes of own_ come before
    std::span<const std::byte> bytes;
  };
  void append(const void *data, std::size_t size);
  Bytes own_; // room for the header in front
  std::vector<Borrowed> borrowed_;
};

/// Where a payload comes from piece by piece.
class ByteSource {
public:
  virtual ~ByteSource() = default;
  virtual void read(std::span<std::byte> into) = 0;
};

/// Reads the values back in the same order; throws MalformedMessage where the bytes do not suffice.
/// Memory grows only as bytes arrive, whatever counts they announce.
class PayloadReader {
public:
  explicit PayloadReader(std::span<const std::byte> bytes) : at_hand_(bytes), left_(bytes.size()) {}
  PayloadReader(ByteSource &source, std::size_t length) : source_(&source), left_(length) {}
  std::uint64_t number();
  double real();
  std::string text();
  std::vector<double> reals();
  std::vector<int> integers();
  void reals(std::span<double> into); ///< throws unless just as many come
  void finish() const;                ///< throws when bytes are left

private:
  void take(void *into, std::size_t size);
  std::size_t count(std::size_t element_size);
  template <class Values> Values grown();
  ByteSource *source_ = nullptr;
  std::span<const std::byte> at_hand_; // without a source
  std::size_t left_;
};

} // namespace sluice::bridge
