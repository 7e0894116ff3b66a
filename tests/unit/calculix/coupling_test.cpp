// SPDX-License-Identifier: MIT
// The adapter with the real ccx against a scripted fluid in another thread.
#include "bridge/calculix/coupling.hpp"
#include "bridge/calculix/windows.hpp"
#include "bridge/participant.hpp"
#include "bridge/transport.hpp"
#include "bridge/transport_local.hpp"
#include "gate_box.hpp"
#include "tests/unit/bridge/support.hpp"

#include <nlohmann/json.hpp>

#include <fstream>
#include <sstream>
#include <thread>

namespace sluice::calculix {
namespace {

namespace fs = std::filesystem;
using bridge::contains;
using bridge::error_of;

constexpr double dt = 2e-4; // [s]
constexpr int n_windows = 5;

std::string case_text(int dim) {
  return fmt::format("[case]\nname = \"gate\"\nend_time_s = {}\ntime_step_s = {}\n"
                     "output_interval_s = {}\n[solid]\nprogram = \"sluice-calculix\"\n"
                     "dimension = {}\ncorner_m = [0.1, 0]\nwidth_m = 0.005\nheight_m = 0.079\n"
                     "elements_across = 1\nelements_along = 28\nelement = \"q1\"\n"
                     "density_kg_m3 = 1100\nyoungs_modulus_pa = 12e6\npoisson_ratio = 0.4\n",
                     n_windows * dt, dt, n_windows * dt, dim);
}

Interface surface_of(int dim) {
  return interface_of(parse_deck(box_deck(gate_box("q1")), "box"), box_interface_set, dim);
}

/// Pushes the front of the gate with the same force on each node [N; 2-D: N/m].
std::vector<double> push(const bridge::InterfaceMesh &mesh, double force) {
  std::vector<double> forces(mesh.positions.size(), 0.0);
  for (std::size_t a = 0; a < mesh.n_nodes(); ++a)
    if (mesh.position(a)[0] < 0.1 + 1e-9)
      forces[a * static_cast<std::size_t>(mesh.dim)] = force;
  return forces;
}

// In every iteration of window k the force is k `force`, whatever the gate does; `burst` instead in
// a third window that was not cut.
void scripted_fluid(const Config &config, std::unique_ptr<bridge::Transport> transport,
                    const fs::path &folder, int dim, double force, double burst) {
  bridge::Participant bridge("fluid", config, folder, std::move(transport));
  const bridge::InterfaceMesh mesh = surface_of(dim).mesh;
  bridge.set_mesh(mesh);
  bridge.initialize();
  while (bridge.is_coupling_ongoing()) {
    const double length = bridge.max_time_step_size();
    const bool bursts = burst > 0 && bridge.time_window() == 3 && length > 0.6 * dt;
    bridge.write_data(
        "force", push(mesh, bursts ? burst : static_cast<double>(bridge.time_window()) * force));
    bridge.advance(length);
  }
  bridge.finalize();
}

struct Outcome {
  std::string solid_error, fluid_error;
};

Outcome couple(const fs::path &folder, int dim, double force,
               const std::vector<std::string> &overrides = {}, double burst = 0) {
  const Config config = Config::parse(case_text(dim), "case.toml", overrides);
  Outcome outcome;
  auto [ours, theirs] = bridge::local_transports();
  std::thread fluid([&, transport = std::move(theirs)]() mutable {
    outcome.fluid_error =
        error_of([&] { scripted_fluid(config, std::move(transport), folder, dim, force, burst); });
  });
  outcome.solid_error = error_of([&] {
    bridge::Participant bridge("solid", config, folder, std::move(ours));
    run(bridge, config, folder);
  });
  fluid.join();
  return outcome;
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

nlohmann::json read_summary(const fs::path &folder) {
  std::ifstream in(folder / "solid_summary.json");
  return nlohmann::json::parse(in);
}

TEST(CalculixCoupling, under_a_given_force_the_coupled_run_is_the_uncoupled_one) {
  for (const int dim : {2, 3}) {
    const TemporaryFolder folder;
    const Outcome outcome = couple(folder.path(), dim, 0.1);
    ASSERT_EQ(outcome.solid_error, "");
    ASSERT_EQ(outcome.fluid_error, "");

    const Deck deck = parse_deck(box_deck(gate_box("q1")), "box");
    const Interface surface = surface_of(dim);
    Windows windows(deck, "ccx", 1, folder.path() / "alone");
    Motion motion;
    for (int k = 1; k <= n_windows; ++k) {
      motion = windows.solve(surface.scatter(push(surface.mesh, 0.1 * k)), dt);
      windows.accept();
    }
    double tip = 0;
    for (const int node : deck.node_set(box_probe_set))
      tip += motion.displacement(0, node - 1) / 4;
    const auto tips = read_csv(folder.path() / "tip.csv");
    ASSERT_EQ(tips.size(), 1u + n_windows) << "the state at rest and one row per window";
    EXPECT_NEAR(tips.back()[0], n_windows * dt, 1e-15);
    // The force goes through the bridge's map and 14 digits of text.
    EXPECT_NEAR(tips.back()[1] / tip, 1, 1e-11);
    const auto loads = read_csv(folder.path() / "solid_loads.csv");
    EXPECT_NEAR(loads.back()[2], (dim == 2 ? 29 : 58) * 0.1 * n_windows, 1e-11);
    EXPECT_GT(loads.back()[7], 0) << "work";
  }
}

TEST(CalculixCoupling, a_run_leaves_fields_and_a_summary) {
  const TemporaryFolder folder;
  couple(folder.path(), 2, 0.1);
  const auto summary = read_summary(folder.path());
  EXPECT_TRUE(summary.at("completed").get<bool>());
  EXPECT_EQ(summary.at("windows").get<int>(), n_windows);
  EXPECT_EQ(summary.at("ccx_runs").get<int>(),
            std::lround(n_windows * summary.at("coupling_iterations_mean").get<double>()));
  EXPECT_TRUE(fs::exists(folder.path() / "solid_0001.vtu")) << "at rest and at the end";
  EXPECT_FALSE(fs::exists(folder.path() / "solid_0002.vtu"));
  std::ifstream pvd(folder.path() / "solid.pvd");
  const std::string index{std::istreambuf_iterator<char>(pvd), {}};
  EXPECT_TRUE(contains(index, "solid_0001.vtu"));
}

TEST(CalculixCoupling, ccx_that_fails_is_told_to_the_partner_and_in_the_summary) {
  const TemporaryFolder folder;
  const Outcome outcome = couple(folder.path(), 2, 1e13);
  for (const std::string &message : {outcome.solid_error, outcome.fluid_error})
    EXPECT_TRUE(contains(message, "ccx failed in window 1") && contains(message, "diverge"))
        << message;
  const auto summary = read_summary(folder.path());
  EXPECT_FALSE(summary.at("completed").get<bool>());
  EXPECT_TRUE(contains(summary.at("message").get<std::string>(), "diverge"));
  EXPECT_EQ(read_csv(folder.path() / "tip.csv").size(), 1u) << "what was computed is there";
}

TEST(CalculixCoupling, a_window_that_ccx_diverges_in_is_cut_by_the_bridge) {
  const TemporaryFolder folder;
  const Outcome outcome = couple(folder.path(), 2, 0.1, {"bridge.max_halvings=1"}, 1e13);
  ASSERT_EQ(outcome.solid_error, "");
  ASSERT_EQ(outcome.fluid_error, "");
  const auto summary = read_summary(folder.path());
  EXPECT_TRUE(summary.at("completed").get<bool>());
  EXPECT_EQ(summary.at("halved_windows").get<int>(), 1);
  const auto tips = read_csv(folder.path() / "tip.csv");
  EXPECT_GT(tips.size(), 1u + n_windows);
  EXPECT_NEAR(tips.back()[0], n_windows * dt, 1e-15);
}

} // namespace
} // namespace sluice::calculix
