// SPDX-License-Identifier: MIT
#include "fluid/state_file.hpp"
#include "tests/support/fluid_cases.hpp"
#include "tests/support/temporary_folder.hpp"

#include <gtest/gtest.h>

#include <fstream>

namespace sluice::fluid {
namespace {

void advance(FluidSolver<2> &solver, int steps) {
  for (int n = 0; n < steps; ++n) {
    solver.begin_step(5e-4);
    solver.iterate();
    solver.end_step();
  }
}

Scene<2> dam_break() { return testing::scene_of(testing::dam_break, {"fluid.spacing_m=0.004"}); }

FluidState<2> state_after(int steps) {
  FluidSolver<2> solver(dam_break());
  advance(solver, steps);
  return solver.state;
}

void expect_same_bits(const FluidState<2> &a, const FluidState<2> &b) {
  EXPECT_EQ(a.points.position, b.points.position);
  EXPECT_EQ(a.points.velocity, b.points.velocity);
  EXPECT_EQ(a.points.previous_velocity, b.points.previous_velocity);
  EXPECT_EQ(a.points.shift, b.points.shift);
  EXPECT_EQ(a.points.shift_velocity, b.points.shift_velocity);
  EXPECT_EQ(a.points.pressure, b.points.pressure);
  EXPECT_EQ(a.points.id, b.points.id);
  EXPECT_EQ(a.points.at_surface, b.points.at_surface);
  EXPECT_EQ(a.step, b.step);
  EXPECT_EQ(a.step_size, b.step_size);
  EXPECT_EQ(a.wall_returns, b.wall_returns);
  EXPECT_EQ(a.outflow_points, b.outflow_points);
  EXPECT_EQ(a.lost_points, b.lost_points);
  EXPECT_EQ(a.outlet_energy, b.outlet_energy);
  EXPECT_EQ(a.outlet_momentum, b.outlet_momentum);
}

// What read_state says of the file.
std::string complaint(const std::filesystem::path &file) {
  try {
    read_state<2>(file);
  } catch (const UserError &error) {
    return error.what();
  }
  return "";
}

TEST(StateFile, GivesBackEveryBit) {
  const TemporaryFolder folder;
  FluidState<2> state = state_after(12);
  state.wall_returns = 3;
  state.outflow_points = 1'000'000'000'000;
  state.lost_points = 5;
  state.outlet_energy = 1.0 / 3;
  state.outlet_momentum = {-1.0 / 7, 1e-300};
  write_state<2>(folder.path() / "state.h5", {state, 0.006, 0.004});
  const SavedState<2> read = read_state<2>(folder.path() / "state.h5");
  expect_same_bits(read.state, state);
  EXPECT_EQ(read.time, 0.006);
  EXPECT_EQ(read.spacing, 0.004);
}

TEST(StateFile, ARunThatGoesOnFromItTakesTheSameSteps) {
  const TemporaryFolder folder;
  write_state<2>(folder.path() / "state.h5", {state_after(10), 0.005, 0.004});
  Scene<2> scene = dam_break();
  scene.initial = read_state<2>(folder.path() / "state.h5").state;
  FluidSolver<2> solver(scene);
  advance(solver, 10);
  expect_same_bits(solver.state, state_after(20));
}

TEST(StateFile, AnEmptySceneIsAStateToo) {
  const TemporaryFolder folder;
  write_state<2>(folder.path() / "state.h5", {FluidState<2>{}, 0, 0.001});
  EXPECT_EQ(read_state<2>(folder.path() / "state.h5").state.points.size(), 0);
}

TEST(StateFile, AMissingFileAFolderAndATextAreRefusedByName) {
  const TemporaryFolder folder;
  const auto text = folder.path() / "notes.txt";
  std::ofstream(text) << "not a state";
  EXPECT_NE(complaint(folder.path() / "none.h5").find("none.h5: there is no such file"),
            std::string::npos);
  EXPECT_NE(complaint(folder.path()).find("not a readable HDF5 file"), std::string::npos);
  EXPECT_NE(complaint(text).find("notes.txt: not a readable HDF5 file"), std::string::npos);
}

TEST(StateFile, EveryTruncationIsRefused) {
  const TemporaryFolder folder;
  const auto file = folder.path() / "state.h5";
  write_state<2>(file, {state_after(1), 5e-4, 0.004});
  const auto size = std::filesystem::file_size(file);
  for (int k = 0; k < 40; ++k) {
    const auto cut = folder.path() / "cut.h5";
    std::filesystem::copy_file(file, cut, std::filesystem::copy_options::overwrite_existing);
    std::filesystem::resize_file(cut, size * k / 40);
    EXPECT_NE(complaint(cut), "") << "cut at " << size * k / 40 << " of " << size << " bytes";
  }
}

TEST(StateFile, APointThatIsNoNumberIsRefusedByIndex) {
  const TemporaryFolder folder;
  FluidState<2> state = state_after(1);
  state.points.velocity[7].y() = std::nan("");
  write_state<2>(folder.path() / "state.h5", {state, 5e-4, 0.004});
  EXPECT_NE(complaint(folder.path() / "state.h5").find("point 7 "), std::string::npos);
}

TEST(StateFile, ArraysOfUnequalLengthAreRefused) {
  const TemporaryFolder folder;
  FluidState<2> state = state_after(1);
  state.points.pressure.pop_back();
  write_state<2>(folder.path() / "state.h5", {state, 5e-4, 0.004});
  EXPECT_NE(complaint(folder.path() / "state.h5").find("'points/pressure'"), std::string::npos);
}

TEST(StateFile, AFolderThatIsNotThereIsAnErrorAndLeavesNothing) {
  const TemporaryFolder folder;
  EXPECT_THROW(write_state<2>(folder.path() / "none" / "state.h5", {FluidState<2>{}, 0, 1}),
               UserError);
  EXPECT_TRUE(std::filesystem::is_empty(folder.path()));
}

} // namespace
} // namespace sluice::fluid
