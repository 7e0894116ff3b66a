// SPDX-License-Identifier: MIT
// Every input that the fuzzer kept (tests/fuzz/corpus): read or refused by a participant, with no
// more memory than the protocol allows.
#include "tests/fuzz/wire_input.hpp"
#include "tests/support/temporary_folder.hpp"

#include <gtest/gtest.h>

#include <cstring>
#include <fstream>
#include <iterator>

namespace sluice::bridge {
namespace {

const std::filesystem::path corpus = SLUICE_CORPUS;

Bytes bytes_of(const std::filesystem::path &file) {
  std::ifstream in(file, std::ios::binary);
  const std::string text{std::istreambuf_iterator<char>(in), {}};
  const auto bytes = std::as_bytes(std::span(text));
  return {bytes.begin(), bytes.end()};
}

TEST(WireCorpus, is_read_or_refused_with_bounded_memory) {
  const TemporaryFolder folder;
  int inputs = 0;
  double most = 0;
  for (const auto &entry : std::filesystem::directory_iterator(corpus)) {
    Reception reception;
    ASSERT_NO_THROW(reception = receive(bytes_of(entry.path()), folder.path())) << entry.path();
    EXPECT_LE(reception.memory, memory_limit(reception.received)) << entry.path();
    most = std::max(most, static_cast<double>(reception.memory) /
                              static_cast<double>(memory_limit(reception.received)));
    ++inputs;
  }
  EXPECT_GT(inputs, 100);
  RecordProperty("inputs", inputs);
  std::printf("%d inputs, at most %.0f %% of the memory allowed\n", inputs, 100 * most);
}

// A corpus of an earlier protocol would be refused at its first frame and prove nothing.
TEST(WireCorpus, holds_whole_conversations_of_this_protocol) {
  const TemporaryFolder folder;
  for (const char *name : {"conversation_fluid_hears", "conversation_solid_hears"})
    EXPECT_EQ(receive(bytes_of(corpus / name), folder.path()).error, "")
        << name << ": record it anew with record_corpus tests/fuzz/corpus";
}

TEST(WireCorpus, memory_follows_what_arrives_and_not_what_is_announced) {
  const TemporaryFolder folder;
  Bytes stream{std::byte{2}}; // the fluid hears these bytes as they are
  PayloadWriter hello;
  const Bytes greeting = [&] {
    hello.text("open").text("solid");
    return encode_frame(FrameType::hello, 0, hello.bytes());
  }();
  stream.insert(stream.end(), greeting.begin(), greeting.end());
  Bytes huge = encode_frame(FrameType::case_text, 1, {}); // announces all that is allowed
  const std::uint64_t length = 16 << 20;
  std::memcpy(huge.data() + 16, &length, sizeof length);
  const std::uint64_t sum = checksum(std::span(huge).first(header_size - 8));
  std::memcpy(huge.data() + header_size - 8, &sum, sizeof sum);
  stream.insert(stream.end(), huge.begin(), huge.end());
  const Reception reception = receive(stream, folder.path());
  EXPECT_NE(reception.error, "");
  EXPECT_LE(reception.memory, memory_limit(reception.received));
  EXPECT_LT(memory_limit(reception.received), length / 8);
}

} // namespace
} // namespace sluice::bridge
