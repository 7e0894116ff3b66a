// SPDX-License-Identifier: MIT
// A reliable, ordered stream of bytes to the partner. Framing, heartbeats and the wording of errors
// stand above it (link.hpp); sockets and the in-process queue stand below.
#pragma once

#include <algorithm>
#include <chrono>
#include <cstddef>
#include <span>
#include <stdexcept>
#include <string>

namespace sluice::bridge {

using Clock = std::chrono::steady_clock;
using Deadline = Clock::time_point;

/// `seconds` from now (three years at most, so that the clock cannot overflow).
inline Deadline deadline_in(double seconds) {
  const std::chrono::duration<double> wait(std::clamp(seconds, 0.0, 1e8));
  return Clock::now() + std::chrono::duration_cast<Clock::duration>(wait);
}

/// The stream ended or failed; the text is the system's.
class ConnectionLost : public std::runtime_error {
public:
  using std::runtime_error::runtime_error;
};

/// Pieces of memory that are sent one after the other as if they were one.
using Pieces = std::span<const std::span<const std::byte>>;

class Transport {
public:
  virtual ~Transport() = default;

  /// Sends some of `pieces` (at least one byte of the first, which is not empty) and returns how
  /// many bytes; 0 when `deadline` passed first. Throws ConnectionLost.
  virtual std::size_t write_some(Pieces pieces, Deadline deadline) = 0;
  std::size_t write_some(std::span<const std::byte> bytes, Deadline deadline) {
    return write_some(Pieces(&bytes, 1), deadline);
  }
  /// Receives at least one byte and returns how many; 0 when `deadline` passed first. Throws
  /// ConnectionLost, also at the orderly end of the stream.
  virtual std::size_t read_some(std::span<std::byte> bytes, Deadline deadline) = 0;
  /// True when a frame of a few bytes can be sent without waiting.
  virtual bool can_write() = 0;
};

} // namespace sluice::bridge
