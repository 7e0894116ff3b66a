// SPDX-License-Identifier: MIT
#include "gate.hpp"

#include "solid-dealii/state_file.hpp"

#include <gtest/gtest.h>

#include <fstream>

namespace sluice::solid {
namespace {

namespace fs = std::filesystem;

fs::path file_named(const char *name) { return fs::path(testing::TempDir()) / name; }

TEST(StateFile, a_run_goes_on_from_the_file_with_the_same_bits) {
  auto params = gate_params();
  params.viscosity.branch_ratio = 0.3;
  params.viscosity.branch_time = 1e-3;
  SolidSolver<2> solver(params);
  const Eigen::VectorXd load = dead_load(solver);
  SolidState state = solver.initial_state();
  for (int k = 0; k < 5; ++k)
    state = solver.step(state, load, 2e-4);
  EXPECT_GT(state.modes.norm(), 0) << "internal modes belong to the state";
  write_state(file_named("state.h5"), {state, 1e-3});
  SolidSolver<2> another(params);
  const auto saved = read_state(file_named("state.h5"), another.initial_state());
  EXPECT_EQ(saved.time, 1e-3);
  EXPECT_EQ(saved.state.step, 5);
  const auto on = solver.step(state, load, 2e-4), again = another.step(saved.state, load, 2e-4);
  EXPECT_EQ((on.displacement - again.displacement).norm(), 0);
  EXPECT_EQ((on.velocity - again.velocity).norm(), 0);
  EXPECT_EQ((on.modes - again.modes).norm(), 0);
  EXPECT_EQ((on.branch - again.branch).norm(), 0);
  EXPECT_EQ(on.load_work, again.load_work);
  EXPECT_FALSE(fs::exists(file_named("state.h5.part")));
}

TEST(StateFile, a_file_of_another_body_or_no_state_is_refused) {
  SolidSolver<2> solver(gate_params());
  write_state(file_named("gate.h5"), {solver.initial_state(), 0});
  auto other = gate_params();
  other.elements_along = 14;
  const SolidSolver<2> coarse(other);
  try {
    read_state(file_named("gate.h5"), coarse.initial_state());
    FAIL() << "no error";
  } catch (const UserError &error) {
    EXPECT_NE(std::string(error.what()).find("this body has"), std::string::npos) << error.what();
  }
  std::ofstream(file_named("text.h5")) << "not HDF5";
  EXPECT_THROW(read_state(file_named("text.h5"), solver.initial_state()), UserError);
  EXPECT_THROW(read_state(file_named("missing.h5"), solver.initial_state()), UserError);
  EXPECT_THROW(write_state("/nowhere/state.h5", {solver.initial_state(), 0}), UserError);
}

} // namespace
} // namespace sluice::solid
