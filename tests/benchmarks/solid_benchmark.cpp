// SPDX-License-Identifier: MIT
// The solid's tables: accuracy of the gate against a fine third-order mesh, cost of a step, Cook's
// membrane by mesh, plates of 52,000 and 307,000 unknowns. CPU seconds, so that a busy machine
// shows less.
//
//   build/solid-dealii/solid_benchmark gate | cost | cook
//   [mpirun -n N] build/solid-dealii/solid_benchmark plate ACROSS ALONG DEEP ELEMENT [STEPS]
#include "bridge/base/timer.hpp"
#include "solid-dealii/interface.hpp"
#include "solid-dealii/solid_solver.hpp"

#include <fmt/format.h>
#include <sys/resource.h>

#include <cstdio>
#include <cstring>

namespace sluice::solid {
namespace {

constexpr Hydrostatic water{1000, 9.81, 0.14};

SolidParams gate(const std::string &element, int across, int along, int dim = 2) {
  SolidParams p;
  p.dimension = dim;
  p.corner = {0.1, 0};
  p.width = 0.005;
  p.height = 0.079;
  p.elements_across = across;
  p.elements_along = along;
  p.element = element;
  p.density = 1100;
  p.youngs_modulus = 12e6;
  p.poisson_ratio = 0.4;
  p.linear_solver = "direct";
  return p;
}

template <int dim> Eigen::VectorXd dead_load(const SolidSolver<dim> &s) {
  return pressure_forces(s.discretisation(), Side::left, water, s.initial_state().displacement);
}

template <int dim> Vec<dim> tip(const SolidSolver<dim> &s, const SolidState &x) {
  return free_end(s.discretisation(), s.clamped_side()).middle(x.displacement);
}

// Tip's ux [m] after every step of a suddenly applied load.
std::vector<double> release(SolidSolver<2> &s, double dt, double end) {
  const Eigen::VectorXd load = dead_load(s);
  SolidState state = s.initial_state();
  state.acceleration = s.consistent_acceleration(state, load);
  std::vector<double> ux;
  for (long k = 0, n = std::lround(end / dt); k < n; ++k) {
    state = s.step(state, load, dt);
    ux.push_back(tip(s, state).x());
  }
  return ux;
}

struct GateResult {
  double ux, uy;
  std::vector<double> f, history;
};

GateResult gate_result(const std::string &element, int across, int along, double dt) {
  SolidSolver<2> s(gate(element, across, along));
  const auto rest = s.solve_static_follower(Side::left, water);
  GateResult r{tip(s, rest).x(), tip(s, rest).y(), {}, {}};
  if (s.assembly().n_free() <= 4000)
    r.f = s.frequencies(s.initial_state(), 3);
  if (dt > 0)
    r.history = release(s, dt, 0.1);
  return r;
}

double relative_rms(const std::vector<double> &a, const std::vector<double> &fine, int every) {
  double sum = 0, largest = 0;
  for (std::size_t k = 0; k < a.size(); ++k) {
    const double reference = fine[(k + 1) * static_cast<std::size_t>(every) - 1];
    sum += std::pow(a[k] - reference, 2);
    largest = std::max(largest, std::abs(reference));
  }
  return std::sqrt(sum / static_cast<double>(a.size())) / largest;
}

void gate_table() {
  const GateResult finest = gate_result("q3", 4, 64, 0);
  const GateResult fine = gate_result("q3", 1, 56, 1e-4);
  std::printf("q3 4x64: tip %.4f %.4f mm;  q3 1x56: tip %.4f %.4f mm, f %.4f %.3f %.3f Hz\n",
              1e3 * finest.ux, 1e3 * finest.uy, 1e3 * fine.ux, 1e3 * fine.uy, fine.f[0], fine.f[1],
              fine.f[2]);
  for (const auto &[element, across, along] : {std::tuple{"incompatible-modes", 1, 28},
                                               {"incompatible-modes", 1, 14},
                                               {"incompatible-modes", 2, 56},
                                               {"q1", 1, 28},
                                               {"q2", 1, 28},
                                               {"q3", 1, 28}}) {
    const GateResult r = gate_result(element, across, along, 2e-4);
    std::printf("%-18s %dx%-3d tip %.4f %.4f mm (%+.2f %% of q3 4x64), f %.4f %.3f %.3f Hz (%+.2f "
                "%+.2f %+.2f %%), release %.2f %% rms\n",
                element, across, along, 1e3 * r.ux, 1e3 * r.uy, 100 * (r.ux / finest.ux - 1),
                r.f[0], r.f[1], r.f[2], 100 * (r.f[0] / fine.f[0] - 1),
                100 * (r.f[1] / fine.f[1] - 1), 100 * (r.f[2] / fine.f[2] - 1),
                100 * relative_rms(r.history, fine.history, 2));
  }
}

template <int dim> void cost(SolidParams p) {
  SolidSolver<dim> s(p);
  const Eigen::VectorXd load = dead_load(s);
  SolidState state = s.initial_state();
  for (int k = 0; k < 20; ++k)
    state = s.step(state, load, 2e-4);
  const auto before = s.counts();
  constexpr int n = 200;
  for (int k = 0; k < n; ++k)
    state = s.step(state, load, 2e-4);
  const auto after = s.counts();
  std::printf("%dD %-18s %-18s %5d unknowns: %.3f ms CPU a step, %.2f iterations, %.2f "
              "factorisations\n",
              dim, p.used_element().c_str(), p.material.c_str(), s.assembly().n_free(),
              1e3 * (after.cpu_seconds - before.cpu_seconds) / n,
              static_cast<double>(after.iterations - before.iterations) / n,
              static_cast<double>(after.factorisations - before.factorisations) / n);
}

void cost_table() {
  for (const auto *element : {"incompatible-modes", "q1", "q2", "q3"})
    cost<2>(gate(element, 1, 28));
  for (const auto *law : {"st-venant-kirchhoff", "neo-hookean-split", "mooney-rivlin", "ogden"})
    for (const auto *element : {"incompatible-modes", "q2-p1"}) {
      if (std::strcmp(law, "st-venant-kirchhoff") == 0 && std::strcmp(element, "q2-p1") == 0)
        continue;
      auto p = gate(element, 1, 28);
      const double mu = 12e6 / 2.8;
      p.material = law;
      p.c10 = 0.4 * mu;
      p.c01 = 0.1 * mu;
      p.ogden_mu = {mu, 0.2 * mu};
      p.ogden_alpha = {1.6, 2};
      cost<2>(p);
    }
  auto kept = gate("q2", 1, 28);
  kept.tangent_reuse = 0.3;
  std::printf("factors kept while an iteration leaves 0.3 of the residual:\n");
  cost<2>(kept);
  kept.element = "incompatible-modes";
  cost<2>(kept);
  for (const auto *element : {"incompatible-modes", "q2"})
    cost<3>(gate(element, 1, 28, 3));
}

double cook(const char *element, const char *law, double nu, int n) {
  SolidParams p;
  p.clamped_side = "left";
  Box<2> box{{0, 0}, {48, 44}, {n, n}, {}};
  box.shape = [](const Vec<2> &x) {
    const double s = x.x() / 48, t = x.y() / 44;
    return Vec<2>(x.x(), 44 * s + t * (44 - 28 * s));
  };
  const auto d = discretise(box, element_kind(element));
  Assembly<2> assembly(d, make_material(law, 240.565, nu), 1, supports_of(d, p).fixed);
  const Eigen::VectorXd load = traction_forces<2>(
      d, d.boundary("right"), [](const Vec<2> &) { return Vec<2>(0, 100.0 / 16); });
  Newton<2> newton(assembly, {1e-9, 25}, LinearSolverKind::direct);
  Iterate iterate{Eigen::VectorXd::Zero(d.n_dofs()), Eigen::VectorXd::Zero(d.n_modes())};
  for (double reached = 0, part = 0.125; reached < 1;) {
    const double target = std::min(1.0, reached + part);
    Iterate trial = iterate;
    if (newton.solve({1, 0, {}, target * load}, trial).has_converged) {
      iterate = trial;
      reached = target;
      part *= 2;
    } else if ((part /= 2) < 1e-4)
      return std::nan("");
  }
  return iterate.displacement[2 * d.nearest_node({48, 60}) + 1];
}

void cook_table() {
  std::printf(
      "element, law, nu: uy of the upper right corner [mm] with 2, 4, 8, 16, 32 cells a side\n");
  for (const double nu : {0.3, 0.4999})
    for (const auto &[element, law] : {std::pair{"q1", "neo-hookean"},
                                       {"incompatible-modes", "neo-hookean"},
                                       {"q2", "neo-hookean"},
                                       {"q3", "neo-hookean"},
                                       {"incompatible-modes", "neo-hookean-split"},
                                       {"q2-p1", "neo-hookean-split"},
                                       {"q3", "neo-hookean-split"}}) {
      std::printf("%-18s %-18s %.4f:", element, law, nu);
      for (const int n : {2, 4, 8, 16, 32}) {
        if (n == 32 && std::strcmp(element, "q3") == 0)
          continue; // 19,000 unknowns by a direct solver
        std::printf(" %.4f", cook(element, law, nu, n));
        std::fflush(stdout);
      }
      std::printf("\n");
    }
}

double peak_memory_gb() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  return static_cast<double>(usage.ru_maxrss) / 1048576;
}

// Seconds since the last call, of the slowest rank: CPU and wall time as text. Waiting for another
// rank is CPU time too.
class Lap {
public:
  explicit Lap(const Ranks &ranks) : ranks_(ranks) {}
  std::string operator()(int parts = 1) {
    const double cpu = process_cpu_time(), wall = watch_.seconds();
    const auto text = fmt::format("{:.3f} s CPU, {:.3f} s wall", ranks_.max(cpu - cpu_) / parts,
                                  ranks_.max(wall - wall_) / parts);
    cpu_ = process_cpu_time();
    wall_ = watch_.seconds();
    return text;
  }

private:
  Ranks ranks_;
  Stopwatch watch_;
  double cpu_ = process_cpu_time(), wall_ = 0;
};

// One linearisation at rest of a square plate, static (K) and dynamic (K + 1e8 rho M, about a step
// of 2e-4 s), then `steps` in time. On all ranks of mpirun.
void plate(int across, int along, int deep, const char *element, int steps) {
  auto p = gate(element, across, along, 3);
  p.elements_deep = deep;
  p.depth = 0.079;
  p.linear_solver = "cg";
  const Ranks ranks = Ranks::of_launch();
  const auto say = [&](const std::string &text) {
    if (ranks.is_root())
      fmt::print("{}\n", text);
    std::fflush(stdout);
  };
  Lap lap(ranks);
  SolidSolver<3> s(p, ranks);
  auto &assembly = const_cast<Assembly<3> &>(s.assembly());
  const auto rest = s.initial_state();
  say(fmt::format("{} {}x{}x{}, {} ranks: {} unknowns, {:.1f} M entries", element, across, along,
                  deep, ranks.size(), assembly.n_free_of_all(),
                  1e-6 * ranks.sum(static_cast<double>(assembly.tangent().nonZeros()))));
  say("  set-up of the body " + lap());
  assembly.linearise(rest.displacement, rest.modes);
  say("  assembly " + lap());
  const Eigen::VectorXd load = dead_load(s), right = assembly.restrict_to_free(load);
  for (const double c : {0.0, 1e8}) {
    const SparseMatrix matrix = assembly.tangent() + c * assembly.mass();
    LinearSolver cg(matrix, LinearSolverKind::cg, [&] { return assembly.rigid_motions(); });
    lap();
    cg.factorise(matrix);
    say(fmt::format("  {}: multigrid {}", c > 0 ? "dynamic" : "static", lap()));
    cg.solve(right);
    say(fmt::format("    CG to {:.0e} {} ({} iterations)", LinearSolver::cg_tolerance, lap(),
                    cg.last_iterations()));
  }
  SolidState state = rest;
  lap();
  for (int k = 0; k < steps; ++k)
    state = s.step(state, load, 2e-4);
  const std::string time = lap(steps);
  say(fmt::format("  {} steps of 2e-4 s: {} a step, {:.1f} Newton and {:.1f} CG iterations; peak "
                  "memory of a rank {:.2f} GB",
                  steps, time, static_cast<double>(s.counts().iterations) / steps,
                  static_cast<double>(s.counts().linear_iterations) / steps,
                  ranks.max(peak_memory_gb())));
}

} // namespace
} // namespace sluice::solid

int main(int argc, char **argv) {
  using namespace sluice::solid;
  const std::string what = argc > 1 ? argv[1] : "";
  try {
    if (what == "gate")
      gate_table();
    else if (what == "cost")
      cost_table();
    else if (what == "cook")
      cook_table();
    else if (what == "plate" && argc >= 6)
      plate(std::atoi(argv[2]), std::atoi(argv[3]), std::atoi(argv[4]), argv[5],
            argc > 6 ? std::atoi(argv[6]) : 5);
    else {
      std::fprintf(
          stderr, "solid_benchmark gate | cost | cook | plate ACROSS ALONG DEEP ELEMENT [STEPS]\n");
      return 2;
    }
  } catch (const std::exception &error) {
    std::fprintf(stderr, "solid_benchmark: %s\n", error.what());
    return 1;
  }
  return 0;
}
