// SPDX-License-Identifier: MIT
// Two independent programs, ccx and the deal.II solver, on the same gate with the same element, law
// and load: C3D8 is the plain bilinear element, C3D8I the one with incompatible modes.
#include "bridge/calculix/windows.hpp"
#include "gate_box.hpp"
#include "tests/support/temporary_folder.hpp"
#include "tests/unit/solid/gate.hpp"

#include "solid-dealii/interface.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <fstream>

namespace sluice::calculix {
namespace {

// Newton's iterations to rounding in place of 0.5 % of the mean force.
constexpr const char *tight = "*CONTROLS, PARAMETERS=FIELD\n1e-9, 1e-9\n";

constexpr const char *elements[] = {"q1", "incompatible-modes"};

solid::SolidParams params(const std::string &element) {
  solid::SolidParams params = solid::gate_params();
  params.element = element;
  params.material = "st-venant-kirchhoff";
  params.spectral_radius = 1;
  return params;
}

/// The gate in both programs, and their nodes paired by place.
struct Pair {
  explicit Pair(const std::string &element)
      : solver(params(element)),
        ours(solid::wetted_interface(solver.discretisation(), solid::Side::upper)) {
    BoxParams box = gate_box(element);
    box.spectral_radius = 1; // ALPHA = 0: either method is then the trapezoidal rule
    deck_text = box_deck(box);
    const auto step = deck_text.find("*END STEP");
    deck_text.insert(step, tight);
    theirs = interface_of(parse_deck(deck_text, "gate.inp"), box_interface_set, 2);
  }

  // Values at the interface nodes of deal.II's program, in the order of ccx's.
  std::vector<double> in_their_order(const std::vector<double> &values) const {
    std::vector<double> sorted;
    for (std::size_t a = 0; a < theirs.mesh.n_nodes(); ++a)
      for (std::size_t b = 0; b < ours.mesh.n_nodes(); ++b) {
        const auto x = theirs.mesh.position(a), y = ours.mesh.position(b);
        if (std::hypot(x[0] - y[0], x[1] - y[1]) < 1e-9)
          sorted.insert(sorted.end(), {values[2 * b], values[2 * b + 1]});
      }
    EXPECT_EQ(sorted.size(), values.size()) << "each node has its like";
    return sorted;
  }

  std::vector<NodalForce> their_load() const {
    return theirs.scatter(in_their_order(ours.gather(solid::dead_load(solver))));
  }

  double difference(const NodeField &field, const Eigen::VectorXd &other) const {
    const auto a = theirs.gather(field), b = in_their_order(ours.gather(other));
    double largest = 0, size = 0;
    for (std::size_t k = 0; k < a.size(); ++k) {
      largest = std::max(largest, std::abs(a[k] - b[k]));
      size = std::max(size, std::abs(b[k]));
    }
    return largest / size;
  }

  solid::SolidSolver<2> solver;
  solid::Interface<2> ours;
  std::string deck_text;
  Interface theirs;
};

// One run of ccx for a step of the given kind under the pair's load.
Motion run_ccx(const Pair &pair, const std::string &procedure, const std::string &amplitude) {
  const TemporaryFolder folder;
  std::string input = pair.deck_text.substr(0, pair.deck_text.find("*STEP"));
  if (!amplitude.empty())
    input += "*AMPLITUDE, NAME=LOAD\n" + amplitude + '\n';
  input += "*STEP, NLGEOM, INC=1000\n" + procedure + "\n*RESTART, WRITE\n*CLOAD";
  input += amplitude.empty() ? "\n" : ", AMPLITUDE=LOAD\n";
  for (const auto &[node, force] : pair.their_load())
    for (int d = 0; d < 2; ++d)
      input += fmt::format("{}, {}, {}\n", node, d + 1, as_ccx_reads(force[d]));
  std::ofstream(folder.path() / "once.inp") << input << tight << "*END STEP\n";
  Ccx("ccx", 1, folder.path()).run("once", "one step");
  return read_restart_file(folder.path() / "once.rout");
}

constexpr double dt = 2e-4; // [s]
constexpr int n_steps = 50;

TEST(Peers, static_gate_bends_alike) {
  for (const std::string element : elements) {
    Pair pair(element);
    const Motion theirs = run_ccx(pair, "*STATIC\n0.25, 1.", "");
    const auto ours = pair.solver.solve_static(solid::dead_load(pair.solver));
    const double difference = pair.difference(theirs.displacement, ours.displacement);
    std::printf("%s, static: largest difference %.1e of %.2f mm\n", element.c_str(), difference,
                1e3 * ours.displacement.cwiseAbs().maxCoeff());
    EXPECT_LT(difference, 1e-6) << "the same element to the digits of either Newton iteration";
  }
}

// The water's load comes on within the first step and stays. From rest and with ALPHA = 0 or a
// spectral radius of 1 both programs step by the trapezoidal rule; deal.II's takes the load at the
// middle of a step.
TEST(Peers, gate_under_a_sudden_load_moves_alike) {
  for (const std::string element : elements) {
    Pair pair(element);
    const Motion theirs =
        run_ccx(pair, fmt::format("*DYNAMIC, DIRECT, ALPHA=0.\n{}, {}", dt, n_steps * dt),
                fmt::format("0., 0., {}, 1., 1., 1.", dt));
    const Eigen::VectorXd load = solid::dead_load(pair.solver);
    solid::SolidState ours = pair.solver.step(pair.solver.initial_state(), 0.5 * load, dt);
    for (int k = 1; k < n_steps; ++k)
      ours = pair.solver.step(ours, load, dt);
    const double u = pair.difference(theirs.displacement, ours.displacement);
    const double v = pair.difference(theirs.velocity, ours.velocity);
    std::printf("%s, %d steps: largest difference of displacement %.1e of %.2f mm, "
                "of velocity %.1e\n",
                element.c_str(), n_steps, u, 1e3 * ours.displacement.cwiseAbs().maxCoeff(), v);
    // The modes of C3D8I are unknowns with inertia, those of deal.II's element have none: motion of
    // the length of an element, which shows in the velocity, differs by half a percent.
    EXPECT_LT(u, element == "q1" ? 1e-6 : 1e-3);
    EXPECT_LT(v, element == "q1" ? 1e-6 : 1e-2);
  }
}

// ccx computes the acceleration at the start of every window from M + beta (dt/10)^2 K in place of
// M. What that changes is less than the error of the step itself.
TEST(Peers, what_ccx_does_at_the_start_of_a_window_costs_less_than_the_step) {
  Pair pair("q1");
  const TemporaryFolder folder;
  Windows windows(parse_deck(pair.deck_text, "gate.inp"), "ccx", 1, folder.path());
  const auto their_load = pair.their_load();
  const Eigen::VectorXd load = solid::dead_load(pair.solver);
  Motion theirs;
  solid::SolidState ours = pair.solver.initial_state(), exact = ours;
  constexpr int parts = 8;
  for (int k = 0; k < n_steps; ++k) {
    theirs = windows.solve(their_load, dt);
    windows.accept();
    ours = pair.solver.step(ours, load, dt);
    for (int part = 0; part < parts; ++part)
      exact = pair.solver.step(exact, load, dt / parts);
  }
  const double u = pair.difference(theirs.displacement, ours.displacement);
  const double v = pair.difference(theirs.velocity, ours.velocity);
  const auto relative = [](const Eigen::VectorXd &a, const Eigen::VectorXd &b) {
    return (a - b).cwiseAbs().maxCoeff() / b.cwiseAbs().maxCoeff();
  };
  const double u_step = relative(ours.displacement, exact.displacement);
  const double v_step = relative(ours.velocity, exact.velocity);
  std::printf("%d windows: displacement %.1e, velocity %.1e; the step's own error: %.1e, %.1e\n",
              n_steps, u, v, u_step, v_step);
  EXPECT_LT(u, u_step);
  EXPECT_LT(v, v_step);
}

} // namespace
} // namespace sluice::calculix
