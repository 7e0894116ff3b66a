// SPDX-License-Identifier: MIT
#include "gate.hpp"

#include <gtest/gtest.h>

namespace sluice::solid {
namespace {

SolidParams plate(const char *linear_solver) {
  auto p = gate_params();
  p.dimension = 3;
  p.depth = 0.04;
  p.elements_across = 2;
  p.elements_along = 12;
  p.elements_deep = 6;
  p.linear_solver = linear_solver;
  return p;
}

// Places of the symmetry planes' fixed components are among the multigrid's blocks.
TEST(LinearSolver, conjugate_gradients_give_the_direct_solution) {
  SolidSolver<3> direct(plate("direct")), cg(plate("cg"));
  const auto a = direct.solve_static(1e-2 * dead_load(direct)),
             b = cg.solve_static(1e-2 * dead_load(cg));
  // Newton's tolerance, 1e-9 of the force.
  EXPECT_LT((a.displacement - b.displacement).norm(), 1e-7 * a.displacement.norm());
  EXPECT_EQ(direct.counts().linear_iterations, 0);
  EXPECT_GT(cg.counts().linear_iterations, 0);
}

TEST(LinearSolver, automatic_takes_the_direct_one_for_few_unknowns) {
  SolidSolver<3> solver(plate("automatic"));
  EXPECT_LT(solver.assembly().n_free(), LinearSolver::most_for_direct);
  solver.solve_static(dead_load(solver));
  EXPECT_EQ(solver.counts().linear_iterations, 0);
}

// With the rotations kept, iterations grow slowly with the mesh: work, not time.
TEST(LinearSolver, multigrid_knows_the_rotations_of_a_thin_body) {
  std::vector<int> iterations;
  for (const int refined : {1, 2}) {
    auto p = plate("cg");
    p.elements_across *= refined;
    p.elements_along *= refined;
    p.elements_deep *= refined;
    SolidSolver<3> solver(p);
    auto &assembly = const_cast<Assembly<3> &>(solver.assembly());
    const auto rest = solver.initial_state();
    assembly.linearise(rest.displacement, rest.modes);
    LinearSolver cg(assembly.tangent(), LinearSolverKind::cg,
                    [&] { return assembly.rigid_motions(); });
    ASSERT_TRUE(cg.factorise(assembly.tangent()));
    const Eigen::VectorXd right = assembly.restrict_to_free(dead_load(solver));
    const Eigen::VectorXd x = cg.solve(right);
    EXPECT_LT((assembly.tangent() * x - right).norm(),
              2 * LinearSolver::cg_tolerance * right.norm());
    iterations.push_back(cg.last_iterations());
  }
  std::printf("iterations: %d, refined %d\n", iterations[0], iterations[1]);
  EXPECT_LT(iterations[1], 60);
  EXPECT_LT(iterations[1], 2 * iterations[0]);
}

TEST(LinearSolver, set_up_is_used_again_while_it_serves) {
  SolidSolver<3> solver(plate("direct"));
  auto &assembly = const_cast<Assembly<3> &>(solver.assembly());
  const auto rest = solver.initial_state();
  assembly.linearise(rest.displacement, rest.modes);
  const SparseMatrix first = assembly.tangent();
  LinearSolver cg(first, LinearSolverKind::cg, [&] { return assembly.rigid_motions(); });
  const Eigen::VectorXd right = assembly.restrict_to_free(dead_load(solver));
  cg.factorise(first);
  cg.solve(right);
  const SparseMatrix near = 1.1 * first;
  cg.factorise(near);
  cg.solve(right);
  EXPECT_EQ(cg.set_ups(), 1) << "a multiple of the same matrix";
  const SparseMatrix far = first + 1e9 * assembly.mass();
  cg.factorise(far);
  cg.solve(right);
  cg.factorise(far);
  EXPECT_LE(cg.set_ups(), 2);
}

// K - 1.5 omega^2 M with the first frequency by Rayleigh's quotient of the bent plate: one negative
// eigenvalue, as beyond a limit point. MINRES ends where the residual in the norm of its
// preconditioner has fallen by cg_tolerance.
TEST(LinearSolver, an_indefinite_matrix_is_solved_too) {
  SolidSolver<3> solver(plate("direct"));
  auto &assembly = const_cast<Assembly<3> &>(solver.assembly());
  const auto rest = solver.initial_state();
  assembly.linearise(rest.displacement, rest.modes);
  const SparseMatrix &stiffness = assembly.tangent(), &mass = assembly.mass();
  const Eigen::VectorXd right = assembly.restrict_to_free(dead_load(solver));
  LinearSolver direct(stiffness),
      fresh(stiffness, LinearSolverKind::cg, [&] { return assembly.rigid_motions(); });
  direct.factorise(stiffness);
  const Eigen::VectorXd bent = direct.solve(right);
  const SparseMatrix indefinite =
      stiffness - 1.5 * bent.dot(stiffness * bent) / bent.dot(mass * bent) * mass;
  EXPECT_LT(bent.dot(indefinite * bent), 0);
  fresh.factorise(indefinite);
  const Eigen::VectorXd x = fresh.solve(right);
  EXPECT_LT((indefinite * x - right).norm(), 100 * LinearSolver::cg_tolerance * right.norm())
      << "another norm, and MINRES knows its residual by recurrence only";
  direct.factorise(indefinite);
  const Eigen::VectorXd exact = direct.solve(right);
  EXPECT_LT((x - exact).norm(), 1e-4 * exact.norm()) << "of the softest mode";

  LinearSolver warned(stiffness, LinearSolverKind::cg, [&] { return assembly.rigid_motions(); });
  warned.factorise(stiffness);
  warned.solve(right);
  warned.factorise(indefinite);
  EXPECT_LT((warned.solve(right) - exact).norm(), 1e-4 * exact.norm());
  EXPECT_EQ(warned.set_ups(), 1);
  EXPECT_LT(warned.last_iterations(), fresh.last_iterations() / 2) << "with an earlier multigrid";
  std::printf("MINRES: %d iterations, with the multigrid of an earlier matrix %d\n",
              fresh.last_iterations(), warned.last_iterations());
}

TEST(Newton, factors_that_are_kept_lead_to_the_same_equilibrium_with_fewer_of_them) {
  auto p = gate_params();
  p.element = "q2";
  SolidSolver<2> each(p);
  p.tangent_reuse = 0.3;
  SolidSolver<2> kept(p);
  SolidState a = each.initial_state(), b = a;
  const Eigen::VectorXd load = dead_load(each);
  for (int k = 0; k < 20; ++k) {
    a = each.step(a, load, 2e-4);
    b = kept.step(b, load, 2e-4);
  }
  EXPECT_NEAR(tip(kept, b, 0) / tip(each, a, 0), 1, 1e-7);
  EXPECT_LT(kept.counts().factorisations, each.counts().factorisations);
  std::printf("factorisations: %ld of %ld\n", kept.counts().factorisations,
              each.counts().factorisations);
}

} // namespace
} // namespace sluice::solid
