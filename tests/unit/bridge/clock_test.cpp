// SPDX-License-Identifier: MIT
#include "bridge/state_archive.hpp"
#include "bridge/window_clock.hpp"
#include "piston.hpp"

namespace sluice::bridge {
namespace {

CaseSettings times(double end, double step) {
  CaseSettings settings;
  settings.end_time = end;
  settings.time_step = step;
  return settings;
}

TEST(WindowClock, many_windows_end_exactly_at_the_end) {
  WindowClock clock(times(0.4, 2e-4));
  int n = 0;
  for (; !clock.is_over(); ++n) {
    EXPECT_EQ(clock.window_length(), 2e-4);
    EXPECT_TRUE(clock.step(clock.left()));
    clock.next_window();
  }
  EXPECT_EQ(n, 2000);
  EXPECT_EQ(clock.time(), 0.4);
}

TEST(WindowClock, the_last_window_is_what_is_left) {
  WindowClock clock(times(1.0, 0.3));
  std::vector<double> lengths;
  for (; !clock.is_over(); clock.next_window())
    lengths.push_back(clock.window_length());
  ASSERT_EQ(lengths.size(), 4u);
  EXPECT_EQ(lengths[2], 0.3);
  EXPECT_NEAR(lengths[3], 0.1, 1e-15);
}

/// `clock` as a restart file keeps it, in a run with another end.
WindowClock saved_and_restored(WindowClock clock, const CaseSettings &settings, int halvings) {
  StateWriter writer;
  writer(clock);
  WindowClock restored(settings, halvings);
  const auto bytes = writer.bytes();
  StateReader reader(bytes);
  reader(restored);
  return restored;
}

// At the end of the cut window, and in the middle of it where it was halved.
TEST(WindowClock, a_later_end_goes_on_from_where_a_cut_window_has_ended) {
  for (const bool is_halved : {false, true}) {
    WindowClock clock(times(1.1, 0.5), 2);
    clock.next_window();
    clock.next_window();
    if (is_halved)
      clock.halve();
    clock.next_window();
    const double reached = is_halved ? 1.05 : 1.1;
    EXPECT_NEAR(clock.time(), reached, 1e-15);
    clock = saved_and_restored(clock, times(3.0, 0.5), 2);
    EXPECT_NEAR(clock.time(), reached, 1e-15);
    EXPECT_EQ(clock.window(), 4);
    for (double time = reached; !clock.is_over(); clock.next_window()) {
      EXPECT_NEAR(clock.time(), time, 1e-14);
      EXPECT_GT(clock.window_length(), 0);
      time += clock.window_length();
    }
    EXPECT_EQ(clock.time(), 3.0);
  }
}

TEST(WindowClock, starts_where_a_run_has_ended_whose_last_window_was_cut_or_was_not) {
  for (const double start : {1.0, 1.1}) {
    WindowClock clock(times(3.0, 0.5));
    clock.start_at(start);
    EXPECT_EQ(clock.time(), start);
    EXPECT_EQ(clock.window_length(), 0.5);
    while (!clock.is_over())
      clock.next_window();
    EXPECT_EQ(clock.time(), 3.0);
  }
}

// Nothing was cut, or the end is the same: not a bit of the clock may change.
TEST(WindowClock, a_clock_that_is_restored_ticks_on_as_if_it_had_not_been) {
  for (const double end : {1.5, 1.1}) {
    WindowClock clock(times(end, 0.1), 3), whole(times(1.1, 0.1), 3);
    for (WindowClock *one : {&clock, &whole}) {
      for (int k = 0; k < 4; ++k)
        one->next_window();
      one->halve();
      one->next_window();
    }
    clock = saved_and_restored(clock, times(1.1, 0.1), 3);
    for (; !whole.is_over(); whole.next_window(), clock.next_window()) {
      EXPECT_EQ(clock.start(), whole.start());
      EXPECT_EQ(clock.window_length(), whole.window_length());
    }
    EXPECT_TRUE(clock.is_over());
  }
}

TEST(CaseSettings, a_number_of_windows_that_cannot_be_counted_is_refused_with_the_numbers) {
  const auto error = [](const char *end, const char *step) {
    const auto text = fmt::format("[case]\nend_time_s = {}\ntime_step_s = {}\n", end, step);
    return error_of([&] { Config::parse(text, "c.toml").read<CaseSettings>("case"); });
  };
  EXPECT_EQ(error("1", "1e-9"), "");
  EXPECT_EQ(error("1e-3", "1"), "");
  EXPECT_TRUE(contains(error("1e-7", "1"), "makes 0 windows until end_time_s = 1e-07"))
      << error("1e-7", "1");
  EXPECT_TRUE(contains(error("1e300", "1e-3"), "makes 1e+303 windows")) << error("1e300", "1e-3");
  EXPECT_TRUE(contains(error("1e300", "1e-300"), "makes inf windows")) << error("1e300", "1e-300");
}

TEST(WindowClock, sub_steps_add_up_to_the_window) {
  WindowClock clock(times(1.0, 0.1));
  for (int k = 0; k < 6; ++k)
    EXPECT_FALSE(clock.step(0.1 / 7));
  EXPECT_NEAR(clock.left(), 0.1 / 7, 1e-16);
  EXPECT_TRUE(clock.step(0.1 / 7));
}

// Doubles that are summed would lose or gain a step here within some thousand windows.
TEST(WindowClock,
     a_million_windows_of_an_irrational_step_ratio_lose_no_step_and_make_no_empty_one) {
  const double step = 1 / (1e3 * std::sqrt(2.0)), own_step = step / std::sqrt(5.0);
  WindowClock clock(times(1e6 * step + 0.3 * step, step));
  long windows = 0, steps = 0;
  double shortest = step;
  while (!clock.is_over()) {
    ++windows;
    bool is_complete = false;
    while (!is_complete) {
      const double dt = std::min(own_step, clock.left());
      shortest = std::min(shortest, dt);
      is_complete = clock.step(dt);
      ++steps;
    }
    clock.next_window();
  }
  EXPECT_EQ(windows, 1'000'001);
  EXPECT_EQ(steps, 3 * 1'000'000 + 1); // sqrt(5) own steps in a window, 0.67 in the last
  EXPECT_GE(shortest, (1 - 2 / std::sqrt(5.0)) * step * (1 - 1e-9));
  EXPECT_EQ(clock.time(), 1e6 * step + 0.3 * step);
}

TEST(WindowClock, a_halved_window_grows_again_where_a_whole_one_would_start) {
  WindowClock clock(times(1.0, 0.25), 2, 2);
  clock.next_window();
  EXPECT_TRUE(clock.can_halve());
  EXPECT_EQ(clock.halved_length(), 0.125);
  clock.halve();
  clock.halve();
  EXPECT_FALSE(clock.can_halve());
  std::vector<double> lengths, starts;
  for (; !clock.is_over(); clock.next_window()) {
    starts.push_back(clock.start());
    lengths.push_back(clock.window_length());
    if (!clock.is_last()) {
      WindowClock next = clock;
      next.next_window();
      EXPECT_EQ(clock.next_window_length(), next.window_length());
    }
  }
  EXPECT_EQ(lengths, (std::vector<double>{0.0625, 0.0625, 0.125, 0.125, 0.125, 0.25}));
  EXPECT_EQ(starts, (std::vector<double>{0.25, 0.3125, 0.375, 0.5, 0.625, 0.75}));
  EXPECT_EQ(clock.time(), 1.0);
}

TEST(WindowClock, the_short_last_window_is_halved_too) {
  WindowClock clock(times(1.1, 0.5), 1);
  clock.next_window();
  clock.next_window();
  EXPECT_NEAR(clock.window_length(), 0.1, 1e-15);
  clock.halve();
  EXPECT_FALSE(clock.is_last());
  EXPECT_NEAR(clock.window_length(), 0.05, 1e-15);
  clock.next_window();
  EXPECT_TRUE(clock.is_last());
  EXPECT_NEAR(clock.start(), 1.05, 1e-15);
  clock.next_window();
  EXPECT_EQ(clock.time(), 1.1);
}

// A solid that takes two steps in a window sees the force at each and exchanges once.
TEST(Participant, sub_steps_read_linearly_in_time_and_exchange_at_the_end_of_the_window) {
  const TemporaryFolder folder;
  Piston piston;
  piston.windows = 4;
  piston.bridge_keys = "scheme = \"serial-explicit\"\n";
  auto ends = local_transports();
  std::thread fluid([&] {
    Participant bridge("fluid", piston.config(), folder.path(), std::move(ends.first));
    bridge.set_mesh(solid_line());
    bridge.initialize();
    for (int window = 1; window <= 4; ++window) {
      bridge.write_data("force", std::vector<double>(8, 10.0 * window));
      bridge.advance(bridge.max_time_step_size());
    }
    bridge.finalize();
  });
  Participant bridge("solid", piston.config(), folder.path(), std::move(ends.second));
  bridge.set_mesh(solid_line());
  bridge.initialize();
  std::vector<double> force(8);
  for (int step = 0; step < 8; ++step) {
    const double half = piston.time_step / 2;
    bridge.read_data("force", half, force);
    EXPECT_NEAR(force[0], 5.0 * (step + 1), 1e-12) << step;
    EXPECT_NEAR(bridge.time(), step * half, 1e-15);
    bridge.advance(half);
    EXPECT_EQ(bridge.is_time_window_complete(), step % 2 == 1);
  }
  EXPECT_FALSE(bridge.is_coupling_ongoing());
  bridge.finalize();
  fluid.join();
}

TEST(Participant, an_accepted_window_is_complete_though_the_partner_ends_in_the_next) {
  const TemporaryFolder folder;
  Piston piston;
  piston.bridge_keys = "scheme = \"serial-explicit\"\n";
  auto ends = local_transports();
  std::thread fluid([&] {
    Participant bridge("fluid", piston.config(), folder.path(), std::move(ends.first));
    bridge.set_mesh(solid_line());
    bridge.initialize();
    bridge.advance(bridge.max_time_step_size());
    bridge.abort("out of points");
  });
  Participant bridge("solid", piston.config(), folder.path(), std::move(ends.second));
  bridge.set_mesh(solid_line());
  bridge.initialize();
  EXPECT_EQ(error_of([&] { bridge.advance(bridge.max_time_step_size()); }), "");
  EXPECT_TRUE(bridge.is_time_window_complete());
  EXPECT_EQ(bridge.time(), piston.time_step);
  std::vector<double> force(8);
  const auto error = error_of([&] { bridge.read_data("force", 0, force); });
  EXPECT_TRUE(contains(error, "iteration 1 of window 2")) << error;
  EXPECT_TRUE(contains(error, "out of points")) << error;
  fluid.join();
}

} // namespace
} // namespace sluice::bridge
