// SPDX-License-Identifier: MIT
// Time of one fluid step by phase, against the bytes that the phase must move at least and the
// machine's bandwidth in the same run. Scene: the gate's tank with its gate gone, points displaced
// by a fifth of a spacing so that no row is that of a lattice, at the gate's step of 0.4 spacings
// per metre and second. In space the same column, as deep as it is long. Usage:
// fluid_step_benchmark [largest number of points = 60000] [threads = 2] [steps = 20] [smallest = 0]
#include "fluid/step.hpp"

#include <algorithm>
#include <array>
#include <cstdio>
#include <cstdlib>
#include <map>
#include <random>
#include <string>

using namespace sluice;
using namespace sluice::fluid;

namespace {

// [GB/s] of a[i] = b[i] + 3 c[i] over `megabytes`, as STREAM counts them: the best of eight.
double triad_bandwidth(int megabytes) {
  const int n = megabytes * 1'000'000 / 24;
  std::vector<double> a(n, 1.0), b(n, 2.0), c(n, 3.0);
  double best = 1e300;
  for (int k = 0; k < 8; ++k) {
    const Stopwatch watch;
    for_each_index(n, [&](int i) { a[i] = b[i] + 3 * c[i]; });
    best = std::min(best, watch.seconds());
  }
  return 24e-9 * n / best;
}

template <int dim> Scene<dim> column(double spacing) {
  std::string text = fmt::format("[fluid]\nspacing_m = {}\n", spacing);
  text += R"(
dynamic_viscosity_pa_s = 1e-3
open_sides = true
water_m = [[0, 0], [0.1, 0], [0.1, 0.14], [0, 0.14]]
[[fluid.wall]]
name = "tank"
points_m = [[0, 0.3], [0, 0], [0.8, 0]]
)";
  std::vector<std::string> overrides;
  if (dim == 3)
    overrides = {"fluid.dimension=3", "fluid.depth_m=0.1", "fluid.gravity_m_s2=[0, -9.81, 0]"};
  Scene<dim> scene = read_scene<dim>(Config::parse(text, "benchmark", overrides));
  std::mt19937 engine(1);
  std::uniform_real_distribution<double> jitter(-0.2 * spacing, 0.2 * spacing);
  for (Vec<dim> &x : scene.initial.points.position)
    for (int d = 0; d < dim; ++d)
      x[d] += jitter(engine);
  return scene;
}

/// Bytes that a phase must move at least: each array once, nothing that could be kept in a cache
/// between uses. `n` points, `e` pairs of neighbours (both ways), `m` pressure iterations.
template <int dim> std::map<std::string, double> least_bytes(double n, double e, double m) {
  const double vec = 8 * dim, functionals = 8 * n_terms<dim> * dim;
  const double geometry = vec * n + 4 * e;                            // positions and lists
  const double cycle = 2 * 8 * e + 12 * n, product = 12 * e + 24 * n; // of the solve
  return {{"search", vec * n + 4 * e},
          {"cells", geometry + (8 + 2 * vec) * n},
          {"operators", 2 * geometry + 8 * e + (functionals + 2 * vec + 8 * dim * dim + 16) * n},
          {"viscosity", 12 * e + 2 * vec * n},
          {"pressure set-up", 16 * e + 8 * n},
          {"pressure solve", 2 * m * (cycle + product)},
          {"project", geometry + (functionals + 5 * vec + 8 * dim * dim + 8) * n},
          {"move", 6 * vec * n}};
}

struct Timing {
  std::vector<std::pair<std::string, double>> ms; // shortest by phase
  double total = 0, iterations = 0, pairs = 0;
  int most_iterations = 0, points = 0;
};

// Of equal steps, as other programs only add time.
double shortest(const std::vector<double> &values) {
  return *std::min_element(values.begin(), values.end());
}

template <int dim> Timing measure(double spacing, int steps) {
  FluidSolver<dim> solver(column<dim>(spacing));
  const double dt = 0.4 * spacing;
  const auto step = [&] {
    solver.begin_step(dt);
    solver.iterate();
    solver.end_step();
  };
  for (int k = 0; k < 3; ++k)
    step();
  Timing result;
  result.points = solver.state.points.size();
  std::vector<double> whole;
  std::map<std::string, std::vector<double>> by_phase;
  for (int k = 0; k < steps; ++k) {
    const auto before = solver.timer.seconds();
    const Stopwatch watch;
    step();
    whole.push_back(1e3 * watch.seconds());
    for (std::size_t p = 0; p < before.size(); ++p)
      by_phase[before[p].first].push_back(1e3 *
                                          (solver.timer.seconds()[p].second - before[p].second));
    result.iterations += solver.report().pressure_iterations / double(steps);
    result.most_iterations = std::max(result.most_iterations, solver.report().pressure_iterations);
  }
  result.total = shortest(whole);
  for (const int count : solver.cloud().neighbours.count)
    result.pairs += count;
  for (const auto &[name, seconds] : solver.timer.seconds())
    result.ms.emplace_back(name, shortest(by_phase[name]));
  return result;
}

template <int dim> void report(double spacing, int steps, double bandwidth) {
  const Timing t = measure<dim>(spacing, steps);
  std::printf(
      "\n%d-D, %d points, %.1f neighbours, %d thread(s): %.2f ms a step, %.3f us per point, "
      "%.1f iterations (at most %d)\n",
      dim, t.points, t.pairs / t.points, number_of_threads(), t.total, 1e3 * t.total / t.points,
      t.iterations, t.most_iterations);
  const auto bytes = least_bytes<dim>(t.points, t.pairs, t.iterations);
  for (const auto &[name, ms] : t.ms) {
    std::printf("  %-16s %8.3f ms %8.1f ns per point", name.c_str(), ms, 1e6 * ms / t.points);
    if (const auto least = bytes.find(name); least != bytes.end())
      std::printf("  %8.2f MB at least: %5.1f times the bound", 1e-6 * least->second,
                  ms / (1e-6 * least->second / bandwidth));
    std::printf("\n");
  }
  std::fflush(stdout);
}

} // namespace

int main(int argc, char **argv) {
  const int largest = argc > 1 ? std::atoi(argv[1]) : 60000;
  set_number_of_threads(argc > 2 ? std::atoi(argv[2]) : 2);
  const int steps = argc > 3 ? std::atoi(argv[3]) : 20;
  const int smallest = argc > 4 ? std::atoi(argv[4]) : 0;
  const double memory = triad_bandwidth(1500), cache = triad_bandwidth(24);
  std::printf(
      "triad with %d thread(s): %.1f GB/s from memory, %.1f from 24 MB; shortest of %d steps; "
      "bounds by the latter\n",
      number_of_threads(), memory, cache, steps);
  for (const int nx : {54, 100, 200, 400, 845})
    if (const int n = nx * (nx * 7 / 5); n >= smallest && n <= largest)
      report<2>(0.1 / nx, steps, cache);
  for (const int nx : {14, 28, 42, 71})
    if (const int n = nx * nx * (nx * 7 / 5); n >= smallest && n <= largest)
      report<3>(0.1 / nx, steps, cache);
}
