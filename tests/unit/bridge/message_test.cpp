// SPDX-License-Identifier: MIT
#include "bridge/link.hpp"
#include "bridge/message.hpp"
#include "bridge/transport_local.hpp"

#include "support.hpp"

#include <cstring>
#include <limits>

namespace sluice::bridge {
namespace {

Bytes sample_payload() {
  PayloadWriter write;
  write.number(17)
      .real(-0.1)
      .text("gate")
      .reals(std::vector<double>{1.5, -2.5})
      .integers(std::vector<int>{3, -4, 5});
  return write.bytes();
}

std::span<const std::byte, header_size> header_of(const Bytes &frame) {
  return std::span(frame).first<header_size>();
}

template <class Action> bool is_malformed(Action &&action) {
  try {
    action();
  } catch (const MalformedMessage &) {
    return true;
  }
  return false;
}

TEST(Message, a_payload_reads_back_what_was_written) {
  const Bytes payload = sample_payload();
  PayloadReader read(payload);
  EXPECT_EQ(read.number(), 17u);
  EXPECT_EQ(read.real(), -0.1);
  EXPECT_EQ(read.text(), "gate");
  EXPECT_EQ(read.reals(), (std::vector<double>{1.5, -2.5}));
  EXPECT_EQ(read.integers(), (std::vector<int>{3, -4, 5}));
  EXPECT_NO_THROW(read.finish());
}

TEST(Message, a_header_reads_back_what_was_written) {
  const Bytes payload = sample_payload();
  const Bytes frame = encode_frame(FrameType::forces, 7, payload);
  const FrameHeader header = decode_header(header_of(frame));
  EXPECT_EQ(header.type, FrameType::forces);
  EXPECT_EQ(header.sequence, 7u);
  EXPECT_EQ(header.length, payload.size());
  EXPECT_NO_THROW(check_payload(header, std::span(frame).subspan(header_size)));
}

TEST(Message, the_byte_layout_is_the_documented_one) {
  const Bytes frame = encode_frame(FrameType::abort, 0x0102, sample_payload());
  const auto byte = [&](std::size_t k) { return std::to_integer<int>(frame[k]); };
  EXPECT_EQ(std::memcmp(frame.data(), "SLCE", 4), 0);
  EXPECT_EQ(byte(4), 1);  // version, low byte first
  EXPECT_EQ(byte(6), 10); // type
  EXPECT_EQ(byte(8), 2);  // sequence
  EXPECT_EQ(byte(9), 1);
  EXPECT_EQ(byte(16), static_cast<int>(sample_payload().size()));
}

TEST(Message, every_single_bit_error_is_found) {
  const Bytes good = encode_frame(FrameType::iterate, 3, sample_payload());
  for (std::size_t bit = 0; bit < 8 * good.size(); ++bit) {
    Bytes bad = good;
    bad[bit / 8] ^= std::byte(1 << (bit % 8));
    EXPECT_TRUE(is_malformed([&] {
      check_payload(decode_header(header_of(bad)), std::span(bad).subspan(header_size));
    })) << "bit "
        << bit;
  }
}

TEST(Message, a_truncated_payload_is_refused_without_allocating) {
  const Bytes payload = sample_payload();
  for (std::size_t n = 0; n < payload.size(); ++n)
    EXPECT_TRUE(is_malformed([&] {
      const auto part = std::span(payload).first(n);
      PayloadReader read(part);
      read.number(), read.real(), read.text(), read.reals(), read.integers();
    })) << n;
  PayloadWriter huge;
  huge.number(std::numeric_limits<std::uint64_t>::max());
  EXPECT_TRUE(is_malformed([&] { PayloadReader(huge.bytes()).reals(); }));
  EXPECT_TRUE(is_malformed([&] { PayloadReader(huge.bytes()).text(); }));
}

TEST(Message, bytes_left_over_are_refused) {
  const Bytes payload = sample_payload();
  PayloadReader read(payload);
  read.number();
  EXPECT_TRUE(is_malformed([&] { read.finish(); }));
}

// A partner that sends anything: frames with changed bytes, cut or joined at random places.
TEST(Message, garbage_ends_in_a_user_error_and_nothing_else) {
  std::mt19937 engine(11);
  for (int round = 0; round < 2000; ++round) {
    auto [here, there] = local_transports();
    Link link(std::move(here), "fluid", "solid", 5);
    Bytes stream = encode_frame(FrameType::heartbeat, 0, {});
    const Bytes second = encode_frame(FrameType::iterate, 1, sample_payload());
    stream.insert(stream.end(), second.begin(), second.end());
    for (unsigned n = engine() % 3; n > 0; --n)
      stream[engine() % stream.size()] = std::byte(engine());
    stream.resize(engine() % (stream.size() + 1));
    if (!stream.empty())
      there->write_some(stream, deadline_in(1));
    there.reset();
    const auto error = error_of([&] {
      link.receive(FrameType::forces, 1 << 20, "the forces", [](PayloadReader &) { return 0; });
    });
    EXPECT_TRUE(contains(error, "the fluid") && contains(error, "solid")) << error;
  }
}

TEST(Link, a_length_beyond_the_limit_is_refused_before_it_is_allocated) {
  auto [here, there] = local_transports();
  Link link(std::move(here), "fluid", "solid", 5);
  Bytes frame = encode_frame(FrameType::mesh, 0, {});
  const std::uint64_t length = std::uint64_t{1} << 50;
  std::memcpy(frame.data() + 16, &length, 8);
  const auto sum = checksum(std::span(frame).first(32));
  std::memcpy(frame.data() + 32, &sum, 8);
  there->write_some(frame, deadline_in(1));
  const auto error = error_of(
      [&] { link.receive(FrameType::mesh, 4096, "the mesh", [](PayloadReader &) { return 0; }); });
  EXPECT_TRUE(contains(error, "announces 1125899906842624 bytes, at most 4096")) << error;
}

TEST(Link, a_lost_or_repeated_frame_is_noticed) {
  auto [here, there] = local_transports();
  Link link(std::move(here), "fluid", "solid", 5);
  there->write_some(encode_frame(FrameType::mesh, 1, {}), deadline_in(1));
  const auto error = error_of(
      [&] { link.receive(FrameType::mesh, 4096, "the mesh", [](PayloadReader &) { return 0; }); });
  EXPECT_TRUE(contains(error, "frame number 1 came instead of 0")) << error;
}

TEST(Link, another_protocol_version_is_named) {
  auto [here, there] = local_transports();
  Link link(std::move(here), "fluid", "solid", 5);
  Bytes frame = encode_frame(FrameType::hello, 0, {});
  frame[4] = std::byte(9);
  const auto sum = checksum(std::span(frame).first(32));
  std::memcpy(frame.data() + 32, &sum, 8);
  there->write_some(frame, deadline_in(1));
  const auto error = error_of([&] {
    link.receive(FrameType::hello, 4096, "the greeting", [](PayloadReader &) { return 0; });
  });
  EXPECT_TRUE(contains(error, "protocol version 9 there, 1 here")) << error;
}

} // namespace
} // namespace sluice::bridge
