// SPDX-License-Identifier: MIT
// The body on several MPI ranks against the same body on one. Run by mpirun; every rank makes both.
#include "gate.hpp"

#include "bridge/base/restart_files.hpp"
#include "bridge/participant.hpp"
#include "bridge/transport.hpp"
#include "bridge/transport_local.hpp"
#include "solid-dealii/alone.hpp"
#include "solid-dealii/coupling.hpp"
#include "solid-dealii/interface.hpp"
#include "solid-dealii/state_file.hpp"

#include <gtest/gtest.h>

#include <fstream>
#include <sstream>
#include <thread>

namespace sluice::solid {
namespace {

namespace fs = std::filesystem;

const Ranks &ranks() {
  static const Ranks all = Ranks::of_launch();
  return all;
}

// ---- entries on the border of parts -------------------------------------------------------------

// Rank r holds the entries 3 r to 3 r + 4: two shared with each neighbour; entry 0 is on all.
TEST(SharedEntries, sums_are_equal_on_all_holders_and_every_entry_has_one_owner) {
  std::vector<double> numbers{0};
  for (int k = std::max(1, 3 * ranks().rank()); k < 3 * ranks().rank() + 5; ++k)
    numbers.push_back(k);
  const SharedEntries entries(ranks(), numbers);
  const auto n = static_cast<Eigen::Index>(numbers.size());
  EXPECT_EQ(entries.count(n), 3 * (ranks().size() - 1) + 5);
  Eigen::VectorXd partial = Eigen::VectorXd::Constant(n, 0.1 + ranks().rank());
  entries.add_up(partial);
  for (Eigen::Index k = 0; k < n; ++k) {
    double expected = 0; // in the order of the ranks
    for (int r = 0; r < ranks().size(); ++r) {
      const double number = numbers[static_cast<std::size_t>(k)];
      if (number == 0 || (number >= 3 * r && number < 3 * r + 5))
        expected += 0.1 + r;
    }
    EXPECT_EQ(partial[k], expected);
  }
  Eigen::VectorXd values = Eigen::VectorXd::Constant(n, ranks().rank());
  entries.copy_from_owners(values);
  EXPECT_EQ(values[0], 0) << "the lowest rank owns what all hold";
}

// ---- the body ---------------------------------------------------------------------------------

/// The components of a vector of the whole body that `part` holds, found by place.
template <int dim>
Eigen::VectorXd restricted(const Eigen::VectorXd &whole, const Discretisation<dim> &of,
                           const Discretisation<dim> &part) {
  Eigen::VectorXd result(part.n_dofs());
  for (int a = 0; a < part.n_nodes(); ++a)
    result.template segment<dim>(dim * a) =
        whole.template segment<dim>(dim * of.nearest_node(part.nodes[static_cast<std::size_t>(a)]));
  return result;
}

// Any displacement: what cells give, added up over the ranks, is the sum over all cells.
template <int dim> void check_sums(const SolidParams &p) {
  const SolidSolver<dim> one(p), several(p, ranks());
  const auto &d1 = one.discretisation(), &dn = several.discretisation();
  EXPECT_LT(dn.n_cells(), d1.n_cells());
  EXPECT_EQ(dn.n_cells_of_all(), d1.n_cells());
  EXPECT_EQ(several.assembly().n_free_of_all(), one.assembly().n_free());
  Eigen::VectorXd u(d1.n_dofs());
  for (int a = 0; a < d1.n_nodes(); ++a) { // a smooth bend
    const Vec<dim> x = d1.nodes[static_cast<std::size_t>(a)];
    for (int c = 0; c < dim; ++c)
      u[dim * a + c] = 1e-3 * std::sin(20 * x.x() + 30 * x.y() + c);
  }
  const auto modes1 = Eigen::VectorXd::Zero(d1.n_modes()),
             modesn = Eigen::VectorXd::Zero(dn.n_modes());
  const Eigen::VectorXd un = restricted(u, d1, dn);
  // Sums of at most eight cells' terms, in another order.
  const auto expect_equal = [&](const Eigen::VectorXd &whole, const Eigen::VectorXd &parts) {
    EXPECT_LT((restricted(whole, d1, dn) - parts).cwiseAbs().maxCoeff(),
              1e-14 * whole.cwiseAbs().maxCoeff());
  };
  expect_equal(one.assembly().internal_force(u, modes1),
               several.assembly().internal_force(un, modesn));
  expect_equal(one.assembly().mass_times(u), several.assembly().mass_times(un));
  expect_equal(dead_load(one), dead_load(several));
  EXPECT_NEAR(several.assembly().strain_energy(un, modesn) /
                  one.assembly().strain_energy(u, modes1),
              1, 1e-13);
  EXPECT_NEAR(several.assembly().smallest_det(un, modesn) / one.assembly().smallest_det(u, modes1),
              1, 1e-13);
  EXPECT_EQ(dn.components.norm(un), ranks().max(dn.components.norm(un))) << "the same everywhere";
}

SolidParams block(const char *element) {
  auto p = gate_params();
  p.dimension = 3;
  p.depth = 0.03;
  p.elements_across = 2;
  p.elements_along = 12;
  p.elements_deep = 5;
  p.element = element;
  return p;
}

TEST(Ranks, forces_mass_and_energy_are_those_of_one_rank) {
  check_sums<2>(gate_params());
  check_sums<3>(block("incompatible-modes"));
  check_sums<3>(block("q2"));
}

// Newton's method is carried to round-off, where the force that is left over is at most
// round_off_force; it moves the body at most as far as the load did in proportion.
template <int dim> void check_equilibrium(SolidParams p) {
  p.newton_tolerance = 1e-16;
  SolidSolver<dim> one(p), several(p, ranks());
  const auto a = one.solve_static(dead_load(one)), b = several.solve_static(dead_load(several));
  const Eigen::VectorXd whole =
      restricted(a.displacement, one.discretisation(), several.discretisation());
  const double difference = ranks().max((whole - b.displacement).cwiseAbs().maxCoeff()) /
                            a.displacement.cwiseAbs().maxCoeff();
  const double allowed =
      2 * one.assembly().round_off_force(1, 0, a.displacement) / dead_load(one).norm();
  if (ranks().is_root())
    std::printf("%d ranks, %dD %s: static difference %.1e (allowed %.1e)\n", ranks().size(), dim,
                p.element.c_str(), difference, allowed);
  EXPECT_LT(difference, allowed);
}

TEST(Ranks, equilibrium_is_that_of_one_rank) {
  check_equilibrium<2>(gate_params());
  check_equilibrium<3>(block("incompatible-modes"));
}

TEST(Ranks, steps_and_energies_are_those_of_one_rank) {
  auto p = block("incompatible-modes");
  p.newton_tolerance = 1e-16;
  SolidSolver<3> one(p), several(p, ranks());
  SolidState a = one.initial_state(), b = several.initial_state();
  for (int k = 0; k < 5; ++k) {
    a = one.step(a, dead_load(one), 2e-4);
    b = several.step(b, dead_load(several), 2e-4);
  }
  const double c = 4 / (2e-4 * 2e-4); // at least the inertia of a step, per mass
  const double allowed =
      5 * 2 * one.assembly().round_off_force(1, c, a.displacement) / dead_load(one).norm();
  const Eigen::VectorXd whole =
      restricted(a.displacement, one.discretisation(), several.discretisation());
  const double difference = ranks().max((whole - b.displacement).cwiseAbs().maxCoeff()) /
                            a.displacement.cwiseAbs().maxCoeff();
  if (ranks().is_root())
    std::printf("five steps: difference %.1e (allowed %.1e)\n", difference, allowed);
  EXPECT_LT(difference, allowed);
  EXPECT_NEAR(several.kinetic_energy(b) / one.kinetic_energy(a), 1, 2 * allowed);
  EXPECT_NEAR(several.strain_energy(b) / one.strain_energy(a), 1, 2 * allowed);
  EXPECT_NEAR(b.load_work / a.load_work, 1, 2 * allowed);
  const auto end1 = free_end(one.discretisation(), Side::upper),
             endn = free_end(several.discretisation(), Side::upper);
  EXPECT_NEAR(endn.middle(b.displacement).x() / end1.middle(a.displacement).x(), 1, allowed);
}

TEST(Ranks, what_needs_one_rank_is_refused) {
  auto p = gate_params();
  p.linear_solver = "direct";
  EXPECT_THROW(SolidSolver<2>(p, ranks()), UserError);
  SolidSolver<2> several(gate_params(), ranks());
  EXPECT_THROW(several.frequencies(several.initial_state(), 1), UserError);
}

// ---- runs -------------------------------------------------------------------------------------

constexpr const char *case_text = R"([case]
name = "test"
end_time_s = 2e-3
time_step_s = 2e-4
output_interval_s = 1e-3
[bridge]
scheme = "serial-implicit"
[solid]
corner_m = [0.1, 0]
width_m = 0.005
height_m = 0.079
elements_across = 1
elements_along = 28
density_kg_m3 = 1100
youngs_modulus_pa = 12e6
poisson_ratio = 0.4
newton_tolerance = 1e-12
)";

// Of the test program's processes, each of which names its folders alike.
fs::path folder_named(const char *name) {
  const auto folder =
      fs::temp_directory_path() / fmt::format("sluice-ranks-{}-{}", ranks().size(), name);
  if (ranks().is_root()) {
    fs::remove_all(folder);
    fs::create_directories(folder);
  }
  ranks().from_root(0);
  return folder;
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

// A fluid with the solid's mesh and the force of still water, against the solid on `these` ranks.
void couple(const Ranks &these, const fs::path &folder,
            const std::vector<std::string> &overrides = {}, const fs::path &from = {}) {
  const Config config = Config::parse(case_text, "case.toml", overrides);
  const fs::path restart = from.empty() ? from : restart_file(from, "solid", 3);
  if (!these.is_root())
    return run(nullptr, config, folder, restart, these);
  auto [ours, theirs] = bridge::local_transports();
  std::string fluid_error;
  std::thread fluid([&, transport = std::move(theirs)]() mutable {
    try {
      SolidSolver<2> solver(gate_params());
      const auto surface = wetted_interface(solver.discretisation(), Side::upper);
      bridge::Participant bridge("fluid", config, folder, std::move(transport));
      bridge.set_mesh(surface.mesh);
      restore_fluid(bridge, from);
      bridge.initialize();
      while (bridge.is_coupling_ongoing()) {
        bridge.write_data("force", surface.gather(dead_load(solver)));
        bridge.advance(bridge.max_time_step_size());
        if (bridge.requires_writing_restart())
          keep_fluid(bridge, folder);
      }
      bridge.finalize();
    } catch (const std::exception &error) {
      fluid_error = error.what();
    }
  });
  bridge::Participant bridge("solid", config, folder, std::move(ours));
  run(&bridge, config, folder, restart, these);
  fluid.join();
  EXPECT_EQ(fluid_error, "");
}

TEST(Ranks, the_root_speaks_to_the_bridge_for_all) {
  const auto of_all = folder_named("all"), of_one = folder_named("one");
  couple(ranks(), of_all);
  if (!ranks().is_root())
    return;
  couple(Ranks(), of_one);
  for (const char *name : {"tip.csv", "solid_loads.csv", "solid_energy.csv", "reactions.csv"}) {
    const auto a = read_csv(of_one / name), b = read_csv(of_all / name);
    ASSERT_EQ(a.size(), b.size()) << name;
    for (std::size_t column = 0; column < a.back().size(); ++column) {
      double largest = 0; // sums that vanish by symmetry are round-off of the others
      for (const double value : a.back())
        largest = std::max(largest, std::abs(value));
      EXPECT_NEAR(b.back()[column], a.back()[column], 1e-9 * largest) << name << " " << column;
    }
  }
  EXPECT_TRUE(fs::exists(of_all / "solid_0002.pvtu") && fs::exists(of_all / "solid_0002.1.vtu"));
  EXPECT_TRUE(fs::exists(of_all / "solid_state.h5"));
}

// One file for all ranks, with the names that are looked for and pruned like those of one.
TEST(Ranks, a_coupled_run_goes_on_with_the_same_bits) {
  const auto whole = folder_named("whole"), half = folder_named("half"),
             rest = folder_named("rest");
  const std::string every = "bridge.restart_every_windows=1";
  couple(ranks(), whole, {every, "case.end_time_s=1e-3"});
  couple(ranks(), half, {every, "case.end_time_s=6e-4"});
  couple(ranks(), rest, {every, "case.end_time_s=1e-3"}, half);
  if (!ranks().is_root())
    return;
  EXPECT_EQ(read_csv(rest / "tip.csv").back(), read_csv(whole / "tip.csv").back());
  const auto kept =
      std::count_if(fs::directory_iterator(whole), fs::directory_iterator(), [](const auto &entry) {
        return entry.path().filename().string().starts_with("restart_");
      });
  EXPECT_EQ(kept, 2);
  SolidSolver<2> one(gate_params());
  try {
    read_state(restart_file(half, "solid", 3), one.initial_state());
    ADD_FAILURE() << "no error";
  } catch (const UserError &error) {
    EXPECT_NE(std::string(error.what()).find("this one is on 1"), std::string::npos)
        << error.what();
  }
}

// To the tolerance of conjugate gradients in what Newton's method leaves: the set-up of the
// multigrid is no part of the state.
TEST(Ranks, a_release_goes_on_from_its_state_file) {
  const auto whole = folder_named("whole"), first = folder_named("first"),
             rest = folder_named("rest");
  const auto release = [&](const fs::path &folder, const char *end, const fs::path &from) {
    const std::vector<std::string> overrides{std::string("case.end_time_s=") + end};
    run_alone("release", Config::parse(case_text, "case.toml", overrides), {1000, 9.81, 0.14},
              folder, from, ranks());
  };
  release(whole, "2e-3", "");
  release(first, "1e-3", "");
  release(rest, "2e-3", first / "solid_state.h5");
  if (!ranks().is_root())
    return;
  const auto a = read_csv(whole / "tip.csv").back(), b = read_csv(rest / "tip.csv").back();
  EXPECT_EQ(b.front(), 2e-3);
  EXPECT_NEAR(b[1] / a[1], 1, 1e-8);
}

} // namespace
} // namespace sluice::solid

int main(int argc, char **argv) {
  const auto &ranks = sluice::solid::ranks();
  testing::GTEST_FLAG(brief) = !ranks.is_root(); // others print failures only
  testing::InitGoogleTest(&argc, argv);
  const int failed = RUN_ALL_TESTS();
  return static_cast<int>(ranks.max(failed));
}
