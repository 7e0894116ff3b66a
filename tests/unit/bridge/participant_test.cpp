// SPDX-License-Identifier: MIT
// Two participants in two threads, coupled from the first window to the last.
#include "bridge/balance_log.hpp"
#include "bridge/run_summary.hpp"
#include "bridge/transport_local.hpp"
#include "piston.hpp"
#include "tests/support/allocation_counter.hpp"

#include <nlohmann/json.hpp>

#include <fstream>

namespace sluice::bridge {
namespace {

void expect_closed_form(const Piston &piston, const Outcome &outcome, double tolerance) {
  ASSERT_EQ(outcome.fluid_error + outcome.solid_error, "");
  ASSERT_EQ(outcome.history.size(), static_cast<std::size_t>(piston.windows));
  for (int k = 0; k < piston.windows; ++k)
    EXPECT_NEAR(outcome.history[static_cast<std::size_t>(k)], piston.exact(k + 1),
                tolerance * piston.start)
        << "window " << k + 1;
}

TEST(Participant, the_coupled_piston_follows_the_closed_form) {
  const TemporaryFolder folder;
  Piston piston;
  piston.bridge_keys = "displacement_tolerance = 1e-10\nforce_tolerance = 1e-9\n";
  const Outcome outcome = run_both(piston, folder.path(), true);
  expect_closed_form(piston, outcome, 1e-8);
  EXPECT_EQ(outcome.solid.windows, 100);
  EXPECT_EQ(outcome.fluid.windows, 100);
  EXPECT_EQ(outcome.fluid.iterations, outcome.solid.iterations);
  EXPECT_LE(outcome.solid.iterations_max, 6);
}

TEST(Participant, the_transports_and_the_start_order_give_the_same_bits) {
  const TemporaryFolder folder;
  Piston piston;
  const Outcome local = run_both(piston, folder.path(), true);
  expect_closed_form(piston, local, 1e-3);
  piston.bridge_keys = "transport = \"unix\"\n";
  EXPECT_EQ(run_both(piston, folder.path(), false).history, local.history);
  piston.bridge_keys = "transport = \"tcp\"\n";
  EXPECT_EQ(run_both(piston, folder.path(), false).history, local.history);
  piston.bridge_keys = "transport = \"shared\"\n";
  EXPECT_EQ(run_both(piston, folder.path(), false).history, local.history);
}

TEST(Participant, aitken_follows_the_closed_form) {
  const TemporaryFolder folder;
  Piston piston;
  piston.bridge_keys = "acceleration = \"aitken\"\n";
  expect_closed_form(piston, run_both(piston, folder.path(), true), 1e-3);
}

// The largest distance from the closed form, relative to the amplitude.
double explicit_error(double time_step) {
  const TemporaryFolder folder;
  Piston piston;
  piston.added_mass = 0.2;
  piston.stiffness = 100;
  piston.time_step = time_step;
  piston.windows = static_cast<int>(std::lround(0.4 / time_step));
  piston.bridge_keys = "scheme = \"serial-explicit\"\n";
  const Outcome outcome = run_both(piston, folder.path(), true);
  EXPECT_EQ(outcome.fluid_error + outcome.solid_error, "");
  EXPECT_EQ(outcome.solid.iterations, piston.windows) << "one pass per window";
  double largest = 0;
  for (int k = 0; k < piston.windows; ++k)
    largest = std::max(
        largest, std::abs(outcome.history[static_cast<std::size_t>(k)] - piston.exact(k + 1)));
  return largest / piston.start;
}

TEST(Participant, the_explicit_scheme_converges_in_first_order_with_light_water) {
  const double coarse = explicit_error(1e-3), fine = explicit_error(5e-4);
  EXPECT_LE(coarse, 0.02);
  EXPECT_NEAR(coarse / fine, 2, 0.1);
}

TEST(Participant, the_explicit_scheme_fails_with_heavy_water_at_any_step) {
  const TemporaryFolder folder;
  Piston piston;
  piston.bridge_keys = "scheme = \"serial-explicit\"\n";
  piston.windows = 20;
  const Outcome outcome = run_both(piston, folder.path(), true);
  ASSERT_EQ(outcome.history.size(), 20u) << outcome.fluid_error << outcome.solid_error;
  EXPECT_GT(std::abs(outcome.history.back()), 10 * piston.start);
}

TEST(Participant, both_ends_balance_force_moment_and_work) {
  const TemporaryFolder folder;
  const Outcome outcome = run_both(Piston(), folder.path(), true);
  EXPECT_GE(outcome.solid.force_balance_max, 0);
  EXPECT_LE(outcome.solid.force_balance_max, 1e-14);
  EXPECT_LE(outcome.solid.moment_balance_max, 1e-14);
  EXPECT_LE(outcome.solid.work_balance_max, 1e-12);
  EXPECT_EQ(outcome.map.coverage(), 1);
  std::ifstream balance(folder.path() / "balance.csv");
  EXPECT_EQ(std::count(std::istreambuf_iterator<char>(balance), {}, '\n'), 101);
}

TEST(BalanceLog, compares_a_window_when_both_sides_have_reported_it) {
  const TemporaryFolder folder;
  BalanceLog log(folder.path() / "balance.csv");
  Statistics statistics;
  InterfaceTotals fluid{{3, 4, 0}, {0, 0, 2}, 0.5, 5, 2, 1}, solid = fluid;
  log.add_fluid({1, fluid}, statistics);
  EXPECT_EQ(statistics.force_balance_max, -1);
  log.add_solid({1, solid}, statistics);
  EXPECT_EQ(statistics.force_balance_max, 0);
  solid.force[1] += 0.05;
  solid.moment[2] -= 0.04;
  solid.work += 0.003;
  log.add_solid({2, solid}, statistics);
  log.add_fluid({2, fluid}, statistics);
  EXPECT_NEAR(statistics.force_balance_max, 0.01, 1e-12);
  EXPECT_NEAR(statistics.moment_balance_max, 0.02, 1e-12);
  EXPECT_NEAR(statistics.work_balance_max, 0.003, 1e-12);
}

TEST(BalanceLog, a_sum_that_is_not_a_number_balances_nothing) {
  const TemporaryFolder folder;
  BalanceLog log(folder.path() / "balance.csv");
  Statistics statistics;
  InterfaceTotals fluid{{3, 4, 0}, {0, 0, 2}, 0.5, 5, 2, 1}, solid = fluid;
  solid.moment[2] = std::nan("");
  log.add_fluid({1, fluid}, statistics);
  log.add_solid({1, solid}, statistics);
  EXPECT_EQ(statistics.force_balance_max, 0);
  EXPECT_TRUE(std::isinf(statistics.moment_balance_max));
}

TEST(Participant, the_log_has_one_row_per_iteration) {
  const TemporaryFolder folder;
  const Outcome outcome = run_both(Piston(), folder.path(), true);
  std::ifstream log(folder.path() / "coupling.csv");
  std::string header;
  std::getline(log, header);
  EXPECT_EQ(header, "window,iteration,time_s,displacement_residual,force_residual,relaxation,"
                    "columns,converged");
  EXPECT_EQ(std::count(std::istreambuf_iterator<char>(log), {}, '\n'), outcome.solid.iterations);
}

TEST(Participant, the_summary_has_the_keys_that_scripts_read) {
  const TemporaryFolder folder;
  const Outcome outcome = run_both(Piston(), folder.path(), true);
  const auto summary = summary_of(outcome.solid);
  EXPECT_EQ(summary["windows"], 100);
  EXPECT_EQ(summary["failed_windows"], 0);
  EXPECT_EQ(summary["coupling_iterations_max"], outcome.solid.iterations_max);
  EXPECT_GT(summary["coupling_iterations_mean"], 1.0);
  for (const auto *key : {"ms_per_step_bridge", "wait_s", "force_balance_max", "work_balance_max"})
    EXPECT_TRUE(summary.contains(key)) << key;
}

// ---- what an advance costs ----------------------------------------------------------------------

struct Cost {
  long bytes_allocated;                     // per window, by both sides
  std::uint64_t bytes_sent, bytes_received; // per window, by the fluid
};

// Both sides run explicit windows on nodes that match; the fluid counts when all buffers are there.
Cost cost_of_window(std::size_t n_nodes) {
  constexpr int windows = 30, warm = 10;
  const TemporaryFolder folder;
  const auto config = Config::parse(
      fmt::format("[case]\nend_time_s = {}\ntime_step_s = 1\n[bridge]\nscheme = "
                  "\"serial-explicit\"\nmapping = \"nearest\"\nmotion = \"displacement\"\n",
                  windows),
      "cost.toml");
  const auto run = [&](const std::string &name, const char *read, const char *write,
                       const std::function<void(const Participant &)> &after_window) {
    Participant bridge(name, config, folder.path());
    InterfaceMesh mesh{3, 3, {}, {}};
    for (std::size_t k = 0; k < n_nodes; ++k)
      mesh.positions.insert(mesh.positions.end(), {static_cast<double>(k), 0, 0});
    bridge.set_mesh(mesh);
    bridge.initialize();
    std::vector<double> values(3 * n_nodes);
    while (bridge.is_coupling_ongoing()) {
      bridge.read_data(read, bridge.max_time_step_size(), values);
      bridge.write_data(write, values);
      bridge.advance(bridge.max_time_step_size());
      after_window(bridge);
    }
    bridge.finalize();
  };
  std::thread solid([&] { run("solid", "force", "displacement", [](const Participant &) {}); });
  Cost start{}, end{};
  run("fluid", "displacement", "force", [&](const Participant &bridge) {
    if (const long n = bridge.statistics().windows; n == warm || n == windows)
      (n == warm ? start : end) = {sluice::testing::allocated_bytes(),
                                   bridge.statistics().bytes_sent,
                                   bridge.statistics().bytes_received};
  });
  solid.join();
  constexpr int n = windows - warm;
  return {(end.bytes_allocated - start.bytes_allocated) / n,
          (end.bytes_sent - start.bytes_sent) / n, (end.bytes_received - start.bytes_received) / n};
}

TEST(Participant, an_advance_is_one_frame_each_way_and_copies_no_field_into_new_memory) {
  constexpr std::size_t n_nodes = 5000, field = 3 * sizeof(double) * n_nodes;
  const Cost cost = cost_of_window(n_nodes);
  fmt::print("{} bytes of fields: {} sent, {} received, {} allocated\n", field, cost.bytes_sent,
             cost.bytes_received, cost.bytes_allocated);
  EXPECT_EQ(cost.bytes_sent, field + header_size + 6 * 8); // position, text, stop, count, totals
  EXPECT_EQ(cost.bytes_received,
            field + header_size + 6 * 8); // position, verdict, stop, two counts
  EXPECT_LT(cost.bytes_allocated, 10000); // records, texts; none as long as a field
}

TEST(Participant, no_socket_file_is_left_behind_and_a_stale_one_is_no_obstacle) {
  const TemporaryFolder folder;
  Piston piston;
  piston.windows = 3;
  for (int run = 0; run < 2; ++run) {
    leave_stale_socket(folder.path() / "bridge.sock");
    const Outcome outcome = run_both(piston, folder.path(), false);
    EXPECT_EQ(outcome.fluid_error + outcome.solid_error, "");
    EXPECT_FALSE(std::filesystem::exists(folder.path() / "bridge.sock"));
  }
}

// ---- windows that fail -------------------------------------------------------------------------

// In window 5 whatever is longer than a quarter of a window cannot be computed.
Event fails_in_window_5(const Piston &piston) {
  return [length = piston.time_step](Participant &bridge, std::vector<double> &) {
    const bool is_there = bridge.time() >= 4 * length * (1 - 1e-9) && bridge.time() < 5 * length;
    if (is_there && bridge.max_time_step_size() > 0.3 * length)
      bridge.report_failure("an element turned inside out");
  };
}

Piston halving(const std::string &keys = "") {
  Piston piston;
  piston.windows = 20;
  piston.bridge_keys = "max_halvings = 2\nwindows_to_grow = 2\n" + keys;
  return piston;
}

// To the tolerance of a window's increment, as above; shorter steps in one window of twenty change
// less than that.
void expect_close_to_exact(const Outcome &outcome, const Piston &piston) {
  ASSERT_EQ(outcome.solid_error, "");
  ASSERT_EQ(outcome.fluid_error, "");
  EXPECT_NEAR(outcome.history.back(), piston.exact(piston.windows), 1e-3 * piston.start);
}

TEST(FailedWindow, is_halved_on_both_sides_whichever_reports_it_and_the_length_grows_back) {
  for (const char *scheme : {"serial-implicit", "parallel-implicit"})
    for (const bool is_fluid : {true, false}) {
      const TemporaryFolder folder;
      const Piston piston = halving(fmt::format("scheme = \"{}\"\n", scheme));
      const Event event = fails_in_window_5(piston);
      const Outcome outcome = run_both(piston, folder.path(), true, is_fluid ? event : Event(),
                                       is_fluid ? Event() : event);
      expect_close_to_exact(outcome, piston);
      EXPECT_EQ(outcome.history.size(), 18u + 4 + 2) << "four quarters, of which the third was "
                                                        "tried as a half, two halves, then whole";
      for (const Statistics &statistics : {outcome.fluid, outcome.solid}) {
        EXPECT_EQ(statistics.halved_windows, 3) << scheme;
        EXPECT_EQ(statistics.windows, 24);
        EXPECT_EQ(statistics.failed_windows, 0);
      }
    }
}

TEST(FailedWindow, a_value_that_is_not_finite_is_such_a_failure) {
  const TemporaryFolder folder;
  const Piston piston = halving();
  const Event event = [&](Participant &bridge, std::vector<double> &values) {
    if (bridge.time_window() == 3 && bridge.max_time_step_size() > 0.6 * piston.time_step)
      values[0] = std::nan("");
  };
  const Outcome outcome = run_both(piston, folder.path(), true, event);
  expect_close_to_exact(outcome, piston);
  EXPECT_EQ(outcome.solid.halved_windows, 1);
}

TEST(FailedWindow, so_is_one_that_does_not_converge) {
  const TemporaryFolder folder;
  Piston piston = halving("acceleration = \"constant\"\ninitial_relaxation = 1\n"
                          "max_iterations = 10\n");
  piston.added_mass = 1.001; // diverges at any step
  const Outcome outcome = run_both(piston, folder.path(), true);
  EXPECT_TRUE(contains(outcome.solid_error, "did not converge in 10 iterations"));
  EXPECT_TRUE(contains(outcome.solid_error, "halved 2 times already")) << outcome.solid_error;
  EXPECT_TRUE(contains(outcome.fluid_error, "halved 2 times already")) << outcome.fluid_error;
}

TEST(FailedWindow, that_cannot_be_halved_any_more_ends_both_programs_with_the_reason) {
  for (const bool is_fluid : {true, false}) {
    const TemporaryFolder folder;
    const Piston piston = halving();
    const Event event = [](Participant &bridge, std::vector<double> &) {
      if (bridge.time_window() == 3)
        bridge.report_failure("a point was lost");
    };
    const Outcome outcome = run_both(piston, folder.path(), true, is_fluid ? event : Event(),
                                     is_fluid ? Event() : event);
    for (const std::string &error : {outcome.fluid_error, outcome.solid_error})
      EXPECT_TRUE(contains(error, fmt::format("could not be computed by the {}: a point was lost",
                                              is_fluid ? "fluid" : "solid")))
          << error;
  }
}

TEST(FailedWindow, ends_the_run_where_halving_was_not_asked_for) {
  const TemporaryFolder folder;
  const Event event = [](Participant &bridge, std::vector<double> &) {
    bridge.report_failure("a point was lost");
  };
  const Outcome outcome = run_both(Piston(), folder.path(), true, event);
  EXPECT_TRUE(contains(outcome.fluid_error, "a point was lost")) << outcome.fluid_error;
  EXPECT_TRUE(contains(outcome.solid_error, "a point was lost")) << outcome.solid_error;
}

TEST(Participant, the_parallel_scheme_follows_the_closed_form_too) {
  const TemporaryFolder folder;
  Piston piston;
  piston.bridge_keys = "scheme = \"parallel-implicit\"\n";
  const Outcome outcome = run_both(piston, folder.path(), true);
  expect_close_to_exact(outcome, piston);
  fmt::print("  parallel: {:.2f} iterations per window\n", outcome.solid.iterations_mean());
  EXPECT_LE(outcome.solid.iterations_mean(), 6);
}

} // namespace
} // namespace sluice::bridge
