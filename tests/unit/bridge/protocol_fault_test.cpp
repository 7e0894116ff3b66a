// SPDX-License-Identifier: MIT
// A program that is killed or stopped at any point of the conversation, before a frame or in the
// middle of one, or sends one whose header is damaged or of another version: its partner ends
// within the deadline and says what it was waiting for, and so does the program itself if it lives.
#include "bridge/base/timer.hpp"
#include "bridge/message.hpp"
#include "bridge/transport_socket.hpp"

#include "child.hpp"
#include "piston.hpp"

#include <cstring>

namespace sluice::bridge {
namespace {

constexpr double silence_deadline = 0.6; // [s]
constexpr double connect_deadline = 1.2; // [s]

/// At the frame of type `frame` that follows `before` others of that type: `happen` is called after
/// `part` of it, or `change` changes its bytes.
struct Fault {
  FrameType frame = FrameType::hello;
  int before = 0;
  double part = 0;
  std::function<void()> happen;
  std::function<void(Bytes &)> change;
};

/// Passes bytes on until the fault, a piece at a time; the frames of this small case are one piece.
class FaultyTransport final : public Transport {
public:
  FaultyTransport(std::unique_ptr<Transport> inner, Fault fault)
      : inner_(std::move(inner)), fault_(std::move(fault)) {}

  std::size_t write_some(Pieces pieces, Deadline deadline) override {
    const std::span<const std::byte> bytes = pieces.front();
    if (left_in_frame_ == 0) {
      const FrameHeader header = decode_header(bytes.first<header_size>());
      left_in_frame_ = header_size + header.length;
      if (header.type == fault_.frame && sent_++ == fault_.before) {
        if (fault_.change)
          return send_changed(bytes, deadline);
        send_all(bytes.first(static_cast<std::size_t>(fault_.part * double(bytes.size()))),
                 deadline);
        fault_.happen();
      }
    }
    const std::size_t n = inner_->write_some(bytes, deadline);
    left_in_frame_ -= n;
    return n;
  }
  std::size_t read_some(std::span<std::byte> bytes, Deadline deadline) override {
    return inner_->read_some(bytes, deadline);
  }
  bool can_write() override { return inner_->can_write(); }

private:
  void send_all(std::span<const std::byte> bytes, Deadline deadline) {
    while (!bytes.empty())
      bytes = bytes.subspan(inner_->write_some(bytes, deadline));
  }
  std::size_t send_changed(std::span<const std::byte> bytes, Deadline deadline) {
    Bytes changed(bytes.begin(), bytes.end());
    fault_.change(changed);
    send_all(changed, deadline);
    left_in_frame_ = 0;
    return bytes.size();
  }
  std::unique_ptr<Transport> inner_;
  Fault fault_;
  std::size_t left_in_frame_ = 0;
  int sent_ = 0;
};

// Connected as `role` would connect itself.
std::unique_ptr<Transport> transport_of(const std::string &role, const Address &address) {
  if (role == "fluid")
    return Listener(address, "").accept(deadline_in(5));
  std::unique_ptr<Transport> transport;
  for (const Stopwatch watch; !transport && watch.seconds() < 5;)
    transport = try_connect(address, deadline_in(1));
  return transport;
}

Piston quick_piston() {
  Piston piston;
  piston.windows = 3;
  piston.silence_deadline = silence_deadline;
  piston.connect_deadline = connect_deadline;
  return piston;
}

struct Survivor {
  std::string error;
  double seconds = 0;
  int other_status = 0; // exit status of the other program, where it was not stopped
};

Survivor survive(const std::string &self, const Fault &fault) {
  const TemporaryFolder folder;
  const Piston piston = quick_piston();
  const std::string other = self == "fluid" ? "solid" : "fluid";
  Child child([&] {
    const Address address = address_of(BridgeSettings(), folder.path());
    Participant bridge(other, piston.config(), folder.path(),
                       std::make_unique<FaultyTransport>(transport_of(other, address), fault));
    if (other == "fluid")
      run_fluid(bridge, piston);
    else
      run_solid(bridge, piston);
  });
  const Stopwatch watch;
  const std::string error = error_of([&] {
    Participant bridge(self, piston.config(), folder.path());
    if (self == "fluid")
      run_fluid(bridge, piston);
    else
      run_solid(bridge, piston);
  });
  const double seconds = watch.seconds();
  return {error, seconds, fault.change ? child.exit_status() : 0};
}

/// A frame of a side, and what its partner says it waited for.
struct State {
  std::string sender;
  FrameType frame;
  int before; // frames of this type
  std::string awaited;
  std::string name() const { return fmt::format("{}_{}_{}", sender, name_of(frame), before); }
};
void PrintTo(const State &state, std::ostream *out) { *out << state.name(); }

const std::vector<State> states{
    {"fluid", FrameType::hello, 0, "the fluid's greeting"},
    {"fluid", FrameType::case_text, 0, "the fluid's case file"},
    {"fluid", FrameType::mesh, 0, "the fluid's interface mesh"},
    {"fluid", FrameType::map_report, 0, "the fluid's map"},
    {"fluid", FrameType::forces, 0, "the forces of iteration 1 of window 1"},
    {"fluid", FrameType::forces, 1, "the forces of iteration 2 of window 1"},
    {"fluid", FrameType::goodbye, 0, "the fluid's goodbye"},
    {"solid", FrameType::hello, 0, "the solid's greeting"},
    {"solid", FrameType::case_text, 0, "the solid's case file"},
    {"solid", FrameType::mesh, 0, "the solid's interface mesh"},
    {"solid", FrameType::initial, 0, "the solid's initial displacement"},
    {"solid", FrameType::iterate, 0, "the answer to iteration 1 of window 1"},
    {"solid", FrameType::iterate, 1, "the answer to iteration 2 of window 1"},
    {"solid", FrameType::goodbye, 0, "the solid's goodbye"},
};
std::string name_of_state(const testing::TestParamInfo<State> &info) { return info.param.name(); }

class EveryState : public testing::TestWithParam<State> {
protected:
  std::string self() const { return GetParam().sender == "fluid" ? "solid" : "fluid"; }
  bool is_greeting() const { return GetParam().frame == FrameType::hello; }
  // A fluid takes one that did not greet it for a stranger and goes
  // on waiting for the solid.
  bool is_stranger() const { return GetParam().sender == "solid" && is_greeting(); }
  Fault fault(double part, std::function<void()> happen) const {
    return {GetParam().frame, GetParam().before, part, std::move(happen), {}};
  }
  Fault fault(std::function<void(Bytes &)> change) const {
    return {GetParam().frame, GetParam().before, 0, {}, std::move(change)};
  }
  // Whoever says the last word of all waits for nothing more, and its run is complete.
  int status_of_sender() const {
    return GetParam().sender == "solid" && GetParam().frame == FrameType::goodbye ? 0 : 1;
  }
};
INSTANTIATE_TEST_SUITE_P(Protocol, EveryState, testing::ValuesIn(states), name_of_state);

TEST_P(EveryState, a_partner_that_is_killed_before_or_within_the_frame_is_noticed_at_once) {
  for (const double part : {0.0, 0.1, 0.7}) { // nothing, part of the header, part of the payload
    const auto [error, seconds, status] = survive(self(), fault(part, [] { ::raise(SIGKILL); }));
    expect_message(error,
                   {"the " + GetParam().sender + " ended without a word", GetParam().awaited});
    EXPECT_LT(seconds, is_stranger() ? connect_deadline + 3 : 3) << part;
  }
}

TEST_P(EveryState, a_partner_that_stops_before_or_within_the_frame_is_given_up_at_the_deadline) {
  for (const double part : {0.0, 0.7}) {
    const auto [error, seconds, status] = survive(self(), fault(part, [] { ::raise(SIGSTOP); }));
    if (is_greeting())
      expect_message(error, {"no complete greeting came in time", GetParam().awaited});
    else
      expect_message(error,
                     {"the " + GetParam().sender + " was silent for 0.6 s", GetParam().awaited});
    EXPECT_LT(seconds, connect_deadline + silence_deadline + 3) << part;
  }
}

TEST_P(EveryState, a_damaged_header_ends_both_programs_with_an_error) {
  constexpr std::size_t length_at = 16;
  const auto [error, seconds, status] =
      survive(self(), fault([](Bytes &frame) { frame[length_at] ^= std::byte{1}; }));
  expect_message(error, {GetParam().awaited, "damaged (checksum)"});
  EXPECT_EQ(status, status_of_sender());
  EXPECT_LT(seconds, connect_deadline + 3);
}

TEST_P(EveryState, another_protocol_version_ends_both_programs_with_an_error) {
  const auto [error, seconds, status] =
      survive(self(), fault([](Bytes &frame) {
                frame[4] = std::byte{9};
                const std::uint64_t sum = checksum(std::span(frame).first(header_size - 8));
                std::memcpy(frame.data() + header_size - 8, &sum, sizeof sum);
              }));
  expect_message(error, {GetParam().awaited,
                         fmt::format("protocol version 9 there, {} here", protocol_version)});
  EXPECT_EQ(status, status_of_sender());
  EXPECT_LT(seconds, connect_deadline + 3);
}

} // namespace
} // namespace sluice::bridge
