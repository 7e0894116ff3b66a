// SPDX-License-Identifier: MIT
// Frames to and from one named partner over a transport: heartbeats while this side computes, a
// deadline on every wait, and errors that say who, what was awaited, and the partner's last words.
#pragma once

#include "bridge/message.hpp"
#include "bridge/transport.hpp"

#include <atomic>
#include <condition_variable>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <string_view>
#include <thread>

namespace sluice::bridge {

/// Whether a partner that is not trusted yet may say why it gives up: the one that was called upon
/// may, whoever knocks has to show its token first.
enum class LastWords { heard, unheard };

class Link {
public:
  /// `self` and `partner` are the roles ("fluid", "solid"); `silence_deadline` [s] bounds the time
  /// without a single byte from the partner.
  Link(std::unique_ptr<Transport> transport, std::string self, std::string partner,
       double silence_deadline);
  ~Link();
  Link(const Link &) = delete;
  Link &operator=(const Link &) = delete;

  /// Whatever trickles in, every wait ends by `deadline`, and a heartbeat is no greeting: for a
  /// connection that may be a stranger's. Until `trust`.
  void distrust(Deadline deadline, LastWords last_words) {
    greeting_deadline_ = deadline;
    hears_last_words_ = last_words == LastWords::heard;
  }
  void trust() {
    greeting_deadline_.reset();
    hears_last_words_ = true;
  }

  /// From now on a thread sends a heartbeat five times per silence deadline (once a second at
  /// least), whatever this side computes.
  void start_heartbeat();
  void stop_heartbeat();

  /// Sends one frame. Throws UserError when the partner is gone or takes nothing in.
  void send(FrameType type, PayloadWriter &&payload);
  /// Waits for a frame of type `expected` with at most `limit` bytes of payload and returns
  /// `decode(PayloadReader &)`; `awaited` completes "while the fluid awaited ...". Throws UserError
  /// for an abort, silence, the end of the stream or bytes that the protocol does not allow.
  template <class Decode>
  auto receive(FrameType expected, std::size_t limit, std::string_view awaited, Decode &&decode) {
    const Bytes payload = receive_bytes(expected, limit, awaited);
    try {
      PayloadReader reader(payload);
      auto value = decode(reader);
      reader.finish();
      return value;
    } catch (const MalformedMessage &error) {
      report_malformed(awaited, error);
    }
  }
  /// Tells the partner why this side ends; best effort, at most a fraction of a second.
  void send_abort(std::string_view message) noexcept;

  const std::string &partner() const { return partner_; }
  double wait_s() const { return wait_s_; } ///< [s] spent in receive
  std::uint64_t bytes_sent() const { return bytes_sent_; }
  std::uint64_t bytes_received() const { return bytes_received_; }

private:
  void beat(std::stop_token stop);
  void send_frame(FrameType type, PayloadWriter &payload, double patience);
  Bytes receive_bytes(FrameType expected, std::size_t limit, std::string_view awaited);
  Bytes next_frame(FrameType expected, std::size_t limit, std::string_view activity);
  FrameHeader read_header();
  Bytes read_payload(const FrameHeader &header, std::size_t limit);
  void read_all(std::span<std::byte> bytes);
  std::size_t read_some(std::span<std::byte> bytes);
  Deadline wait_until(double patience) const;
  [[noreturn]] void report_abort(std::span<const std::byte> payload,
                                 std::string_view activity) const;
  [[noreturn]] void report_malformed(std::string_view awaited, const MalformedMessage &error) const;
  [[noreturn]] void report_loss(std::string_view activity, std::string_view reason);

  std::unique_ptr<Transport> transport_;
  std::string self_, partner_;
  double silence_deadline_;
  std::optional<Deadline> greeting_deadline_;
  bool hears_last_words_ = true;
  double wait_s_ = 0;
  std::atomic<std::uint64_t> bytes_sent_ = 0; // by both threads
  std::uint64_t bytes_received_ = 0;
  std::uint64_t sent_ = 0, received_ = 0; // frames
  Bytes inbox_;                           // a header and a short payload come at one go
  std::size_t inbox_read_ = 0, inbox_end_ = 0;

  std::mutex sending_; // the heartbeat must not cut into a frame
  std::mutex resting_;
  std::condition_variable_any rest_;
  std::jthread heartbeat_;
};

} // namespace sluice::bridge
