// SPDX-License-Identifier: MIT
// A whole participant that listens to bytes which may be anything: what the wire decoder is
// fuzzed with, and what the corpus is replayed by.
//
// An input is one byte, then the stream. Bit 0 of the byte: the participant is the solid (else the
// fluid). Bit 1: the stream is taken as it is; else it is a sequence of records
//   type (1 byte), length (2 bytes, little-endian), payload
// each of which becomes a frame with a right header, so that the decoders behind it are reached.
#pragma once

#include "bridge/message.hpp"

#include <filesystem>
#include <span>
#include <string>

namespace sluice::bridge {

/// How a participant took an input.
struct Reception {
  std::string error;        ///< its UserError; "" where it ran to its end
  std::size_t received = 0; ///< [bytes] of the stream that it read
  std::size_t memory = 0;   ///< [bytes] more than before, at most, while it did
};

/// Runs a participant that gets `input` and then the end of the stream. Throws whatever is no
/// UserError. `folder` is for what it writes.
Reception receive(std::span<const std::byte> input, const std::filesystem::path &folder);

/// The most memory [bytes] that a participant of that small case may take: what it needs itself,
/// one chunk ahead of what arrives, and a multiple of what did arrive.
std::size_t memory_limit(std::size_t received);

/// Inputs that are whole conversations: what the fluid hears, and what the solid does.
struct Conversations {
  Bytes fluid, solid;
};
Conversations record_conversations(const std::filesystem::path &folder);

} // namespace sluice::bridge
