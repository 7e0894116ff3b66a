// SPDX-License-Identifier: MIT
// Everything that can go wrong between two programs: each ends within its deadline, on both sides,
// with a message that says what and where.
#include "bridge/base/csv.hpp"
#include "bridge/message.hpp"
#include "bridge/transport_socket.hpp"
#include "child.hpp"
#include "piston.hpp"

#include "bridge/base/timer.hpp"

namespace sluice::bridge {
namespace {

// Called by the other program at the end of its first iteration in window 5.
Event in_window_five(std::function<void(std::vector<double> &)> action) {
  return [action](Participant &bridge, std::vector<double> &values) {
    if (bridge.time_window() == 5 && bridge.iteration() == 1)
      action(values);
  };
}

struct Survivor {
  std::string error;
  double seconds = 0;
};

// The other program runs in a process of its own and meets `event`; this one survives.
Survivor survive(const std::string &self, const Piston &piston, const Event &event) {
  const TemporaryFolder folder;
  const Child other([&] {
    Participant bridge(self == "fluid" ? "solid" : "fluid", piston.config(), folder.path());
    if (self == "fluid")
      run_solid(bridge, piston, event);
    else
      run_fluid(bridge, piston, event);
  });
  const Stopwatch watch;
  const std::string error = error_of([&] {
    Participant bridge(self, piston.config(), folder.path());
    if (self == "fluid")
      run_fluid(bridge, piston);
    else
      run_solid(bridge, piston);
  });
  return {error, watch.seconds()};
}

class EitherSide : public testing::TestWithParam<std::string> {
protected:
  std::string self() const { return GetParam(); }
  std::string other() const { return self() == "fluid" ? "solid" : "fluid"; }
};
INSTANTIATE_TEST_SUITE_P(Survivor, EitherSide, testing::Values("fluid", "solid"));

TEST_P(EitherSide, a_partner_that_never_starts_is_named_with_the_address) {
  const TemporaryFolder folder;
  Piston piston;
  piston.connect_deadline = 0.2;
  const Stopwatch watch;
  const auto error = error_of([&] {
    Participant bridge(self(), piston.config(), folder.path());
    bridge.set_mesh(solid_line());
    bridge.initialize();
  });
  expect_message(error, {"the " + self() + " waited 0.2 s for the " + other(),
                         folder.path().string() + "/bridge.sock", "connect_deadline_s"});
  EXPECT_LT(watch.seconds(), 2);
}

TEST_P(EitherSide, a_partner_that_dies_without_a_word_is_noticed_at_once) {
  for (const char *transport : {"unix", "tcp", "shared"}) {
    Piston piston;
    piston.bridge_keys = fmt::format("transport = \"{}\"\n", transport);
    const auto [error, seconds] =
        survive(self(), piston, in_window_five([](auto &) { ::_exit(3); }));
    expect_message(error, {"the " + other() + " ended without a word", "the " + self() + " awaited",
                           "iteration 1 of window 5", "t = 0.004"});
    EXPECT_LT(seconds, 3) << transport;
  }
}

TEST_P(EitherSide, a_partner_that_stops_breathing_is_given_up_after_the_silence_deadline) {
  for (const char *transport : {"unix", "shared"}) {
    Piston piston;
    piston.silence_deadline = 0.8;
    piston.bridge_keys = fmt::format("transport = \"{}\"\n", transport);
    const auto [error, seconds] =
        survive(self(), piston, in_window_five([](auto &) { ::raise(SIGSTOP); }));
    expect_message(error, {"the " + other() + " was silent for 0.8 s", "awaited", "window 5"});
    EXPECT_LT(seconds, 3) << transport;
  }
}

TEST_P(EitherSide, a_long_step_is_not_a_dead_partner) {
  Piston piston;
  piston.silence_deadline = 0.6;
  piston.windows = 6;
  const auto [error, seconds] =
      survive(self(), piston, in_window_five([](auto &) { ::usleep(1'500'000); }));
  EXPECT_EQ(error, "");
  EXPECT_GT(seconds, 1.5);
}

TEST_P(EitherSide, an_exception_reaches_the_partner_word_for_word) {
  const TemporaryFolder folder;
  const auto fail_in_five =
      in_window_five([](auto &) { throw UserError("element 17 is inside out at the clamp"); });
  const bool fluid_survives = self() == "fluid";
  const Outcome outcome =
      run_both(Piston(), folder.path(), false, fluid_survives ? Event() : fail_in_five,
               fluid_survives ? fail_in_five : Event());
  const auto &here = fluid_survives ? outcome.fluid_error : outcome.solid_error;
  const auto &there = fluid_survives ? outcome.solid_error : outcome.fluid_error;
  EXPECT_EQ(there, "element 17 is inside out at the clamp");
  expect_message(here, {"the " + other() + " gave up", "awaited", "window 5",
                        "its last message: element 17 is inside out at the clamp"});
}

TEST_P(EitherSide, a_program_that_unwinds_without_telling_still_says_that_it_ended) {
  const auto [error, seconds] =
      survive(self(), Piston(), in_window_five([](auto &) { throw std::runtime_error("?"); }));
  expect_message(error, {"the " + other() + " gave up", "ended before the run was complete"});
  EXPECT_LT(seconds, 3);
}

TEST_P(EitherSide, values_that_are_not_finite_stop_at_the_border_with_node_and_value) {
  const TemporaryFolder folder;
  const auto spoil = in_window_five([](auto &values) { values[3] = std::nan(""); });
  const bool fluid_spoils = self() == "fluid";
  const Outcome outcome = run_both(Piston(), folder.path(), false, fluid_spoils ? spoil : Event(),
                                   fluid_spoils ? Event() : spoil);
  for (const auto &error : {outcome.fluid_error, outcome.solid_error})
    expect_message(error, {fluid_spoils ? "the fluid's force at t = 0.004 s is not finite"
                                        : "the solid's displacement at t = 0.004 s is not finite",
                           "nan at node 1"});
}

TEST(Failure, another_case_file_is_refused_with_the_first_line_that_differs) {
  const TemporaryFolder folder;
  Piston other;
  other.windows = 50;
  std::string fluid_error;
  std::thread fluid([&] {
    fluid_error = error_of([&] {
      Participant bridge("fluid", Piston().config(), folder.path());
      run_fluid(bridge, Piston());
    });
  });
  const auto solid_error = error_of([&] {
    Participant bridge("solid", other.config(), folder.path());
    run_solid(bridge, other);
  });
  fluid.join();
  expect_message(fluid_error, {"different case files", "the fluid has 'case.end_time_s = 0.1",
                               "the solid has 'case.end_time_s = 0.05"});
  expect_message(solid_error, {"different case files", "the solid has 'case.end_time_s = 0.05",
                               "the fluid has 'case.end_time_s = 0.1"});
}

TEST(Failure, a_wrong_token_is_turned_away_and_both_sides_say_so) {
  const TemporaryFolder folder;
  Piston right, wrong;
  right.connect_deadline = 0.5;
  right.bridge_keys = "token = \"sesame\"\n";
  wrong.bridge_keys = "token = \"barley\"\n";
  std::string fluid_error;
  std::thread fluid([&] {
    fluid_error = error_of([&] {
      Participant bridge("fluid", right.config(), folder.path());
      run_fluid(bridge, right);
    });
  });
  const auto solid_error = error_of([&] {
    Participant bridge("solid", wrong.config(), folder.path());
    run_solid(bridge, wrong);
  });
  fluid.join();
  expect_message(solid_error, {"the solid showed a wrong token", "bridge.token"});
  expect_message(fluid_error, {"waited 0.5 s", "turned away", "showed a wrong token"});
  EXPECT_FALSE(contains(solid_error + fluid_error, "sesame")) << "a secret in a message";
}

TEST(Failure, a_window_that_does_not_converge_ends_both_programs_with_the_numbers) {
  const TemporaryFolder folder;
  Piston piston;
  piston.bridge_keys =
      "acceleration = \"constant\"\ninitial_relaxation = 0.5\nmax_iterations = 12\n";
  const Outcome outcome = run_both(piston, folder.path(), false);
  expect_message(outcome.fluid_error,
                 {"window 1 (t = 0 to 0.001 s) did not converge in 12", "displacement residual",
                  "tolerance 0.0001", "force change", "tolerance 0.001"});
  EXPECT_EQ(outcome.fluid_error, outcome.solid_error);
  EXPECT_TRUE(outcome.history.empty());
}

TEST(Failure, interfaces_that_do_not_fit_end_both_programs) {
  const TemporaryFolder folder;
  std::string fluid_error;
  std::thread fluid([&] {
    fluid_error = error_of([&] {
      Participant bridge("fluid", Piston().config(), folder.path());
      bridge.set_mesh(polyline({{0.2, 0}, {0.2, 1}}));
      bridge.initialize();
    });
  });
  const auto solid_error = error_of([&] {
    Participant bridge("solid", Piston().config(), folder.path());
    run_solid(bridge, Piston());
  });
  fluid.join();
  expect_message(fluid_error, {"fluid node 0 at (0.2, 0, 0)", "0.2 m from the solid's surface"});
  expect_message(solid_error, {"the fluid gave up", "fluid node 0 at (0.2, 0, 0)"});
}

// Connects as soon as somebody listens; nothing after two seconds.
std::unique_ptr<Transport> knock(const Address &address) {
  std::unique_ptr<Transport> transport;
  for (const Stopwatch watch; !transport && watch.seconds() < 2;)
    transport = try_connect(address, deadline_in(1));
  return transport;
}

// What the fluid says when a stranger keeps sending `bytes` instead of a greeting.
Survivor meet_stranger(const Bytes &bytes) {
  const TemporaryFolder folder;
  Piston piston;
  piston.connect_deadline = 0.5;
  std::jthread stranger([&](const std::stop_token &stop) {
    const auto transport = knock(address_of(BridgeSettings(), folder.path()));
    try {
      for (std::size_t k = 0; transport && !stop.stop_requested(); ++k) {
        transport->write_some(std::span(bytes).subspan(k % bytes.size(), 1), deadline_in(1));
        if (k % bytes.size() == bytes.size() - 1)
          std::this_thread::sleep_for(std::chrono::milliseconds(100));
      }
    } catch (const ConnectionLost &) { // turned away
    }
  });
  const Stopwatch watch;
  const auto error = error_of([&] {
    Participant bridge("fluid", piston.config(), folder.path());
    run_fluid(bridge, piston);
  });
  return {error, watch.seconds()};
}

TEST(Failure, a_stranger_that_trickles_bytes_does_not_renew_the_deadline) {
  const auto [error, seconds] = meet_stranger({std::byte{'S'}});
  expect_message(error, {"the fluid waited 0.5 s", "connect_deadline_s"});
  EXPECT_LT(seconds, 3);
}

TEST(Failure, a_heartbeat_is_no_greeting) {
  const auto [error, seconds] = meet_stranger(encode_frame(FrameType::heartbeat, 0, {}));
  expect_message(error, {"the fluid waited 0.5 s", "a heartbeat frame came instead of hello"});
  EXPECT_LT(seconds, 3);
}

TEST(Failure, the_token_is_checked_before_the_rest_of_the_greeting_is_read) {
  PayloadWriter greeting;
  greeting.text("guessed").number(1000); // no text of 1000 characters follows
  const auto [error, seconds] = meet_stranger(encode_frame(FrameType::hello, 0, greeting.bytes()));
  expect_message(error, {"the fluid waited 0.5 s", "showed a wrong token"});
  EXPECT_LT(seconds, 3);
}

TEST(Failure, a_stranger_has_no_last_words) {
  PayloadWriter words;
  words.text("believe me");
  const auto [error, seconds] = meet_stranger(encode_frame(FrameType::abort, 0, words.bytes()));
  expect_message(error, {"the fluid waited 0.5 s", "abort frame came instead of hello"});
  EXPECT_FALSE(contains(error, "believe me"));
  EXPECT_LT(seconds, 3);
}

TEST(Failure, a_solid_that_meets_nobody_leaves_the_log_of_an_earlier_run) {
  const TemporaryFolder folder;
  CsvWriter(folder.path() / "coupling.csv", "of an earlier run");
  Piston piston;
  piston.connect_deadline = 0.1;
  error_of([&] {
    Participant bridge("solid", piston.config(), folder.path());
    run_solid(bridge, piston);
  });
  std::ifstream log(folder.path() / "coupling.csv");
  std::string header;
  std::getline(log, header);
  EXPECT_EQ(header, "of an earlier run");
}

TEST(Failure, strangers_at_the_door_do_not_disturb_the_run) {
  const TemporaryFolder folder;
  Piston piston;
  piston.windows = 3;
  const Address address = address_of(BridgeSettings(), folder.path());
  int came = 0;
  std::thread strangers([&] {
    for (; came < 3; ++came) {
      const auto transport = knock(address);
      if (!transport)
        return;
      const Bytes garbage(static_cast<std::size_t>(100 * came), std::byte{0x2a});
      if (!garbage.empty())
        transport->write_some(garbage, deadline_in(1));
    }
  });
  std::string fluid_error;
  std::thread fluid([&] {
    fluid_error = error_of([&] {
      Participant bridge("fluid", piston.config(), folder.path());
      run_fluid(bridge, piston);
    });
  });
  strangers.join();
  EXPECT_EQ(came, 3) << "nobody was there to be disturbed";
  const auto solid_error = error_of([&] {
    Participant bridge("solid", piston.config(), folder.path());
    EXPECT_EQ(run_solid(bridge, piston).size(), 3u);
  });
  fluid.join();
  EXPECT_EQ(fluid_error, "");
  EXPECT_EQ(solid_error, "");
}

// ---- addresses ----------------------------------------------------------------------------------

BridgeSettings settings_with(const std::string &transport, const std::string &address) {
  BridgeSettings settings;
  settings.transport = transport;
  settings.address = address;
  return settings;
}

TEST(Address, a_long_output_folder_still_gives_a_valid_path_and_the_same_on_both_sides) {
  const std::filesystem::path folder = "/tmp/" + std::string(150, 'x');
  const auto a = address_of(BridgeSettings(), folder),
             b = address_of(BridgeSettings(), folder / "");
  EXPECT_LE(a.path.size(), 107u);
  EXPECT_EQ(a.path, b.path);
  EXPECT_EQ(a.path, address_of(BridgeSettings(), folder / "y/..").path);
  EXPECT_NE(a.path, address_of(BridgeSettings(), folder / "y").path);
  const auto error =
      error_of([&] { address_of(settings_with("unix", std::string(200, 'x')), "."); });
  expect_message(error, {"200 characters", "107"});
}

TEST(Address, a_malformed_tcp_address_is_refused) {
  for (const auto *text : {"localhost", ":200", "127.0.0.1:"})
    expect_message(error_of([&] { address_of(settings_with("tcp", text), "."); }),
                   {text, "expected host:port"});
  for (const auto *text : {"127.0.0.1:65536", "127.0.0.1:0", "127.0.0.1:4294987796"})
    expect_message(error_of([&] { address_of(settings_with("tcp", text), "."); }),
                   {text, "between 1 and 65535"});
  EXPECT_EQ(address_of(settings_with("tcp", "[::1]:20500"), ".").host, "::1");
}

TEST(Listener, refuses_an_address_that_others_can_reach_without_a_token) {
  const Address address{Address::Family::tcp, "", "0.0.0.0", "20599"};
  expect_message(error_of([&] { Listener(address, ""); }), {"0.0.0.0:20599", "bridge.token"});
}

TEST(Listener, is_found_under_a_name_with_several_addresses) {
  const Address address{Address::Family::tcp, "", "localhost", "20598"};
  const Listener listener(address, "");
  EXPECT_NE(try_connect(address, deadline_in(1)), nullptr);
}

TEST(Listener, a_second_run_at_the_same_address_is_refused_and_the_first_lives_on) {
  const TemporaryFolder folder;
  const Address address{Address::Family::unix_domain, folder.path() / "a.sock", "", ""};
  Listener first(address, "");
  expect_message(error_of([&] { Listener(address, ""); }), {"another run listens there"});
  first.accept(deadline_in(0.1)); // the probe
  const auto client = try_connect(address, deadline_in(1));
  EXPECT_NE(client, nullptr);
  EXPECT_NE(first.accept(deadline_in(1)), nullptr);
}

TEST(Listener, removes_the_leftover_of_a_killed_run_but_no_other_file) {
  const TemporaryFolder folder;
  const Address address{Address::Family::unix_domain, folder.path() / "a.sock", "", ""};
  leave_stale_socket(address.path);
  EXPECT_EQ(try_connect(address, deadline_in(1)), nullptr) << "a stale file is worth a retry";
  EXPECT_EQ(error_of([&] { Listener(address, ""); }), "");
  CsvWriter(address.path, "a file of the user");
  expect_message(error_of([&] { Listener(address, ""); }), {"no socket is in the way"});
  EXPECT_TRUE(std::filesystem::exists(address.path));
}

// ---- misuse by an adapter -----------------------------------------------------------------------

TEST(Misuse, is_answered_with_what_was_expected) {
  const TemporaryFolder folder;
  expect_message(error_of([&] { Participant("flud", Piston().config(), folder.path()); }),
                 {"fluid or solid, not 'flud'"});
  Participant bridge("fluid", Piston().config(), folder.path());
  expect_message(error_of([&] { bridge.initialize(); }), {"set_mesh before initialize"});
  bridge.set_mesh(fluid_line());
  std::vector<double> values(16), few(3);
  expect_message(error_of([&] { bridge.write_data("displacement", values); }),
                 {"the fluid writes force, not 'displacement'"});
  expect_message(error_of([&] { bridge.write_data("force", few); }),
                 {"force needs 16 values (8 nodes with 2 components), 3 were given"});
  expect_message(error_of([&] { bridge.read_data("velocity", 0, values); }),
                 {"follows initialize"});
  expect_message(error_of([&] { bridge.advance(1e-3); }), {"outside the coupled run"});
}

TEST(Misuse, a_step_or_a_reading_time_beyond_the_window_is_refused) {
  const TemporaryFolder folder;
  const Outcome outcome =
      run_both(Piston(), folder.path(), true, [](Participant &bridge, std::vector<double> &values) {
        std::vector<double> read(values.size());
        EXPECT_TRUE(contains(error_of([&] { bridge.read_data("velocity", 2e-3, read); }),
                             "outside the window of 0.001 s"));
        bridge.advance(2e-3);
      });
  expect_message(outcome.solid_error, {"the fluid gave up", "outside the window"});
}

// ---- shared memory ------------------------------------------------------------------------------

TEST(SharedMemory, carries_more_than_its_ring_holds_in_order_and_leaves_no_file) {
  const TemporaryFolder folder;
  const Address address{Address::Family::shared_memory, folder.path() / "s.sock", "", ""};
  Bytes sent(9'000'000);
  for (std::size_t k = 0; k < sent.size(); ++k)
    sent[k] = static_cast<std::byte>((k * k + k / 251) % 256);
  {
    Listener listener(address, "");
    std::thread writer([&] {
      const auto there = try_connect(address, deadline_in(5));
      for (std::span<const std::byte> rest(sent); !rest.empty();)
        rest = rest.subspan(there->write_some(rest, deadline_in(5)));
    });
    const auto here = listener.accept(deadline_in(5));
    ASSERT_NE(here, nullptr);
    Bytes received(sent.size());
    for (std::span<std::byte> rest(received); !rest.empty();)
      rest = rest.subspan(here->read_some(rest, deadline_in(5)));
    writer.join();
    EXPECT_TRUE(received == sent);
    std::byte more;
    EXPECT_THROW(here->read_some(std::span(&more, 1), deadline_in(5)), ConnectionLost);
  }
  EXPECT_TRUE(std::filesystem::is_empty(folder.path()));
}

TEST(SharedMemory, a_wait_ends_at_its_deadline) {
  const TemporaryFolder folder;
  const Address address{Address::Family::shared_memory, folder.path() / "s.sock", "", ""};
  Listener listener(address, "");
  std::unique_ptr<Transport> there;
  std::thread connector([&] { there = try_connect(address, deadline_in(5)); });
  const auto here = listener.accept(deadline_in(5));
  connector.join();
  ASSERT_TRUE(here && there);
  std::byte byte{};
  const Stopwatch watch;
  EXPECT_EQ(here->read_some(std::span(&byte, 1), deadline_in(0.2)), 0u);
  EXPECT_GE(watch.seconds(), 0.2);
  EXPECT_LT(watch.seconds(), 2);
}

} // namespace
} // namespace sluice::bridge
