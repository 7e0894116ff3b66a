// SPDX-License-Identifier: MIT
#include "bridge/link.hpp"
#include "bridge/message.hpp"
#include "bridge/side.hpp"
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
  return {write.bytes().begin(), write.bytes().end()};
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
  EXPECT_EQ(frame.size(), header_size + payload.size());
}

TEST(Message, the_byte_layout_is_the_documented_one) {
  const Bytes frame = encode_frame(FrameType::abort, 0x0102, sample_payload());
  const auto byte = [&](std::size_t k) { return std::to_integer<int>(frame[k]); };
  EXPECT_EQ(std::memcmp(frame.data(), "SLCE", 4), 0);
  EXPECT_EQ(byte(4), protocol_version); // version, low byte first
  EXPECT_EQ(byte(6), 10);               // type
  EXPECT_EQ(byte(8), 2);                // sequence
  EXPECT_EQ(byte(9), 1);
  EXPECT_EQ(byte(16), static_cast<int>(sample_payload().size()));
}

TEST(Message, every_single_bit_error_of_a_header_is_found) {
  const Bytes good = encode_frame(FrameType::iterate, 3, sample_payload());
  for (std::size_t bit = 0; bit < 8 * header_size; ++bit) {
    Bytes bad = good;
    bad[bit / 8] ^= std::byte(1 << (bit % 8));
    EXPECT_TRUE(is_malformed([&] { decode_header(header_of(bad)); })) << "bit " << bit;
  }
}

TEST(Message, borrowed_values_are_the_same_bytes_as_copied_ones) {
  const std::vector<double> values{1.5, -2.5, 1e300}, none;
  PayloadWriter copied, borrowed;
  copied.number(1).reals(values).text("gate").reals(none).reals(values);
  borrowed.number(1).borrowed(values).text("gate").borrowed(none).borrowed(values);
  const auto joined = [](PayloadWriter &writer) {
    Bytes bytes;
    for (const auto piece : writer.frame(FrameType::forces, 5)) {
      EXPECT_FALSE(piece.empty());
      bytes.insert(bytes.end(), piece.begin(), piece.end());
    }
    return bytes;
  };
  EXPECT_EQ(joined(borrowed), joined(copied));
}

// A source that gives what it has in pieces of its own choosing.
TEST(Message, a_payload_reads_the_same_from_a_stream) {
  struct Stream : ByteSource {
    explicit Stream(Bytes all) : bytes(std::move(all)) {}
    void read(std::span<std::byte> into) override {
      std::memcpy(into.data(), bytes.data() + at, into.size());
      at += into.size();
    }
    Bytes bytes;
    std::size_t at = 0;
  } stream(sample_payload());
  PayloadReader read(stream, stream.bytes.size());
  EXPECT_EQ(read.number(), 17u);
  EXPECT_EQ(read.real(), -0.1);
  EXPECT_EQ(read.text(), "gate");
  std::vector<double> in_place(2);
  read.reals(in_place);
  EXPECT_EQ(in_place, (std::vector<double>{1.5, -2.5}));
  EXPECT_EQ(read.integers(), (std::vector<int>{3, -4, 5}));
  EXPECT_NO_THROW(read.finish());
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

// The records of the protocol with bytes changed, cut off or put in at random places: read, or
// refused as malformed, and nothing else. What was ever found to go wrong here stays as a seed.
TEST(Message, damaged_records_are_read_or_refused) {
  PayloadWriter mesh, report, totals;
  write_mesh(mesh, polyline({{0, 0}, {1, 0}, {1, 1}}));
  write_report(report, MapReport());
  write_totals(totals, WindowTotals{7, {}});
  const auto decode = [](int record, std::span<const std::byte> bytes) {
    PayloadReader read(bytes);
    if (record == 0)
      check_mesh(read_mesh(read), "fluid");
    else if (record == 1)
      read_report(read);
    else
      read_totals(read);
    read.finish();
  };
  int record = 0;
  long refused = 0;
  for (const PayloadWriter *good : {&mesh, &report, &totals}) {
    EXPECT_NO_THROW(decode(record, good->bytes()));
    for (unsigned seed = 0; seed < 5000; ++seed) {
      std::mt19937 random(seed);
      Bytes bytes(good->bytes().begin(), good->bytes().end());
      for (unsigned change = 0; change <= random() % 4; ++change) {
        const auto at = static_cast<std::ptrdiff_t>(random() % bytes.size());
        if (random() % 4 == 0)
          bytes.resize(static_cast<std::size_t>(at) + 1);
        else if (random() % 4 == 0)
          bytes.insert(bytes.begin() + at, static_cast<std::byte>(random()));
        else
          bytes[static_cast<std::size_t>(at)] =
              static_cast<std::byte>(random() % 3 ? random() : 255);
      }
      try {
        decode(record, bytes);
      } catch (const MalformedMessage &) {
        ++refused;
      } catch (const UserError &) {
        ++refused;
      }
    }
    ++record;
  }
  EXPECT_GT(refused, 5000);
}

TEST(Link, a_length_beyond_the_limit_is_refused_before_it_is_allocated) {
  auto [here, there] = local_transports();
  Link link(std::move(here), "fluid", "solid", 5);
  Bytes frame = encode_frame(FrameType::mesh, 0, {});
  const std::uint64_t length = std::uint64_t{1} << 50;
  std::memcpy(frame.data() + 16, &length, 8);
  const auto sum = checksum(std::span(frame).first(24));
  std::memcpy(frame.data() + 24, &sum, 8);
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
  const auto sum = checksum(std::span(frame).first(24));
  std::memcpy(frame.data() + 24, &sum, 8);
  there->write_some(frame, deadline_in(1));
  const auto error = error_of([&] {
    link.receive(FrameType::hello, 4096, "the greeting", [](PayloadReader &) { return 0; });
  });
  EXPECT_TRUE(contains(error, fmt::format("protocol version 9 there, {} here", protocol_version)))
      << error;
}

} // namespace
} // namespace sluice::bridge
