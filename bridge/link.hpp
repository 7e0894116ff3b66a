// SPDX-License-Identifier: MIT
// Frames to and from one named partner over a transport: heartbeats while this side computes, a
// deadline on every wait, and errors that say who, what was awaited, and the partner's last words.
#pragma once

#include "bridge/message.hpp"
#include "bridge/transport.hpp"

#include <atomic>
#include <condition_variable>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <string_view>
#include <thread>
#include <type_traits>

namespace sluice::bridge {

/// What a wait is for, put into words only when it fails: "the fluid's greeting", or "the forces of
/// iteration 2 of window 7 (t = 0.0012 s)".
struct Awaited {
  Awaited(std::string_view thing) : what(thing) {}
  Awaited(const std::string &thing) : what(thing) {}
  Awaited(const char *thing) : what(thing) {}
  Awaited(std::string_view thing, int of_iteration, long of_window, double at)
      : what(thing), iteration(of_iteration), window(of_window), start(at) {}
  std::string text() const;

  std::string_view what;
  int iteration = 0;
  long window = 0;  // 0: before the first
  double start = 0; // [s] of the window
};

/// Whether a partner that is not trusted yet may say why it gives up: the one that was called upon
/// may, whoever knocks has to show its token first.
enum class LastWords { heard, unheard };

class Link : private ByteSource {
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
  /// `decode(PayloadReader &)`, which reads while the bytes arrive; `awaited` completes "while the
  /// fluid awaited ...". Throws UserError for an abort, silence, the end of the stream or bytes
  /// that the protocol does not allow; what `decode` has filled by then is worth nothing.
  template <class Decode>
  auto receive(FrameType expected, std::size_t limit, const Awaited &awaited, Decode &&decode) {
    std::optional<std::invoke_result_t<Decode, PayloadReader &>> value;
    receive_frame(expected, limit, awaited, [&](PayloadReader &read) { value = decode(read); });
    return *std::move(value);
  }
  /// Tells the partner why this side ends; best effort, at most a fraction of a second.
  void send_abort(std::string_view message) noexcept;

  const std::string &partner() const { return partner_; }
  double wait_s() const { return wait_s_; } ///< [s] until the frames came that were awaited
  std::uint64_t bytes_sent() const { return bytes_sent_; }
  std::uint64_t bytes_received() const { return bytes_received_; }

private:
  void beat(std::stop_token stop);
  using Decoder = std::function<void(PayloadReader &)>;
  void send_frame(FrameType type, PayloadWriter &payload, double patience);
  void receive_frame(FrameType expected, std::size_t limit, const Awaited &awaited,
                     const Decoder &decode);
  FrameHeader next_header(FrameType expected, std::size_t limit, const Awaited &awaited);
  FrameHeader read_header();
  void read(std::span<std::byte> into) override;
  std::size_t read_some(std::span<std::byte> bytes);
  Deadline wait_until(double patience) const;
  [[noreturn]] void report_abort(const FrameHeader &header, std::string_view activity);
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
