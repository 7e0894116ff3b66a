// SPDX-License-Identifier: MIT
// Time of the linear solver on the gate's tank (100 mm x 140 mm, walls on three sides, p = 0 on
// top) and on a cube, against one product with the fine matrix and the machine's bandwidth. Usage:
// linear_solver_benchmark [largest number of points = 60000] [matrix.mtx] With a file name the
// first matrix is also written there, for other solvers to read.
#include "fluid/multigrid.hpp"
#include "tests/support/poisson_cloud.hpp"

#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <fstream>

using namespace sluice::fluid;
using namespace sluice::fluid::testing;

namespace {

using Clock = std::chrono::steady_clock;
using Milliseconds = std::chrono::duration<double, std::milli>;

// Shortest of the runs that fit into half a second, at least three: other programs only add time.
template <class Body> double best_ms(Body &&body) {
  double best = 1e300;
  const auto start = Clock::now();
  for (int k = 0; k < 3 || Clock::now() - start < std::chrono::milliseconds(500); ++k) {
    const auto begin = Clock::now();
    body();
    best = std::min(best, Milliseconds(Clock::now() - begin).count());
  }
  return best;
}

// [GB/s] of a[i] = b[i] + 3 c[i] over `megabytes`, as STREAM counts them.
double triad_bandwidth(int megabytes) {
  const int n = megabytes * 1'000'000 / 24;
  std::vector<double> a(n, 1.0), b(n, 2.0), c(n, 3.0);
  const double ms = best_ms([&] { for_each_index(n, [&](int i) { a[i] = b[i] + 3 * c[i]; }); });
  return 24e-6 * n / ms;
}

struct Times {
  double scale, set_up, product, cycle, cold, warm; // [ms]
  SolveResult cold_result, warm_result;
};

template <int dim> class Benchmark {
public:
  explicit Benchmark(const Cloud<dim> &cloud)
      : cloud_(cloud), n_(cloud.matrix.rows()), b_(n_), x_(n_), y_(n_), z_(n_, 1.0f) {
    for (int i = 0; i < n_; ++i)
      b_[i] = 1 + std::sin(0.1 * i);
  }

  Times run() {
    Times t{};
    t.scale = best_ms([&] { matrix_.build(cloud_.matrix); });
    t.set_up = best_ms([&] { multigrid_.build(matrix_, cloud_.cell); });
    t.product = best_ms([&] { multiply(); });
    t.cycle = best_ms([&] { multigrid_.apply(b_, z_); });
    t.cold = best_ms([&] {
      std::fill(x_.begin(), x_.end(), 0.0);
      t.cold_result = solve(1e-8);
    });
    const std::vector<double> solution = x_;
    for (int i = 0; i < n_; ++i)
      b_[i] *= 1 + 1e-3 * std::cos(0.01 * i);
    t.warm = best_ms([&] {
      x_ = solution;
      t.warm_result = solve(1e-6);
    });
    return t;
  }

  void print(const char *name, const Times &t) const {
    std::printf("%-14s %8d %5.1f %3d | %7.3f %7.3f %7.3f %7.3f | %8.3f %2d%c | %8.3f %2d%c | %.2f "
                "%6.3f\n",
                name, n_, double(matrix_.entries()) / n_, number_of_threads(), t.scale, t.set_up,
                t.product, t.cycle, t.cold, t.cold_result.iterations,
                t.cold_result.converged ? ' ' : '!', t.warm, t.warm_result.iterations,
                t.warm_result.converged ? ' ' : '!', multigrid_.operator_complexity(),
                1e3 * (t.scale + t.set_up + t.warm) / n_);
    std::fflush(stdout);
  }

private:
  void multiply() {
    for_each_block(n_, [&](IndexRange range, int) {
      matrix_.multiply(z_.data(), range, [&](int i, double value) { y_[i] = value; });
    });
  }
  SolveResult solve(double tolerance) {
    return bicgstab(matrix_, b_, x_, multigrid_, {.relative_tolerance = tolerance}, memory_);
  }

  const Cloud<dim> &cloud_;
  int n_;
  ScaledMatrix matrix_;
  Multigrid multigrid_;
  KrylovMemory memory_;
  std::vector<double> b_, x_, y_;
  std::vector<float> z_;
};

template <int dim> void report(const char *name, const Cloud<dim> &cloud) {
  for (const int threads : {1, 2}) {
    set_number_of_threads(threads);
    Benchmark<dim> benchmark(cloud);
    const Times times = benchmark.run();
    benchmark.print(name, times);
  }
}

void report_bandwidth() {
  for (const int threads : {1, 2}) {
    set_number_of_threads(threads);
    std::printf("triad with %d thread(s): %.1f GB/s from memory, %.1f from 10 MB\n", threads,
                triad_bandwidth(1500), triad_bandwidth(10));
  }
}

void report_tanks(int largest) {
  for (const double radius : {2.1, 2.6})
    for (const double jitter : {0.1, 0.25})
      for (const int nx : {50, 100, 200, 845}) {
        const int ny = nx * 7 / 5;
        if (nx * ny > largest)
          continue;
        char name[40];
        std::snprintf(name, sizeof name, "2d r%.1f j%.2f", radius, jitter);
        report(name, make_cloud<2>({.points = {nx, ny}, .jitter = jitter, .radius = radius}));
      }
}

void report_cubes(int largest) {
  for (const int n : {20, 36, 80})
    if (n * n * n <= largest)
      report("3d r2.1 j0.25", make_cloud<3>({.points = {n, n, n}}));
}

} // namespace

int main(int argc, char **argv) {
  const int largest = argc > 1 ? std::atoi(argv[1]) : 60000;
  if (argc > 2) {
    std::ofstream file(argv[2]);
    write_matrix_market(file, make_cloud<2>({.points = {50, 70}}).matrix);
  }
  report_bandwidth();
  std::printf("times in ms; cold: from zero to 1e-8; warm: 1e-3 off, to 1e-6; last column: scale + "
              "set-up + warm, us per point\n"
              "%-14s %8s %5s %3s | %7s %7s %7s %7s | %12s | %12s | oc\n",
              "case", "points", "nnz", "thr", "scale", "set-up", "product", "V-cycle", "cold",
              "warm");
  report_tanks(largest);
  report_cubes(largest);
}
