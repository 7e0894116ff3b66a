// SPDX-License-Identifier: MIT
#include "bridge/link.hpp"

#include "bridge/base/check.hpp"
#include "bridge/base/timer.hpp"

#include <algorithm>
#include <cstring>

namespace sluice::bridge {

namespace {

constexpr std::size_t longest_last_message = 1 << 16; // [bytes]
constexpr std::size_t inbox_size = 1 << 12;           // [bytes]

// No byte for the whole silence deadline.
class Silence : public std::runtime_error {
public:
  Silence() : std::runtime_error("silence") {}
};

void check_length(const FrameHeader &header, std::size_t limit) {
  if (header.length > limit)
    throw MalformedMessage(fmt::format("a {} frame announces {} bytes, at most {} are allowed",
                                       name_of(header.type), header.length, limit));
}

} // namespace

std::string Awaited::text() const {
  if (window == 0)
    return std::string(what);
  return fmt::format("{} iteration {} of window {} (t = {:.6g} s)", what, iteration, window, start);
}

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
  auto frame = payload.frame(type, sent_);
  for (std::span rest(frame); !rest.empty();) {
    std::size_t n = transport_->write_some(rest, wait_until(patience));
    if (n == 0)
      throw Silence();
    bytes_sent_ += n;
    for (; !rest.empty() && n >= rest.front().size(); rest = rest.subspan(1))
      n -= rest.front().size();
    if (n > 0)
      rest.front() = rest.front().subspan(n);
  }
  ++sent_;
}

void Link::send(FrameType type, PayloadWriter &&payload) {
  const auto activity = [&] { return fmt::format("sent its {} frame", name_of(type)); };
  try {
    const std::lock_guard lock(sending_);
    send_frame(type, payload, silence_deadline_);
  } catch (const ConnectionLost &lost) {
    report_loss(activity(), lost.what());
  } catch (const Silence &) {
    fail("bridge: the {} took in nothing for {} s while the {} {}; it is stopped or unreachable",
         partner_, silence_deadline_, self_, activity());
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

void Link::receive_frame(FrameType expected, std::size_t limit, const Awaited &awaited,
                         const Decoder &decode) {
  const Stopwatch watch;
  try {
    const FrameHeader header = next_header(expected, limit, awaited);
    wait_s_ += watch.seconds();
    PayloadReader reader(*this, header.length);
    decode(reader);
    reader.finish();
  } catch (const ConnectionLost &lost) {
    report_loss("awaited " + awaited.text(), lost.what());
  } catch (const Silence &) {
    check(!greeting_deadline_, "bridge: no complete greeting came in time while the {} awaited {}",
          self_, awaited.text());
    fail("bridge: the {} was silent for {} s (not even a heartbeat) while the {} awaited {}; it is "
         "stopped or unreachable (bridge.silence_deadline_s)",
         partner_, silence_deadline_, self_, awaited.text());
  } catch (const MalformedMessage &error) {
    report_malformed(awaited.text(), error);
  }
}

// Past heartbeats to the header of a frame that may be read.
FrameHeader Link::next_header(FrameType expected, std::size_t limit, const Awaited &awaited) {
  while (true) {
    const FrameHeader header = read_header();
    if (header.type == FrameType::abort && hears_last_words_)
      report_abort(header, "awaited " + awaited.text());
    const bool is_expected = header.type == expected;
    if (!is_expected && (header.type != FrameType::heartbeat || greeting_deadline_))
      throw MalformedMessage(
          fmt::format("a {} frame came instead of {}", name_of(header.type), name_of(expected)));
    check_length(header, is_expected ? limit : 0);
    if (is_expected)
      return header;
  }
}

FrameHeader Link::read_header() {
  std::array<std::byte, header_size> bytes;
  read(bytes);
  const FrameHeader header = decode_header(bytes);
  if (header.sequence != received_)
    throw MalformedMessage(
        fmt::format("frame number {} came instead of {}", header.sequence, received_));
  ++received_;
  return header;
}

// A long run of bytes goes past the inbox to where it belongs.
void Link::read(std::span<std::byte> into) {
  while (!into.empty()) {
    if (inbox_read_ == inbox_end_ && into.size() >= inbox_size) {
      into = into.subspan(read_some(into));
      continue;
    }
    if (inbox_read_ == inbox_end_) {
      inbox_read_ = inbox_end_ = 0;
      inbox_end_ = read_some(inbox_);
    }
    const std::size_t n = std::min(inbox_end_ - inbox_read_, into.size());
    std::memcpy(into.data(), inbox_.data() + inbox_read_, n);
    inbox_read_ += n;
    into = into.subspan(n);
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

void Link::report_abort(const FrameHeader &header, std::string_view activity) {
  check_length(header, longest_last_message);
  PayloadReader read(*this, header.length);
  fail("bridge: the {} gave up while the {} {}; its last message: {}", partner_, self_, activity,
       read.text());
}

void Link::report_malformed(std::string_view awaited, const MalformedMessage &error) const {
  fail("bridge: the {} awaited {} and got something else from the {}: {}", self_, awaited, partner_,
       error.what());
}

// The stream is broken; what the partner said before it went may still lie in the buffer, behind
// frames that nobody awaits any more.
void Link::report_loss(std::string_view activity, std::string_view reason) {
  try {
    while (true) {
      const FrameHeader header = read_header();
      if (header.type == FrameType::abort && hears_last_words_)
        report_abort(header, activity);
      for (std::uint64_t left = header.length; left > 0;) {
        std::array<std::byte, inbox_size> unread;
        const auto n = std::min<std::uint64_t>(left, unread.size());
        read(std::span(unread).first(n));
        left -= n;
      }
    }
  } catch (const UserError &) {
    throw;
  } catch (const std::exception &) { // nothing more to read
  }
  fail("bridge: the {} ended without a word ({}) while the {} {}; its own output says why",
       partner_, reason, self_, activity);
}

} // namespace sluice::bridge
