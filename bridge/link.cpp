// SPDX-License-Identifier: MIT
#include "bridge/link.hpp"

#include "bridge/base/check.hpp"
#include "bridge/base/timer.hpp"

#include <algorithm>
#include <cstring>

namespace sluice::bridge {

namespace {

constexpr std::size_t longest_last_message = 1 << 16; // [bytes]
constexpr std::size_t chunk = 1 << 20;                // [bytes] memory grows by what has arrived
constexpr std::size_t largest_frame = 1 << 30;        // [bytes]
constexpr std::size_t inbox_size = 1 << 14;           // [bytes]

// No byte for the whole silence deadline.
class Silence : public std::runtime_error {
public:
  Silence() : std::runtime_error("silence") {}
};

} // namespace

Link::Link(std::unique_ptr<Transport> transport, std::string self, std::string partner,
           double silence_deadline)
    : transport_(std::move(transport)), self_(std::move(self)), partner_(std::move(partner)),
      silence_deadline_(silence_deadline), inbox_(inbox_size) {}

Link::~Link() { stop_heartbeat(); }

void Link::start_heartbeat() {
  heartbeat_ = std::jthread([this](std::stop_token stop) { beat(std::move(stop)); });
}

void Link::stop_heartbeat() {
  if (heartbeat_.joinable()) {
    heartbeat_.request_stop();
    heartbeat_.join();
  }
}

// A heartbeat never waits: while a frame is under way, or the partner's buffer is full, there is
// nothing to prove.
void Link::beat(std::stop_token stop) {
  const std::chrono::duration<double> period(std::min(1.0, silence_deadline_ / 5));
  std::unique_lock resting(resting_);
  while (!rest_.wait_for(resting, stop, period, [] { return false; }) && !stop.stop_requested()) {
    const std::unique_lock sending(sending_, std::try_to_lock);
    try {
      PayloadWriter nothing;
      if (sending.owns_lock() && transport_->can_write())
        send_frame(FrameType::heartbeat, nothing, silence_deadline_);
    } catch (const std::exception &) {
      return; // the main thread finds out by itself, with more to say
    }
  }
}

void Link::send_frame(FrameType type, PayloadWriter &payload, double patience) {
  std::span<const std::byte> rest = payload.frame(type, sent_);
  while (!rest.empty()) {
    const std::size_t n = transport_->write_some(rest, wait_until(patience));
    if (n == 0)
      throw Silence();
    rest = rest.subspan(n);
    bytes_sent_ += n;
  }
  ++sent_;
}

void Link::send(FrameType type, PayloadWriter &&payload) {
  const std::string activity = fmt::format("sent its {} frame", name_of(type));
  try {
    const std::lock_guard lock(sending_);
    send_frame(type, payload, silence_deadline_);
  } catch (const ConnectionLost &lost) {
    report_loss(activity, lost.what());
  } catch (const Silence &) {
    fail("bridge: the {} took in nothing for {} s while the {} {}; it is stopped or unreachable",
         partner_, silence_deadline_, self_, activity);
  }
}

void Link::send_abort(std::string_view message) noexcept {
  try {
    PayloadWriter payload;
    payload.text(message.substr(0, longest_last_message - 8));
    const std::lock_guard lock(sending_);
    send_frame(FrameType::abort, payload, 0.2);
  } catch (...) { // the partner is gone already: nobody to tell
  }
}

Bytes Link::receive_bytes(FrameType expected, std::size_t limit, std::string_view awaited) {
  const Stopwatch watch;
  const std::string activity = fmt::format("awaited {}", awaited);
  try {
    Bytes payload = next_frame(expected, limit, activity);
    wait_s_ += watch.seconds();
    return payload;
  } catch (const ConnectionLost &lost) {
    report_loss(activity, lost.what());
  } catch (const Silence &) {
    check(!greeting_deadline_, "bridge: no complete greeting came in time while the {} {}", self_,
          activity);
    fail("bridge: the {} was silent for {} s (not even a heartbeat) while the {} {}; it is stopped "
         "or unreachable (bridge.silence_deadline_s)",
         partner_, silence_deadline_, self_, activity);
  } catch (const MalformedMessage &error) {
    report_malformed(awaited, error);
  }
}

Bytes Link::next_frame(FrameType expected, std::size_t limit, std::string_view activity) {
  while (true) {
    const FrameHeader header = read_header();
    const bool is_last = header.type == FrameType::abort && hears_last_words_;
    Bytes payload = read_payload(header, is_last ? longest_last_message : limit);
    if (is_last)
      report_abort(payload, activity);
    if (header.type == expected)
      return payload;
    if (header.type != FrameType::heartbeat || greeting_deadline_)
      throw MalformedMessage(
          fmt::format("a {} frame came instead of {}", name_of(header.type), name_of(expected)));
  }
}

FrameHeader Link::read_header() {
  std::array<std::byte, header_size> bytes;
  read_all(bytes);
  const FrameHeader header = decode_header(bytes);
  if (header.sequence != received_)
    throw MalformedMessage(
        fmt::format("frame number {} came instead of {}", header.sequence, received_));
  ++received_;
  return header;
}

Bytes Link::read_payload(const FrameHeader &header, std::size_t limit) {
  if (header.length > limit)
    throw MalformedMessage(fmt::format("a {} frame announces {} bytes, at most {} are allowed",
                                       name_of(header.type), header.length, limit));
  Bytes payload;
  while (payload.size() < header.length) {
    const std::size_t have = payload.size();
    payload.resize(std::min<std::size_t>(header.length, have + chunk));
    read_all(std::span(payload).subspan(have));
  }
  check_payload(header, payload);
  return payload;
}

void Link::read_all(std::span<std::byte> bytes) {
  while (!bytes.empty()) {
    if (inbox_read_ == inbox_end_ && bytes.size() < inbox_size) {
      inbox_end_ = read_some(inbox_);
      inbox_read_ = 0;
    }
    const std::size_t waiting = std::min(inbox_end_ - inbox_read_, bytes.size());
    if (waiting > 0)
      std::memcpy(bytes.data(), inbox_.data() + inbox_read_, waiting);
    inbox_read_ += waiting;
    bytes = bytes.subspan(waiting > 0 ? waiting : read_some(bytes));
  }
}

std::size_t Link::read_some(std::span<std::byte> bytes) {
  const std::size_t n = transport_->read_some(bytes, wait_until(silence_deadline_));
  if (n == 0)
    throw Silence();
  bytes_received_ += n;
  return n;
}

Deadline Link::wait_until(double patience) const {
  const Deadline deadline = deadline_in(patience);
  return greeting_deadline_ ? std::min(deadline, *greeting_deadline_) : deadline;
}

void Link::report_abort(std::span<const std::byte> payload, std::string_view activity) const {
  PayloadReader reader(payload);
  fail("bridge: the {} gave up while the {} {}; its last message: {}", partner_, self_, activity,
       reader.text());
}

void Link::report_malformed(std::string_view awaited, const MalformedMessage &error) const {
  fail("bridge: the {} awaited {} and got something else from the {}: {}", self_, awaited, partner_,
       error.what());
}

// The stream is broken; what the partner said before it went may still lie in the buffer.
void Link::report_loss(std::string_view activity, std::string_view reason) {
  try {
    while (true) {
      const FrameHeader header = read_header();
      const Bytes payload = read_payload(header, largest_frame);
      if (header.type == FrameType::abort && hears_last_words_)
        report_abort(payload, activity);
    }
  } catch (const UserError &) {
    throw;
  } catch (const std::exception &) { // nothing more to read
  }
  fail("bridge: the {} ended without a word ({}) while the {} {}; its own output says why",
       partner_, reason, self_, activity);
}

} // namespace sluice::bridge
