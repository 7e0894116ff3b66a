// SPDX-License-Identifier: MIT
// The adapter against a scripted fluid in another thread, and what a run leaves behind.
#include "gate.hpp"

#include "bridge/base/restart_files.hpp"
#include "bridge/participant.hpp"
#include "bridge/transport.hpp"
#include "bridge/transport_local.hpp"
#include "solid-dealii/alone.hpp"
#include "solid-dealii/coupling.hpp"
#include "solid-dealii/interface.hpp"

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include <fstream>
#include <sstream>
#include <thread>

namespace sluice::solid {
namespace {

namespace fs = std::filesystem;

constexpr const char *case_text = R"([case]
name = "test"
end_time_s = 4e-3
time_step_s = 2e-4
output_interval_s = 1e-3
[bridge]
scheme = "serial-implicit"
max_iterations = 30
[solid]
corner_m = [0.1, 0]
width_m = 0.005
height_m = 0.079
elements_across = 1
elements_along = 28
density_kg_m3 = 1100
youngs_modulus_pa = 12e6
poisson_ratio = 0.4
)";

// The fluid's side: the same mesh as the solid's, and forces by `force_of(velocity)`.
template <class Force>
void scripted_fluid(const Config &config, std::unique_ptr<bridge::Transport> transport,
                    const fs::path &folder, Force force_of, const fs::path &from) {
  SolidSolver<2> solver(gate_params());
  const auto surface = wetted_interface(solver.discretisation(), Side::upper);
  bridge::Participant bridge("fluid", config, folder, std::move(transport));
  bridge.set_mesh(surface.mesh);
  restore_fluid(bridge, from);
  bridge.initialize();
  std::vector<double> velocity(2 * surface.nodes.size());
  while (bridge.is_coupling_ongoing()) {
    const double dt = bridge.max_time_step_size();
    bridge.read_data("velocity", dt, velocity);
    bridge.write_data("force", force_of(surface, solver, velocity));
    bridge.advance(dt);
    if (bridge.requires_writing_restart())
      keep_fluid(bridge, folder);
  }
  bridge.finalize();
}

struct Outcome {
  std::string solid_error, fluid_error;
  fs::path folder;
};

template <class Force>
Outcome couple(const std::string &name, Force force_of,
               const std::vector<std::string> &overrides = {}, const fs::path &from = {},
               long window = 0) {
  const Config config = Config::parse(case_text, "case.toml", overrides);
  Outcome outcome{"", "", fs::path(testing::TempDir()) / name};
  fs::remove_all(outcome.folder);
  fs::create_directories(outcome.folder);
  auto [ours, theirs] = bridge::local_transports();
  std::thread fluid([&, transport = std::move(theirs)]() mutable {
    try {
      scripted_fluid(config, std::move(transport), outcome.folder, force_of, from);
    } catch (const std::exception &error) {
      outcome.fluid_error = error.what();
    }
  });
  try {
    bridge::Participant bridge("solid", config, outcome.folder, std::move(ours));
    run(&bridge, config, outcome.folder, from.empty() ? from : restart_file(from, "solid", window));
  } catch (const std::exception &error) {
    outcome.solid_error = error.what();
  }
  fluid.join();
  return outcome;
}

std::string rows_of(const fs::path &file) {
  std::ifstream in(file);
  std::string header;
  std::getline(in, header);
  return {std::istreambuf_iterator<char>(in), {}};
}

std::vector<std::vector<double>> read_csv(const fs::path &file) {
  std::ifstream in(file);
  std::vector<std::vector<double>> rows;
  std::string line;
  for (std::getline(in, line); std::getline(in, line);) {
    rows.emplace_back();
    std::stringstream cells(line);
    for (std::string cell; std::getline(cells, cell, ',');)
      rows.back().push_back(std::stod(cell));
  }
  return rows;
}

nlohmann::json read_json(const fs::path &file) {
  std::ifstream in(file);
  return nlohmann::json::parse(in);
}

std::vector<double> constant_force(const Interface<2> &surface, const SolidSolver<2> &solver,
                                   std::span<const double>) {
  return surface.gather(dead_load(solver));
}

// The force does not depend on the motion, so the coupled run is the uncoupled one.
TEST(Coupling, under_a_given_force_the_coupled_run_is_the_uncoupled_one) {
  const Outcome outcome = couple("constant", constant_force);
  ASSERT_EQ(outcome.solid_error, "");
  ASSERT_EQ(outcome.fluid_error, "");
  SolidSolver<2> solver(gate_params());
  SolidState state = solver.initial_state(), start;
  for (int k = 0; k < 20; ++k) {
    start = state;
    state = solver.step(start, dead_load(solver), 2e-4);
  }
  const auto tips = read_csv(outcome.folder / "tip.csv");
  ASSERT_EQ(tips.size(), 21u) << "the state at rest and one row per window, not per iteration";
  EXPECT_NEAR(tips.back()[0], 4e-3, 1e-15);
  // Equal but for Newton's tolerance (the force goes through the bridge's map and back).
  EXPECT_NEAR(tips.back()[1] / tip(solver, state, 0), 1, 1e-8);
  const auto sums =
      sum_loads(solver.discretisation(), dead_load(solver), start.displacement, state.displacement);
  const auto loads = read_csv(outcome.folder / "solid_loads.csv").back();
  EXPECT_EQ(loads[0], 20);
  EXPECT_NEAR(loads[2], sums.force.x(), 1e-10);
  EXPECT_NEAR(loads[4], sums.moment.z(), 1e-10);
  EXPECT_NEAR(loads[7] / sums.work, 1, 1e-7);
  const auto energy = read_csv(outcome.folder / "solid_energy.csv").back();
  EXPECT_NEAR(energy[1] / solver.kinetic_energy(state), 1, 1e-7);
  EXPECT_NEAR(energy[2] / solver.strain_energy(state), 1, 1e-7);
  EXPECT_NEAR(energy[3] / state.load_work, 1, 1e-7);
}

// The same fluid, plane, against a column of hexahedra: the plane solid's answer.
TEST(Coupling, a_column_of_hexahedra_answers_a_plane_partner_like_the_plane_solid) {
  const Outcome plane = couple("plane", constant_force);
  const Outcome deep = couple("deep", constant_force,
                              {"solid.dimension=3", "solid.interface=plane", "solid.depth_m=0.02",
                               "solid.elements_deep=2", "case.end_time_s=2e-3"});
  ASSERT_EQ(deep.solid_error, "");
  ASSERT_EQ(deep.fluid_error, "");
  const auto a = read_csv(plane.folder / "tip.csv"), b = read_csv(deep.folder / "tip.csv");
  ASSERT_EQ(b.size(), 11u);
  for (std::size_t k = 1; k < b.size(); ++k) // Newton's tolerance, and the map between the meshes
    EXPECT_NEAR(b[k][1] / a[k][1], 1, 1e-7);
  const auto loads2 = read_csv(plane.folder / "solid_loads.csv"),
             loads3 = read_csv(deep.folder / "solid_loads.csv");
  EXPECT_NEAR(loads3[5][2] / loads2[5][2] / 0.02, 1, 1e-9) << "newtons, and newtons per metre";
}

TEST(Coupling, a_run_leaves_fields_and_a_summary) {
  const Outcome outcome = couple("summary", constant_force);
  const auto summary = read_json(outcome.folder / "solid_summary.json");
  EXPECT_TRUE(summary.at("completed").get<bool>());
  EXPECT_EQ(summary.at("windows").get<int>(), 20);
  EXPECT_EQ(summary.at("solid_unknowns").get<int>(), 112);
  EXPECT_GT(summary.at("ms_per_step_solid").get<double>(), 0);
  std::ifstream pvd(outcome.folder / "solid.pvd");
  std::stringstream text;
  text << pvd.rdbuf();
  EXPECT_TRUE(fs::exists(outcome.folder / "solid_0004.vtu")) << "0, 1, 2, 3 and 4 ms";
  EXPECT_TRUE(fs::exists(outcome.folder / "solid_state.h5"));
  EXPECT_FALSE(fs::exists(outcome.folder / "solid_0005.vtu"));
  EXPECT_NE(text.str().find("solid_0004.vtu"), std::string::npos);
}

// A force against the motion, as added mass and damping make it: iterations are rejected, and the
// accepted motion is that of the converged force.
TEST(Coupling, rejected_iterations_leave_no_trace) {
  const double damping = 40; // [N s/m per node]
  const auto damped = [&](const Interface<2> &surface, const SolidSolver<2> &solver,
                          std::span<const double> velocity) {
    auto force = surface.gather(dead_load(solver));
    for (std::size_t k = 0; k < force.size(); ++k)
      force[k] -= damping * velocity[k];
    return force;
  };
  const Outcome outcome = couple("damped", damped);
  ASSERT_EQ(outcome.solid_error, "");
  ASSERT_EQ(outcome.fluid_error, "");
  EXPECT_GT(
      read_json(outcome.folder / "solid_summary.json").at("coupling_iterations_mean").get<double>(),
      1.5);
  // The same by hand: repeat each step until force and velocity agree.
  SolidSolver<2> solver(gate_params());
  const auto surface = wetted_interface(solver.discretisation(), Side::upper);
  SolidState state = solver.initial_state();
  for (int k = 0; k < 20; ++k) {
    const SolidState start = state;
    Eigen::VectorXd load = dead_load(solver);
    double change = 1;
    for (int i = 0; i < 100 && change > 1e-9 * load.norm(); ++i) {
      state = solver.step(start, load, 2e-4);
      const Eigen::VectorXd next = surface.scatter(
          damped(surface, solver, surface.gather(state.velocity)), static_cast<int>(load.size()));
      change = (next - load).norm();
      load += 0.4 * (next - load);
    }
    EXPECT_LT(change, 1e-8 * load.norm());
  }
  const auto tips = read_csv(outcome.folder / "tip.csv");
  EXPECT_NEAR(tips.back()[1] / tip(solver, state, 0), 1, 2e-3); // the coupling tolerance
}

TEST(Coupling, a_solid_that_meets_nobody_leaves_the_series_of_an_earlier_run) {
  const fs::path folder = fs::path(testing::TempDir()) / "nobody";
  fs::remove_all(folder);
  fs::create_directories(folder);
  std::ofstream(folder / "tip.csv") << "of an earlier run\n";
  const std::vector<std::string> soon{"bridge.connect_deadline_s=0.1"};
  EXPECT_THROW(run(Config::parse(case_text, "case.toml", soon), folder), UserError);
  std::ifstream tip(folder / "tip.csv");
  std::string line;
  std::getline(tip, line);
  EXPECT_EQ(line, "of an earlier run");
}

TEST(Coupling, the_release_alone_ends_at_the_end_time_with_a_shorter_window) {
  const fs::path folder = fs::path(testing::TempDir()) / "release";
  fs::remove_all(folder);
  const std::vector<std::string> end{"case.end_time_s=5e-4"};
  run_alone("release", Config::parse(case_text, "case.toml", end), {1000, 9.81, 0.14}, folder);
  const auto tips = read_csv(folder / "tip.csv");
  ASSERT_EQ(tips.size(), 4u) << "at rest, two windows of 2e-4 s and one of 1e-4 s";
  EXPECT_EQ(tips.back()[0], 5e-4);
}

// 5 ms in one run, or 2 ms, a state file and the rest.
TEST(Coupling, a_release_that_goes_on_from_its_state_file_ends_with_the_same_bits) {
  const fs::path whole = fs::path(testing::TempDir()) / "whole",
                 first = fs::path(testing::TempDir()) / "first",
                 rest = fs::path(testing::TempDir()) / "rest";
  for (const auto &folder : {whole, first, rest})
    fs::remove_all(folder);
  const auto release = [](const fs::path &folder, const char *end, const fs::path &from) {
    const std::vector<std::string> overrides{std::string("case.end_time_s=") + end};
    run_alone("release", Config::parse(case_text, "case.toml", overrides), {1000, 9.81, 0.14},
              folder, from);
  };
  release(whole, "4e-3", "");
  release(first, "2e-3", "");
  release(rest, "4e-3", first / "solid_state.h5");
  const auto a = read_csv(whole / "tip.csv"), b = read_csv(rest / "tip.csv");
  ASSERT_EQ(b.size(), 11u) << "the state it starts from and ten windows";
  EXPECT_EQ(b.back(), a.back());
  EXPECT_EQ(read_csv(whole / "solid_energy.csv").back(),
            read_csv(rest / "solid_energy.csv").back());
}

// The set-up of the multigrid is made for one matrix and serves many; a checkpoint ends its use.
TEST(Coupling, a_coupled_run_goes_on_with_the_same_bits_whatever_the_linear_solver) {
  const auto pushed = [](const auto &surface, const auto &solver, const auto &velocity) {
    auto force = surface.gather(dead_load(solver));
    for (std::size_t k = 0; k < force.size(); ++k)
      force[k] -= 0.5 * velocity[k];
    return force;
  };
  for (const std::string solver : {"direct", "cg"}) {
    const std::vector<std::string> settings{
        "bridge.restart_every_windows=5", "solid.linear_solver=" + solver,
        "solid.elements_across=3", "solid.elements_along=120"}; // of several levels
    auto shorter = settings;
    shorter.push_back("case.end_time_s=2e-3");
    const Outcome whole = couple("whole-" + solver, pushed, settings),
                  half = couple("half-" + solver, pushed, shorter),
                  rest = couple("rest-" + solver, pushed, settings, half.folder, 10);
    for (const Outcome *run : {&whole, &half, &rest})
      EXPECT_EQ(run->solid_error + run->fluid_error, "");
    EXPECT_EQ(rows_of(half.folder / "coupling.csv") + rows_of(rest.folder / "coupling.csv"),
              rows_of(whole.folder / "coupling.csv"))
        << solver;
    EXPECT_EQ(read_csv(rest.folder / "tip.csv").back(), read_csv(whole.folder / "tip.csv").back());
  }
}

TEST(Coupling, probes_and_reactions_are_recorded) {
  const fs::path folder = fs::path(testing::TempDir()) / "probes";
  fs::remove_all(folder);
  const std::string text = std::string(case_text) + R"(
[[solid.probe]]
name = "corner"
position_m = [0.1, 0]
)";
  const std::vector<std::string> end{"case.end_time_s=1e-3"};
  run_alone("release", Config::parse(text, "case.toml", end), {1000, 9.81, 0.14}, folder);
  const auto probes = read_csv(folder / "probes.csv"), tips = read_csv(folder / "tip.csv");
  ASSERT_EQ(probes.size(), tips.size());
  EXPECT_EQ(probes.back()[1], tips.back()[3]);
  EXPECT_EQ(probes.back()[2], tips.back()[4]);
  EXPECT_EQ(read_csv(folder / "reactions.csv").size(), 5u) << "one row per window";
}

TEST(Coupling, a_solid_that_fails_tells_its_partner_and_leaves_a_summary) {
  int calls = 0;
  const auto bursting = [&](const Interface<2> &surface, const SolidSolver<2> &solver,
                            std::span<const double> velocity) {
    auto force = constant_force(surface, solver, velocity);
    if (++calls > 10)
      for (double &f : force)
        f *= 1e12;
    return force;
  };
  const Outcome outcome = couple("bursting", bursting);
  EXPECT_NE(outcome.solid_error.find("no solution"), std::string::npos) << outcome.solid_error;
  EXPECT_NE(outcome.fluid_error.find("no solution"), std::string::npos) << outcome.fluid_error;
  const auto summary = read_json(outcome.folder / "solid_summary.json");
  EXPECT_FALSE(summary.at("completed").get<bool>());
  EXPECT_NE(summary.at("message").get<std::string>().find("largest nodal force"),
            std::string::npos);
  EXPECT_GE(read_csv(outcome.folder / "tip.csv").size(), 2u) << "what was computed is there";
}

// Three iterations do not solve every window of 2 ms; they solve shorter ones.
TEST(Coupling, a_window_that_newton_cannot_solve_is_cut_by_the_bridge) {
  const auto run_with = [](const char *name, int iterations, const char *window) {
    return couple(name, constant_force,
                  {fmt::format("solid.newton_max_iterations={}", iterations),
                   fmt::format("case.time_step_s={}", window), "solid.max_step_cuts=0",
                   "bridge.max_halvings=5"});
  };
  const Outcome cut = run_with("cut", 3, "2e-3"), fine = run_with("fine", 25, "2.5e-4");
  ASSERT_EQ(cut.solid_error, "");
  ASSERT_EQ(cut.fluid_error, "");
  const auto summary = read_json(cut.folder / "solid_summary.json");
  EXPECT_TRUE(summary.at("completed").get<bool>());
  EXPECT_GT(summary.at("halved_windows").get<int>(), 0);
  EXPECT_EQ(summary.at("solid_cut_steps").get<int>(), 0) << "the bridge cut, not the solid";
  const auto tips = read_csv(cut.folder / "tip.csv"), exact = read_csv(fine.folder / "tip.csv");
  EXPECT_GT(tips.size(), 3u) << "at rest, and more than two windows";
  EXPECT_NEAR(tips.back()[0], 4e-3, 1e-15);
  // A step shifts its load by 0.06 of its length (README, Time): 0.12 ms of 4 ms, over which the
  // tip moves with the square of time.
  EXPECT_NEAR(tips.back()[1] / exact.back()[1], 1, 0.06);
}

} // namespace
} // namespace sluice::solid
