// SPDX-License-Identifier: MIT
// The multigrid of the fluid against hypre's BoomerAMG, reached through PETSc, on the same
// matrices: set-up, iterations and time of BiCGStab to 1e-6, one thread each. Needs PETSc with
// hypre; built on request only. Usage: hypre_comparison [largest number of points = 250000]
#include "fluid/multigrid.hpp"
#include "tests/support/poisson_cloud.hpp"

#include <petscksp.h>

#include <chrono>
#include <cstdio>
#include <cstdlib>

namespace {

using namespace sluice::fluid;
using namespace sluice::fluid::testing;

struct Result {
  double set_up = 0, solve = 0; // [ms]
  int iterations = 0;
};

template <class Body> double milliseconds(Body &&body) {
  const auto begin = std::chrono::steady_clock::now();
  body();
  return std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - begin)
      .count();
}

// The better of three, as other programs only add time.
template <class Run> Result best(Run &&run) {
  Result result = run();
  for (int k = 0; k < 2; ++k) {
    const Result other = run();
    result.set_up = std::min(result.set_up, other.set_up);
    result.solve = std::min(result.solve, other.solve);
  }
  return result;
}

std::vector<double> right_hand_side(int n) {
  std::vector<double> b(n);
  for (int i = 0; i < n; ++i)
    b[i] = 1 + std::sin(0.1 * i);
  return b;
}

template <int dim> Result ours(const sluice::fluid::testing::Cloud<dim> &cloud) {
  const auto b = right_hand_side(cloud.matrix.rows());
  std::vector<double> x(b.size());
  ScaledMatrix matrix;
  Multigrid multigrid;
  KrylovMemory memory;
  Result result;
  const auto set_up = [&] {
    matrix.build(cloud.matrix);
    multigrid.build(matrix, cloud.cell);
  };
  set_up(); // memory is kept from step to step
  result.set_up = milliseconds(set_up);
  result.solve = milliseconds([&] {
    result.iterations =
        bicgstab(matrix, b, x, multigrid, {.relative_tolerance = 1e-6}, memory).iterations;
  });
  return result;
}

// Rows divided by their diagonal, as ours are.
Mat petsc_matrix(const SparseMatrix &a) {
  const int n = a.rows();
  std::vector<int> length(n);
  for (int i = 0; i < n; ++i)
    length[i] = a.row_start[i + 1] - a.row_start[i];
  Mat matrix;
  MatCreateSeqAIJ(PETSC_COMM_SELF, n, n, 0, length.data(), &matrix);
  std::vector<double> row;
  for (int i = 0; i < n; ++i) {
    row.assign(a.value.begin() + a.row_start[i], a.value.begin() + a.row_start[i + 1]);
    for (double &value : row)
      value /= a.diagonal(i);
    MatSetValues(matrix, 1, &i, length[i], &a.column[a.row_start[i]], row.data(), INSERT_VALUES);
  }
  MatAssemblyBegin(matrix, MAT_FINAL_ASSEMBLY);
  MatAssemblyEnd(matrix, MAT_FINAL_ASSEMBLY);
  return matrix;
}

Result boomeramg(const SparseMatrix &a) {
  const int n = a.rows();
  Mat matrix = petsc_matrix(a);
  Vec b, x;
  MatCreateVecs(matrix, &x, &b);
  const auto values = right_hand_side(n);
  double *entry = nullptr;
  VecGetArray(b, &entry);
  for (int i = 0; i < n; ++i)
    entry[i] = values[i] / a.diagonal(i);
  VecRestoreArray(b, &entry);
  KSP solver;
  KSPCreate(PETSC_COMM_SELF, &solver);
  KSPSetOperators(solver, matrix, matrix);
  KSPSetType(solver, KSPBCGS);
  KSPSetPCSide(solver, PC_RIGHT);
  KSPSetTolerances(solver, 1e-6, 0, 1e10, 1000);
  PC preconditioner;
  KSPGetPC(solver, &preconditioner);
  PCSetType(preconditioner, PCHYPRE);
  PCHYPRESetType(preconditioner, "boomeramg");
  KSPSetFromOptions(solver);
  Result result;
  result.set_up = milliseconds([&] { KSPSetUp(solver); });
  result.solve = milliseconds([&] { KSPSolve(solver, b, x); });
  KSPGetIterationNumber(solver, &result.iterations);
  KSPDestroy(&solver);
  MatDestroy(&matrix);
  VecDestroy(&b);
  VecDestroy(&x);
  return result;
}

template <int dim> void compare(const char *name, const sluice::fluid::testing::Cloud<dim> &cloud) {
  const Result mine = best([&] { return ours<dim>(cloud); });
  const Result hypre = best([&] { return boomeramg(cloud.matrix); });
  std::printf("%-14s %8d | %8.1f %8.1f %3d | %8.1f %8.1f %3d | %5.1f\n", name, cloud.matrix.rows(),
              mine.set_up, mine.solve, mine.iterations, hypre.set_up, hypre.solve, hypre.iterations,
              (hypre.set_up + hypre.solve) / (mine.set_up + mine.solve));
  std::fflush(stdout);
}

} // namespace

int main(int argc, char **argv) {
  const int largest = argc > 1 ? std::atoi(argv[1]) : 250000;
  PetscInitializeNoArguments();
  set_number_of_threads(1);
  std::printf("BiCGStab to 1e-6 from zero, one thread; times in ms; last column: hypre over ours\n"
              "%-14s %8s | %21s | %21s |\n%-14s %8s | %8s %8s %3s | %8s %8s %3s |\n",
              "", "", "ours", "BoomerAMG", "case", "points", "set-up", "solve", "it", "set-up",
              "solve", "it");
  for (const int nx : {54, 100, 200, 400, 845})
    if (nx * (nx * 7 / 5) <= largest)
      compare<2>("2d r2.6 j0.25", make_cloud<2>({.points = {nx, nx * 7 / 5}, .radius = 2.6}));
  for (const int n : {20, 36, 60})
    if (n * n * n <= largest)
      compare<3>("3d r2.6 j0.25", make_cloud<3>({.points = {n, n, n}, .radius = 2.6}));
  PetscFinalize();
}
