// SPDX-License-Identifier: MIT
// Time of the linear solver on the gate's tank (100 mm x 140 mm, walls on three sides, p = 0 on
// top) against one product with the fine matrix and against the machine's memory bandwidth.
#include "fluid/multigrid.hpp"
#include "tests/support/poisson_cloud.hpp"

#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <functional>

using namespace sluice::fluid;
using namespace sluice::fluid::testing;

namespace {

double best_ms(int repeats, const std::function<void()> &body) {
  double best = 1e300;
  for (int k = 0; k < repeats; ++k) {
    const auto begin = std::chrono::steady_clock::now();
    body();
    const std::chrono::duration<double, std::milli> t = std::chrono::steady_clock::now() - begin;
    best = std::min(best, t.count());
  }
  return best;
}

template <int dim>
void report(const char *name, const Cloud<dim> &cloud, int repeats,
            const Multigrid::Params &params) {
  const int n = cloud.matrix.rows();
  ScaledMatrix matrix;
  Multigrid multigrid(params);
  KrylovMemory memory;
  std::vector<double> b(n, 1.0), x(n), y(n);
  std::vector<float> z(n, 1.0f);
  for (int i = 0; i < n; ++i)
    b[i] = std::sin(0.1 * i) + 1;
  matrix.build(cloud.matrix);
  const double slice = best_ms(repeats, [&] { matrix.build(cloud.matrix); });
  const double set_up = best_ms(repeats, [&] { multigrid.build(matrix, cloud.cell); });
  const double product = best_ms(repeats, [&] {
    for_each_block(n, [&](IndexRange range, int) {
      matrix.multiply(z.data(), range, [&](int i, double value) { y[i] = value; });
    });
  });
  const double cycle = best_ms(repeats, [&] { multigrid.apply(b, z); });
  SolveResult result;
  const double solve = best_ms(repeats, [&] {
    std::fill(x.begin(), x.end(), 0.0);
    result = bicgstab(matrix, b, x, multigrid, {.relative_tolerance = 1e-8}, memory);
  });
  std::printf("%-16s %8d %5.1f/%5.1f %d thr | slice %7.3f set-up %7.3f spmv %7.3f cycle %7.3f "
              "solve %8.3f ms | it %2d%s oc %.2f lev %d | us/pt %.3f\n",
              name, n, cloud.matrix.column.size() / double(n),
              matrix.pattern().stored() / double(n) + 1, number_of_threads(), slice, set_up,
              product, cycle, solve, result.iterations, result.converged ? "" : "!",
              multigrid.operator_complexity(), multigrid.levels(),
              1e3 * (slice + set_up + solve) / n);
  std::fflush(stdout);
}

} // namespace

int main(int argc, char **argv) {
  const int largest = argc > 1 ? std::atoi(argv[1]) : 60000;
  Multigrid::Params params;
  for (const double radius : {2.1, 2.6})
    for (const double jitter : {0.1, 0.25})
      for (const int nx : {50, 100, 200, 845}) {
        const int ny = nx * 7 / 5;
        if (nx * ny > largest)
          continue;
        const auto cloud = make_cloud<2>({.points = {nx, ny}, .jitter = jitter, .radius = radius});
        char name[40];
        std::snprintf(name, sizeof name, "2d r%.1f j%.2f", radius, jitter);
        for (const int threads : {1, 2}) {
          set_number_of_threads(threads);
          report(name, cloud, nx * ny > 100000 ? 3 : 20, params);
        }
      }
  for (const int n : {20, 36, 80})
    if (n * n * n <= largest) {
      const auto cloud = make_cloud<3>({.points = {n, n, n}});
      for (const int threads : {1, 2}) {
        set_number_of_threads(threads);
        report("3d r2.1 j0.25", cloud, n > 50 ? 3 : 20, params);
      }
    }
}
