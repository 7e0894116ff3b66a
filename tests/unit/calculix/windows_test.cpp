// SPDX-License-Identifier: MIT
// Window stepping with the real ccx.
#include "bridge/calculix/windows.hpp"
#include "gate_box.hpp"
#include "tests/unit/bridge/support.hpp"

#include <fstream>
#include <sstream>

namespace sluice::calculix {
namespace {

namespace fs = std::filesystem;
using bridge::contains;
using bridge::error_of;

constexpr double dt = 2e-4; // [s]

struct Gate {
  explicit Gate(const std::string &element, const std::string &more_step = "")
      : Gate(parse_deck(with(box_deck(gate_box(element)), more_step), "gate.inp")) {}
  explicit Gate(Deck own)
      : deck(std::move(own)), surface(interface_of(deck, box_interface_set, 2)),
        windows(deck, "ccx", 1, folder.path() / "calculix") {}

  static std::string with(std::string text, const std::string &more_step) {
    return text.insert(text.find("*END STEP"), more_step);
  }
  std::vector<NodalForce> load(double factor) const {
    auto loads = surface.scatter(water_load(surface.mesh));
    for (NodalForce &load : loads)
      load.force *= factor;
    return loads;
  }
  Motion step(double factor) {
    const Motion motion = windows.solve(load(factor), dt);
    windows.accept();
    return motion;
  }

  TemporaryFolder folder;
  Deck deck;
  Interface surface;
  Windows windows;
};

double factor_of(int window) { return 1 + 0.3 * window; }

void write_file(const fs::path &file, const std::string &text) { std::ofstream(file) << text; }

// The same steps, one after the other in one file, without restart.
Motion in_one_run(const Gate &gate, int n_windows) {
  std::string text;
  for (const Line &line : gate.deck.model)
    text += line.text + '\n';
  for (int k = 1; k <= n_windows; ++k) {
    text += fmt::format("{}\n{}\n{}, {}\n*CLOAD, OP=NEW\n", gate.deck.step[0].text,
                        gate.deck.step[1].text, dt, dt);
    for (const auto &[node, force] : gate.load(factor_of(k)))
      for (int d = 0; d < 3; ++d)
        text += fmt::format("{}, {}, {}\n", node, d + 1, as_ccx_reads(force[d]));
    text += k == n_windows ? "*RESTART, WRITE\n*END STEP\n" : "*END STEP\n";
  }
  write_file(gate.folder.path() / "once.inp", text);
  Ccx("ccx", 1, gate.folder.path()).run("once", "all windows in one run");
  return read_restart_file(gate.folder.path() / "once.rout");
}

double largest_difference(const NodeField &a, const NodeField &b) {
  return (a - b).cwiseAbs().maxCoeff() / b.cwiseAbs().maxCoeff();
}

TEST(Windows, steps_from_restart_files_are_those_of_one_run) {
  for (const char *element : {"q1", "incompatible-modes"}) {
    Gate gate(element);
    Motion motion;
    for (int k = 1; k <= 10; ++k)
      motion = gate.step(factor_of(k));
    const Motion once = in_one_run(gate, 10);
    const double u = largest_difference(motion.displacement, once.displacement);
    const double v = largest_difference(motion.velocity, once.velocity);
    std::printf("%s: displacement %.1e, velocity %.1e\n", element, u, v);
    EXPECT_EQ(u, 0) << "the file holds every bit";
    EXPECT_EQ(v, 0);
    EXPECT_EQ(motion.time, once.time);
  }
}

TEST(Windows, an_iteration_leaves_no_trace) {
  Gate gate("incompatible-modes");
  gate.step(1);
  for (int k = 0; k < 2; ++k) { // in a window from a restart file, and the one after
    const Motion first = gate.windows.solve(gate.load(1), dt);
    const Motion other = gate.windows.solve(gate.load(3), dt);
    const Motion again = gate.windows.solve(gate.load(1), dt);
    EXPECT_GT(largest_difference(other.displacement, first.displacement), 1e-2);
    EXPECT_EQ(again.displacement, first.displacement) << "bit for bit";
    EXPECT_EQ(again.velocity, first.velocity);
    gate.windows.accept();
  }
  EXPECT_EQ(gate.windows.cost().runs, 7);
}

TEST(Windows, forces_of_the_window_before_are_gone) {
  Gate loaded("q1"), never("q1");
  loaded.windows.solve(loaded.load(5), dt);
  const Motion free = loaded.windows.solve({}, dt);
  EXPECT_EQ(free.displacement.cwiseAbs().maxCoeff(), 0);
  loaded.step(1);
  // From the second window on the restart file carries forces; a new card must replace all of them.
  std::vector<NodalForce> one = loaded.load(0);
  one.resize(1);
  const Motion after = loaded.windows.solve(one, dt);
  const Motion zero = loaded.windows.solve(loaded.load(0), dt);
  EXPECT_EQ(after.displacement, zero.displacement);
}

// What ccx prints of the same run, with 7 digits: E13.6.
TEST(Windows, what_is_read_is_what_ccx_prints) {
  Gate gate("incompatible-modes", "*NODE PRINT, NSET=WETTED\nU, V\n");
  gate.step(1);
  const Motion motion = gate.step(2);
  std::ifstream in(gate.folder.path() / "calculix/window.dat");
  const NodeField *field = nullptr;
  int compared = 0;
  for (std::string line; std::getline(in, line);) {
    if (contains(line, "displacements"))
      field = &motion.displacement;
    if (contains(line, "velocities"))
      field = &motion.velocity;
    int node = 0;
    double x = 0, y = 0, z = 0;
    if (std::sscanf(line.c_str(), "%d %lf %lf %lf", &node, &x, &y, &z) != 4)
      continue;
    ASSERT_NE(field, nullptr);
    for (const auto &[printed, d] : {std::pair(x, 0), {y, 1}, {z, 2}})
      EXPECT_NEAR(printed, (*field)(d, node - 1), 0.6e-6 * std::abs(printed));
    ++compared;
  }
  EXPECT_EQ(compared, 2 * 4 * 29);
}

TEST(Windows, loads_and_output_of_the_decks_own_step_stay) {
  const std::string gravity = "*DLOAD\nBODY, GRAV, 9.81, 0., -1., 0.\n";
  Gate gate("q1", gravity), weightless("q1");
  for (int k = 0; k < 3; ++k) {
    const Motion with = gate.step(1), without = weightless.step(1);
    // The free end falls by g t^2 / 2 until the clamp's wave reaches it, 0.8 ms later.
    const double t = (k + 1) * dt;
    const double fall = with.displacement(1, 0) - without.displacement(1, 0);
    EXPECT_NEAR(fall / (-0.5 * 9.81 * t * t), 1, 0.05) << k;
  }
}

TEST(Windows, a_step_that_is_not_direct_ends_with_the_window_too) {
  std::string text = box_deck(gate_box("incompatible-modes"));
  text.replace(text.find(" DIRECT,"), 8, "");
  Gate automatic(parse_deck(text, "gate.inp")), direct("incompatible-modes");
  Motion ours;
  for (int k = 1; k <= 3; ++k)
    ours = automatic.step(k);
  EXPECT_NEAR(ours.time, 3 * dt, 1e-15);
  for (int k = 1; k <= 3; ++k)
    direct.step(k);
  // However it divides the window: time integration errs by less than this, see the README.
  const Motion other = direct.windows.solve(direct.load(1), dt),
               same = automatic.windows.solve(automatic.load(1), dt);
  EXPECT_LT(largest_difference(same.displacement, other.displacement), 0.05);
}

TEST(Windows, no_number_is_longer_than_ccx_reads) {
  for (const double value : {-1.0 / 3, -1e-98 / 3, -1e-120, 1e99 / 3, 0.0, -0.0}) {
    EXPECT_LE(as_ccx_reads(value).size(), 20u) << value;
    EXPECT_NEAR(rounded_as_ccx_reads(value), value, 1e-99 + 5e-14 * std::abs(value));
  }
}

TEST(Windows, a_model_that_ccx_refuses_is_told_with_its_words) {
  Gate gate("q1", "*DLOAD\nNOSUCH, P1, 1.\n");
  const std::string message = error_of([&] { gate.step(1); });
  for (const char *part : {"window 1 (t = 0 to 0.0002 s)", "*ERROR", "NOSUCH", "window.log"})
    EXPECT_TRUE(contains(message, part)) << message;
}

TEST(Windows, a_diverging_window_is_told_and_can_be_solved_again) {
  Gate gate("incompatible-modes");
  gate.step(1);
  const Motion good = gate.windows.solve(gate.load(1), dt);
  const std::string message = error_of([&] { gate.windows.solve(gate.load(1e12), dt); });
  for (const char *part : {"window 2 (t = 0.0002 to 0.0004 s)", "diverge"})
    EXPECT_TRUE(contains(message, part)) << message;
  EXPECT_EQ(gate.windows.solve(gate.load(1), dt).displacement, good.displacement);
}

TEST(Windows, a_restart_file_that_was_damaged_is_told) {
  Gate gate("q1");
  gate.step(1);
  fs::resize_file(gate.folder.path() / "calculix/window.rin", 50000);
  const std::string message = error_of([&] { gate.step(1); });
  EXPECT_TRUE(contains(message, "window 2")) << message;
  EXPECT_TRUE(contains(message, "window.rin")) << message;
}

} // namespace
} // namespace sluice::calculix
