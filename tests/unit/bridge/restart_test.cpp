// SPDX-License-Identifier: MIT
// A run that goes on from what an earlier one saved: the same bits, the same iterations.
#include "bridge/base/restart_files.hpp"
#include "piston.hpp"

#include <fstream>

namespace sluice::bridge {
namespace {

/// What both sides saved at the end of a window, the solid's own state with it.
struct Saved {
  std::vector<std::byte> fluid, solid;
  double displacement = 0, velocity = 0;
};

struct PistonRun {
  std::vector<std::string> log; // rows of coupling.csv
  Saved last;
  std::string fluid_error, solid_error;
  bool is_stopped = false;
};

std::vector<std::string> rows_of(const std::filesystem::path &file) {
  std::ifstream in(file);
  std::vector<std::string> rows;
  std::string row;
  for (std::getline(in, row); std::getline(in, row);)
    rows.push_back(row);
  return rows;
}

// The piston of piston.hpp, with states that are saved, and a solid that cannot do windows that
// begin at `fails_at` [s] and are longer than half a window.
void fluid_program(Participant &bridge, const Piston &piston, const Saved *from, Saved &last,
                   int stop_after) {
  bridge.set_mesh(fluid_line());
  if (from)
    bridge.restore(from->fluid);
  bridge.initialize();
  std::vector<double> before(16), after(16), force(16);
  while (bridge.is_coupling_ongoing()) {
    const double dt = bridge.max_time_step_size();
    bridge.read_data("velocity", 0, before);
    bridge.read_data("velocity", dt, after);
    for (std::size_t k = 0; k < force.size(); k += 2)
      force[k] = -piston.added_mass / 8 * (after[k] - before[k]) / dt;
    bridge.write_data("force", force);
    if (bridge.time_window() == stop_after)
      bridge.request_stop();
    bridge.advance(dt);
    if (bridge.is_time_window_complete())
      bridge.report_totals({});
    if (bridge.requires_writing_restart())
      last.fluid = bridge.saved_state();
  }
  bridge.finalize();
}

void solid_program(Participant &bridge, const Piston &piston, const Saved *from, Saved &last,
                   double fails_at) {
  const auto along_x = [](double value) {
    return std::vector<double>{value, 0, value, 0, value, 0, value, 0};
  };
  double d = from ? from->displacement : piston.start, v = from ? from->velocity : 0;
  double saved_d = d, saved_v = v;
  bridge.set_mesh(solid_line());
  bridge.write_data("displacement", along_x(piston.start));
  if (from)
    bridge.restore(from->solid);
  bridge.initialize();
  std::vector<double> force(8);
  while (bridge.is_coupling_ongoing()) {
    if (bridge.requires_writing_checkpoint())
      saved_d = d, saved_v = v;
    const double dt = bridge.max_time_step_size();
    bridge.read_data("force", dt, force);
    const double m = piston.structure_mass, k = piston.stiffness;
    const double sum = force[0] + force[2] + force[4] + force[6];
    const double v_new =
        (m * v + dt * sum - dt * k * (d + 0.25 * dt * v)) / (m + 0.25 * dt * dt * k);
    d += 0.5 * dt * (v + v_new);
    v = v_new;
    if (std::abs(bridge.time() - fails_at) < 1e-9 && dt > 0.6 * piston.time_step)
      bridge.report_failure("provoked");
    else
      bridge.write_data("displacement", along_x(d));
    bridge.write_data("velocity", along_x(v));
    bridge.advance(dt);
    if (bridge.requires_reading_checkpoint())
      d = saved_d, v = saved_v;
    if (bridge.is_time_window_complete())
      bridge.report_totals({});
    if (bridge.requires_writing_restart()) {
      last.solid = bridge.saved_state();
      last.displacement = d;
      last.velocity = v;
    }
  }
  bridge.finalize();
}

PistonRun run_piston(const Piston &piston, const Saved *from = nullptr, double fails_at = -1,
                     int stop_after = 0) {
  const TemporaryFolder folder;
  PistonRun run;
  auto ends = local_transports();
  std::thread fluid([&] {
    run.fluid_error = error_of([&] {
      Participant bridge("fluid", piston.config(), folder.path(), std::move(ends.first));
      run_coupled(bridge, [&] { fluid_program(bridge, piston, from, run.last, stop_after); });
    });
  });
  run.solid_error = error_of([&] {
    Participant bridge("solid", piston.config(), folder.path(), std::move(ends.second));
    run_coupled(bridge, [&] { solid_program(bridge, piston, from, run.last, fails_at); });
    run.is_stopped = bridge.is_stopped();
  });
  fluid.join();
  run.log = rows_of(folder.path() / "coupling.csv");
  return run;
}

Piston piston_of(int windows, const std::string &keys) {
  Piston piston;
  piston.windows = windows;
  piston.added_mass = 10;
  piston.bridge_keys = "restart_every_windows = 1\nmax_halvings = 3\nwindows_to_grow = 3\n" + keys;
  return piston;
}

class EveryScheme : public testing::TestWithParam<std::string> {};
INSTANTIATE_TEST_SUITE_P(
    Restart, EveryScheme,
    testing::Values("acceleration = \"iqn-ils\"\n", "acceleration = \"iqn-imvj\"\n",
                    "acceleration = \"aitken\"\n",
                    "acceleration = \"constant\"\ninitial_relaxation = 0.1\nmax_iterations = 400\n",
                    "scheme = \"parallel-implicit\"\n", "interpolation = \"quadratic\"\n",
                    "predictor = \"none\"\n"));

// The run is cut in window 9: instants right before it, right after it, and where the length has
// not grown back yet.
TEST_P(EveryScheme, goes_on_with_the_same_bits_and_iterations) {
  const double fails_at = 0.008;
  const PistonRun whole = run_piston(piston_of(20, GetParam()), nullptr, fails_at);
  ASSERT_EQ(whole.solid_error + whole.fluid_error, "");
  for (const int stop_after : {5, 9, 10, 13}) {
    const PistonRun first = run_piston(piston_of(20, GetParam()), nullptr, fails_at, stop_after);
    EXPECT_TRUE(first.is_stopped);
    EXPECT_EQ(first.solid_error + first.fluid_error, "");
    const PistonRun second = run_piston(piston_of(20, GetParam()), &first.last, fails_at);
    EXPECT_EQ(second.solid_error + second.fluid_error, "");
    std::vector<std::string> log = first.log;
    log.insert(log.end(), second.log.begin(), second.log.end());
    EXPECT_EQ(log, whole.log) << "after window " << stop_after;
    EXPECT_EQ(second.last.displacement, whole.last.displacement);
  }
}

TEST(Restart, of_a_run_that_ended_goes_on_to_a_later_end) {
  const PistonRun whole = run_piston(piston_of(20, ""));
  const PistonRun half = run_piston(piston_of(10, ""));
  const PistonRun rest = run_piston(piston_of(20, ""), &half.last);
  std::vector<std::string> log = half.log;
  log.insert(log.end(), rest.log.begin(), rest.log.end());
  EXPECT_EQ(log, whole.log);
}

// The first run's last window is 0.4 of a window long.
TEST(Restart, of_a_run_whose_last_window_was_cut_goes_on_from_its_end) {
  Piston cut = piston_of(10, "");
  cut.end_time = 9.4 * cut.time_step;
  const PistonRun first = run_piston(cut);
  const PistonRun rest = run_piston(piston_of(20, ""), &first.last);
  EXPECT_EQ(rest.solid_error + rest.fluid_error, "");
  const auto time_of = [](const std::string &row) { // after window and iteration
    return std::stod(row.substr(row.find(',', row.find(',') + 1) + 1));
  };
  EXPECT_NEAR(time_of(first.log.back()), 9.4e-3, 1e-15);
  EXPECT_NEAR(time_of(rest.log.front()), 10.4e-3, 1e-15);
  EXPECT_NEAR(time_of(rest.log.back()), 20e-3, 1e-15);
}

TEST(Restart, is_refused_with_another_coupling_or_another_side) {
  const PistonRun half = run_piston(piston_of(4, ""));
  const auto refusal = [&](const Piston &piston, const Saved &from) {
    const TemporaryFolder folder;
    return error_of([&] {
      Participant bridge("solid", piston.config(), folder.path());
      bridge.restore(from.solid);
    });
  };
  expect_message(refusal(piston_of(4, "acceleration = \"aitken\"\n"), half.last),
                 {"bridge.acceleration = 'aitken'", "goes on with the coupling"});
  Saved swapped;
  swapped.solid = half.last.fluid;
  expect_message(refusal(piston_of(4, ""), swapped), {"the solid was given the fluid's"});
  Saved damaged = half.last;
  damaged.solid.resize(damaged.solid.size() / 2);
  expect_message(refusal(piston_of(4, ""), damaged), {"damaged"});
}

TEST(Restart, from_different_windows_is_refused_by_both_sides) {
  Saved mixed = run_piston(piston_of(4, "")).last;
  mixed.fluid = run_piston(piston_of(5, "")).last.fluid;
  const PistonRun run = run_piston(piston_of(8, ""), &mixed);
  for (const auto &error : {run.fluid_error, run.solid_error})
    expect_message(error,
                   {"restart files of different windows", "after window 5", "after window 4"});
}

// The same case, the same window, other runs: what one of them computed fits the other no more.
TEST(Restart, from_the_same_window_of_two_runs_is_refused_by_both_sides) {
  Saved mixed = run_piston(piston_of(4, "")).last;
  mixed.fluid = run_piston(piston_of(4, "")).last.fluid;
  const PistonRun run = run_piston(piston_of(8, ""), &mixed);
  for (const auto &error : {run.fluid_error, run.solid_error})
    expect_message(error, {"different windows or runs", "after window 4 of run "});
}

TEST(RestartFiles, the_last_window_that_all_have_is_taken_and_two_are_kept) {
  const TemporaryFolder folder;
  const std::vector<std::string> names{"fluid", "solid"};
  expect_message(error_of([&] { last_restart_files(folder.path() / "no", names); }), {"no such"});
  for (const long window : {8, 9, 10, 11})
    std::ofstream(restart_file(folder.path(), "fluid", window)) << "x";
  expect_message(error_of([&] { last_restart_files(folder.path(), names); }),
                 {"fluid: 8 9 10 11", "solid: none", "restart_every_windows"});
  for (const long window : {9, 10})
    std::ofstream(restart_file(folder.path(), "solid", window)) << "x";
  remove_older_restart_files(folder.path(), "fluid");
  EXPECT_FALSE(std::filesystem::exists(restart_file(folder.path(), "fluid", 9)));
  const auto files = last_restart_files(folder.path(), names);
  EXPECT_EQ(files.at("fluid"), folder.path() / "restart_fluid_000010.h5");
  EXPECT_EQ(files.at("solid"), folder.path() / "restart_solid_000010.h5");
}

// Files of an earlier run, of later windows, would outlive those of the run at hand.
TEST(RestartFiles, of_an_earlier_run_are_removed_and_never_taken_for_this_ones) {
  const TemporaryFolder folder;
  for (const long window : {100, 200})
    for (const char *name : {"fluid", "solid"})
      std::ofstream(restart_file(folder.path(), name, window)) << "x";
  expect_message(error_of([&] {
                   check_is_elsewhere(restart_file(folder.path(), "fluid", 200), folder.path());
                 }),
                 {"cannot go on in the folder", "--out"});
  remove_restart_files(folder.path(), "fluid");
  std::ofstream(restart_file(folder.path(), "fluid", 10)) << "x";
  remove_older_restart_files(folder.path(), "fluid");
  EXPECT_TRUE(std::filesystem::exists(restart_file(folder.path(), "fluid", 10)));
  const std::vector<std::string> names{"fluid", "solid"};
  expect_message(error_of([&] { last_restart_files(folder.path(), names); }),
                 {"fluid: 10, solid: 100 200"});
}

} // namespace
} // namespace sluice::bridge
