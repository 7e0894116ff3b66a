// SPDX-License-Identifier: MIT
// Orders of convergence by manufactured solutions, and bodies with a known answer: Cook's membrane,
// the elastica, a slender beam. Finer meshes of the same: tests/benchmarks/solid_benchmark.cpp.
#include "gate.hpp"

#include "bridge/mapping_mortar.hpp"
#include "bridge/mapping_projection.hpp"
#include "solid-dealii/cell_system.hpp"
#include "solid-dealii/interface.hpp"

#include <gtest/gtest.h>

#include <numbers>

namespace sluice::solid {
namespace {

using std::numbers::pi;

// ---- manufactured solution ----------------------------------------------------------------------

// A displacement of some 10 % of the square with strains of order one third.
Vec<2> exact(const Vec<2> &x) {
  return 0.1 * Vec<2>(std::sin(pi * x.x()) * std::cos(0.5 * pi * x.y()),
                      std::cos(pi * x.x()) * std::sin(0.5 * pi * x.y() + 0.3));
}

Mat<2> exact_gradient(const Vec<2> &x) {
  const double sx = std::sin(pi * x.x()), cx = std::cos(pi * x.x());
  const double a = 0.5 * pi * x.y(), b = a + 0.3;
  Mat<2> H;
  H << pi * cx * std::cos(a), -0.5 * pi * sx * std::sin(a), -pi * sx * std::sin(b),
      0.5 * pi * cx * std::cos(b);
  return 0.1 * H;
}

Mat<2> first_piola(const Material &material, const Vec<2> &x) {
  const Mat<2> F = Mat<2>::Identity() + exact_gradient(x);
  VoigtResponse<2> r;
  respond<2, VoigtResponse<2>>(material, std::span(&F, 1), {}, std::span(&r, 1));
  return r.stress * r.push;
}

// -Div P by central differences of fourth order: h^4 = 1e-12 and round-off 1e-16/h = 1e-13.
Vec<2> body_force(const Material &material, const Vec<2> &x) {
  constexpr double h = 1e-3;
  Vec<2> divergence = Vec<2>::Zero();
  for (int j = 0; j < 2; ++j) {
    const Vec<2> e = h * Vec<2>::Unit(j);
    divergence += (8 * (first_piola(material, x + e) - first_piola(material, x - e)) -
                   first_piola(material, x + 2 * e) + first_piola(material, x - 2 * e))
                      .col(j) /
                  (12 * h);
  }
  return -divergence;
}

Discretisation<2> square(int n, ElementKind kind) {
  Box<2> box{{0, 0}, {1, 1}, {n, n}, {}};
  box.shape = [](const Vec<2> &x) { // smoothly distorted, so that no cell is special
    return Vec<2>(x.x() + 0.08 * std::sin(pi * x.x()) * std::sin(pi * x.y()),
                  x.y() - 0.06 * std::sin(pi * x.x()) * std::sin(pi * x.y()));
  };
  return discretise(box, kind);
}

// Position of point q of a cell: the mapping is that of the four corners.
Vec<2> position(const Discretisation<2> &d, int cell, int q) {
  Vec<2> x = Vec<2>::Zero();
  for (int a = 0; a < d.nodes_per_cell; ++a)
    x += d.values[static_cast<std::size_t>(q * d.nodes_per_cell + a)] *
         d.nodes[static_cast<std::size_t>(
             d.cell_nodes[static_cast<std::size_t>(cell * d.nodes_per_cell + a)])];
  return x;
}

// L2 norm of the error of the displacement.
double displacement_error(int n, ElementKind kind, const Material &material) {
  const auto d = square(n, kind);
  std::vector<bool> fixed(static_cast<std::size_t>(d.n_dofs()), false);
  Iterate iterate{Eigen::VectorXd::Zero(d.n_dofs()), Eigen::VectorXd::Zero(d.n_modes())};
  for (const auto &face : d.faces)
    for (const int node : face.nodes)
      fixed[static_cast<std::size_t>(2 * node)] = fixed[static_cast<std::size_t>(2 * node + 1)] =
          true;
  for (int a = 0; a < d.n_nodes(); ++a)
    iterate.displacement.segment<2>(2 * a) = exact(d.nodes[static_cast<std::size_t>(a)]);
  Eigen::VectorXd load = Eigen::VectorXd::Zero(d.n_dofs());
  for (int k = 0; k < d.n_cells(); ++k)
    for (int q = 0; q < d.points_per_cell; ++q) {
      const Vec<2> b = weight_at(d, k, q) * body_force(material, position(d, k, q));
      for (int a = 0; a < d.nodes_per_cell; ++a)
        load.segment<2>(2 * d.cell_nodes[static_cast<std::size_t>(k * d.nodes_per_cell + a)]) +=
            d.values[static_cast<std::size_t>(q * d.nodes_per_cell + a)] * b;
    }
  Assembly<2> assembly(d, material, 1, fixed);
  const auto report = Newton<2>(assembly, {1e-12, 30}).solve({1, 0, {}, load}, iterate);
  EXPECT_TRUE(report.has_converged) << report.failure;
  double squared = 0;
  for (int k = 0; k < d.n_cells(); ++k)
    for (int q = 0; q < d.points_per_cell; ++q) {
      Vec<2> u = Vec<2>::Zero();
      for (int a = 0; a < d.nodes_per_cell; ++a)
        u += d.values[static_cast<std::size_t>(q * d.nodes_per_cell + a)] *
             iterate.displacement.segment<2>(
                 2 * d.cell_nodes[static_cast<std::size_t>(k * d.nodes_per_cell + a)]);
      squared += weight_at(d, k, q) * (u - exact(position(d, k, q))).squaredNorm();
    }
  return std::sqrt(squared);
}

double observed_order(ElementKind kind, const Material &material) {
  const double coarse = displacement_error(8, kind, material);
  const double fine = displacement_error(16, kind, material);
  std::printf("element %d: errors %.3e %.3e, order %.2f\n", static_cast<int>(kind), coarse, fine,
              std::log2(coarse / fine));
  return std::log2(coarse / fine);
}

// Quadrature, not the element, limits nothing here: it integrates the same points as the stiffness.
TEST(ManufacturedSolution, displacement_converges_with_the_order_of_the_element) {
  const Material material = make_material("neo-hookean", 1, 0.3);
  EXPECT_GT(observed_order(ElementKind::q1, material), 1.9);
  EXPECT_GT(observed_order(ElementKind::incompatible_modes, material), 1.9);
  EXPECT_GT(observed_order(ElementKind::q2, material), 2.9);
  EXPECT_GT(observed_order(ElementKind::q3, material), 3.8);
}

TEST(ManufacturedSolution, mixed_element_keeps_its_order_next_to_incompressibility) {
  EXPECT_GT(observed_order(ElementKind::q2_p1, make_material("neo-hookean-split", 1, 0.3)), 2.9);
  // The field changes volume by a third: at nu = 0.49 that takes pressures of 17 E.
  EXPECT_GT(observed_order(ElementKind::q2_p1, make_material("neo-hookean-split", 1, 0.49)), 2.7);
}

// ---- patch test under mapped tractions ----------------------------------------------------------

using MapMaker = bridge::Mapping (*)(const bridge::InterfaceMesh &, const bridge::InterfaceMesh &);

// A square between two symmetry planes, pulled to the right by a uniform traction that comes from a
// partner's mesh of `n_partner` segments through the bridge's map. Returns the largest difference
// of the displacement to the uniform state, relative to its largest value.
double mapped_patch_error(MapMaker map_of, int n_solid, int n_partner) {
  SolidParams p;
  p.width = p.height = 1;
  p.elements_across = p.elements_along = n_solid;
  p.element = "incompatible-modes";
  p.density = 1;
  p.youngs_modulus = 1000;
  p.poisson_ratio = 0.3;
  p.boundaries = {{"left", "symmetry", {}}, {"lower", "symmetry", {}}, {"right", "wetted", {}}};
  const double traction = 50;
  SolidSolver<2> solver(p);
  const auto surface = wetted_interface(solver.discretisation(), solver.supports().wetted);
  bridge::InterfaceMesh partner;
  std::vector<double> forces(static_cast<std::size_t>(2 * (n_partner + 1)), 0.0);
  for (int k = 0; k <= n_partner; ++k) {
    partner.positions.insert(partner.positions.end(), {1, double(k) / n_partner});
    if (k < n_partner)
      partner.faces.insert(partner.faces.end(), {k + 1, k});
    forces[static_cast<std::size_t>(2 * k)] =
        traction / n_partner * (k == 0 || k == n_partner ? 0.5 : 1);
  }
  const auto map = map_of(partner, surface.mesh);
  const auto state = solver.solve_static(
      surface.scatter(map.conservative(forces), solver.discretisation().n_dofs()));
  p.boundaries[2].kind = "free";
  p.boundaries[2].traction = {traction, 0};
  SolidSolver<2> exact(p);
  const auto uniform = exact.solve_static(Eigen::VectorXd::Zero(state.displacement.size()));
  return (state.displacement - uniform.displacement).cwiseAbs().maxCoeff() /
         uniform.displacement.cwiseAbs().maxCoeff();
}

// The mortar's rows are integrals over the overlaps of the faces, and its dual functions sum to
// one: a uniform traction arrives as the consistent load, whatever the two meshes.
TEST(Patch, a_uniform_traction_through_the_mortar_gives_uniform_stress_on_any_two_meshes) {
  for (const int n : {1, 3, 4, 7, 18, 37}) {
    const double error = mapped_patch_error(bridge::mortar_map, 4, n);
    std::printf("%d segments on 4 cells: %.1e of the displacement\n", n, error);
    EXPECT_LT(error, 1e-8) << "Newton's tolerance; " << n << " segments";
  }
}

// The projection's are values at the partner's nodes. Where those are among the solid's (or refine
// them) the forces are exact; elsewhere they are a rule of quadrature whose error in a nodal force
// is at most 0.75 (h/H)^2 of it: one kink of the solid's shape function in a segment costs h^2/8
// times the jump of its slope, and it has three.
TEST(Patch, a_uniform_traction_through_the_projection_errs_with_second_order) {
  EXPECT_LT(mapped_patch_error(bridge::projection_map, 4, 4), 1e-8) << "Newton's tolerance";
  EXPECT_LT(mapped_patch_error(bridge::projection_map, 4, 12), 1e-8);
  for (const int n : {7, 18, 37}) {
    const double error = mapped_patch_error(bridge::projection_map, 4, n);
    std::printf("%d segments on 4 cells: %.2e of the displacement\n", n, error);
    EXPECT_LT(error, 0.75 * 16.0 / (n * n));
  }
}

// ---- Cook's membrane ----------------------------------------------------------------------------

// Vertical displacement of the upper right corner [mm]: 48 mm wide, 44 mm high on the left where it
// is clamped, 16 mm on the right where 100 N/mm shear it; E = 240.565 MPa (N, mm).
double cook(const char *element, const char *law, double nu, int n) {
  SolidParams p;
  p.width = 48;
  p.height = 44;
  p.elements_across = p.elements_along = n;
  p.density = 1;
  p.youngs_modulus = 240.565;
  p.poisson_ratio = nu;
  p.clamped_side = "left";
  p.element = element;
  p.material = law;
  Box<2> box{{0, 0}, {48, 44}, {n, n}, {}};
  box.shape = [](const Vec<2> &x) {
    const double s = x.x() / 48, t = x.y() / 44;
    return Vec<2>(x.x(), 44 * s + t * (44 - 28 * s));
  };
  const auto d = discretise(box, element_kind(element));
  Assembly<2> assembly(d, make_material(law, p.youngs_modulus, nu), 1, supports_of(d, p).fixed);
  const Eigen::VectorXd load = traction_forces<2>(
      d, d.boundary("right"), [](const Vec<2> &) { return Vec<2>(0, 100.0 / 16); });
  Newton<2> newton(assembly, {1e-9, 25});
  Iterate iterate{Eigen::VectorXd::Zero(d.n_dofs()), Eigen::VectorXd::Zero(d.n_modes())};
  for (int part = 1; part <= 8; ++part) {
    const auto report = newton.solve({1, 0, {}, part / 8.0 * load}, iterate);
    EXPECT_TRUE(report.has_converged) << element << " " << n << ": " << report.failure;
    if (!report.has_converged)
      return 0;
  }
  return iterate.displacement[2 * d.nearest_node({48, 60}) + 1];
}

// Reference: a third-order element of an independent program with the same law, 16 x 16, 7.775 mm.
TEST(Cook, membrane_at_nu_0_3_bends_as_far_as_the_reference) {
  EXPECT_NEAR(cook("q2", "neo-hookean", 0.3, 16), 7.765, 0.002 * 7.765);
  EXPECT_NEAR(cook("incompatible-modes", "neo-hookean", 0.3, 16), 7.75, 0.01 * 7.75);
  EXPECT_NEAR(cook("q3", "neo-hookean", 0.3, 16), 7.775, 0.001 * 7.775);
}

// At nu = 0.4999 plain elements lock; 8 x 8 of the mixed element are within 1 % of 16 x 16.
TEST(Cook, membrane_next_to_incompressibility_does_not_lock_with_the_mixed_element) {
  const double coarse = cook("q2-p1", "neo-hookean-split", 0.4999, 8);
  const double fine = cook("q2-p1", "neo-hookean-split", 0.4999, 16);
  const double locked = cook("q1", "neo-hookean-split", 0.4999, 8);
  std::printf("nu 0.4999: q2-p1 %.4f %.4f mm, q1 %.4f mm\n", coarse, fine, locked);
  EXPECT_NEAR(coarse / fine, 1, 0.01);
  EXPECT_NEAR(fine, 6.80,
              0.03 * 6.80); // second order 6.758 (16 x 16), incompatible modes 6.672 (8 x 8)
  EXPECT_LT(locked, 0.5 * fine);
}

// ---- elastica -----------------------------------------------------------------------------------

// A strip of unit length, 1/100 high, nu = 0: EI = E h^3/12.
constexpr double strip_height = 0.01, strip_modulus = 12e6;
constexpr double bending_stiffness =
    strip_modulus * strip_height * strip_height * strip_height / 12;

SolidParams strip(int cells) {
  SolidParams p;
  p.width = 1;
  p.height = strip_height;
  p.elements_across = cells;
  p.elements_along = 1;
  p.density = 1000;
  p.youngs_modulus = strip_modulus;
  p.poisson_ratio = 0;
  p.clamped_side = "left";
  p.material = "st-venant-kirchhoff";
  p.newton_max_iterations = 60;
  return p;
}

// Source: elliptic integrals of the inextensible elastica under a dead tip load P, by P L^2/EI.
// Stretch and shear of the strip are of order (h/L)^2 P L^2/EI = 1e-3 at most.
TEST(Elastica, tip_under_a_dead_load_is_that_of_the_inextensible_rod) {
  const struct {
    double load, shortening, deflection;
  } exact_tips[] = {{1, 0.05643323628, 0.3017207736},
                    {4, 0.3289412422, 0.6699641807},
                    {10, 0.5549955978, 0.810609024}};
  for (const auto &tip_exact : exact_tips) {
    SolidSolver<2> solver(strip(50));
    const auto &d = solver.discretisation();
    const double shear = tip_exact.load * bending_stiffness / strip_height; // traction of P
    const Eigen::VectorXd load = traction_forces<2>(
        d, d.boundary("right"), [&](const Vec<2> &) { return Vec<2>(0, shear); });
    const auto state = solver.solve_static(load);
    const auto end = free_end(d, Side::left);
    const Vec<2> u = end.middle(state.displacement);
    std::printf("P L^2/EI = %g: shortening %.5f, deflection %.5f\n", tip_exact.load, -u.x(), u.y());
    EXPECT_NEAR(-u.x(), tip_exact.shortening, 3e-3);
    EXPECT_NEAR(u.y(), tip_exact.deflection, 3e-3);
  }
}

// The strip bent by its end: its end section is put where a circle of that angle ends, and the
// support there must give the moment EI angle/L and, within what the strip stretches, no force.
TEST(Elastica, a_circle_needs_the_moment_of_its_angle_and_no_force) {
  auto params = strip(50);
  params.boundaries = {{"left", "clamped", {}}, {"right", "clamped", {}}};
  const auto d =
      discretise(Box<2>{{0, 0}, {1, strip_height}, {50, 1}, {}}, ElementKind::incompatible_modes);
  const auto supports = supports_of(d, params);
  Assembly<2> assembly(d, make_material(params.material, strip_modulus, 0), 1, supports.fixed);
  Newton<2> newton(assembly, {1e-9, 60});
  Iterate iterate{Eigen::VectorXd::Zero(d.n_dofs()), Eigen::VectorXd::Zero(d.n_modes())};
  const Eigen::VectorXd none = Eigen::VectorXd::Zero(d.n_dofs());
  const double h = strip_height;
  // Where the circle of curvature `angle` carries the material point (x, y) of the strip.
  const auto on_circle = [&](double angle, const Vec<2> &x) -> Vec<2> {
    const double s = angle * x.x(), radius = 1 / angle;
    return Vec<2>(radius * std::sin(s), radius * (1 - std::cos(s)) + 0.5 * h) +
           (x.y() - 0.5 * h) * Vec<2>(-std::sin(s), std::cos(s)) - x;
  };
  for (const double angle : {0.5 * pi, pi, 1.5 * pi, 2 * pi}) {
    for (int a = 0; a < d.n_nodes(); ++a) // a start near the answer: Newton then needs no path
      iterate.displacement.segment<2>(2 * a) =
          on_circle(angle, d.nodes[static_cast<std::size_t>(a)]);
    const auto report = newton.solve({1, 0, {}, none}, iterate);
    ASSERT_TRUE(report.has_converged) << report.failure;
    const Eigen::VectorXd f = assembly.internal_force(iterate.displacement, iterate.modes);
    const Vec<2> centre = Vec<2>(1, 0.5 * h) + on_circle(angle, {1, 0.5 * h});
    Vec<2> force = Vec<2>::Zero();
    double moment = 0;
    for (const int node : d.side_nodes(Side::right)) {
      const Vec<2> x =
          d.nodes[static_cast<std::size_t>(node)] + iterate.displacement.segment<2>(2 * node);
      force += f.segment<2>(2 * node);
      moment += cross(x - centre, f.segment<2>(2 * node));
    }
    const double expected = bending_stiffness * angle;
    std::printf("angle %.3f pi: moment %.5f of EI angle/L, force %.2e EI/L^2\n", angle / pi,
                moment / expected, force.norm() / bending_stiffness);
    EXPECT_NEAR(moment / expected, 1, 5e-3);
    EXPECT_LT(force.norm(), 2e-2 * expected); // per metre of arm
  }
}

TEST(Beam, frequencies_of_a_slender_one_are_those_of_euler_and_bernoulli) {
  SolidSolver<2> solver(strip(60));
  const auto f = solver.frequencies(solver.initial_state(), 3);
  const double unit = std::sqrt(bending_stiffness / (1000 * strip_height)) / (2 * pi);
  const double roots[] = {1.875104069, 4.694091133, 7.854757438};
  for (int k = 0; k < 3; ++k) {
    const double expected = roots[k] * roots[k] * unit;
    std::printf("f%d / Euler-Bernoulli = %.5f\n", k + 1, f[static_cast<std::size_t>(k)] / expected);
    // Rotary inertia and shear lower it by some (roots h/L)^2/2 = 0.3 % at the third.
    EXPECT_NEAR(f[static_cast<std::size_t>(k)] / expected, 1, 5e-3);
  }
}

// ---- locking of the gate ------------------------------------------------------------------------

TEST(Element, the_material_chooses_the_element_unless_the_user_does) {
  auto p = gate_params();
  p.element = "automatic";
  EXPECT_EQ(p.used_element(), "incompatible-modes");
  p.poisson_ratio = 0.499;
  EXPECT_EQ(p.used_element(), "incompatible-modes") << "its law has no volume energy of its own";
  p.material = "neo-hookean-split";
  EXPECT_EQ(p.used_element(), "q2-p1");
  p.element = "q1";
  EXPECT_EQ(p.used_element(), "q1");
}

TEST(Gate, rubber_laws_of_equal_small_strain_modulus_bend_alike) {
  const double mu = 12e6 / 2.8;
  auto p = gate_params();
  SolidSolver<2> reference(p);
  const double ux = tip(reference, reference.solve_static_follower(Side::left, gate_water), 0);
  for (const auto *law : {"neo-hookean-split", "mooney-rivlin", "yeoh", "ogden"}) {
    p.material = law;
    p.c10 = std::string_view(law) == "yeoh" ? 0.5 * mu : 0.4 * mu;
    p.c01 = 0.1 * mu;
    p.ogden_mu = {mu, 0.2 * mu};
    p.ogden_alpha = {1.6, 2};
    SolidSolver<2> solver(p);
    const double other = tip(solver, solver.solve_static_follower(Side::left, gate_water), 0);
    std::printf("%s: %.4f mm, neo-hookean %.4f mm\n", law, 1e3 * other, 1e3 * ux);
    EXPECT_NEAR(other / ux, 1, 0.01);
  }
}

TEST(Gate, mixed_element_is_locking_free_at_nu_0_4999) {
  auto p = gate_params();
  p.poisson_ratio = 0.4999;
  p.material = "neo-hookean-split";
  p.element = "automatic";
  p.elements_along = 28;
  SolidSolver<2> solver(p);
  EXPECT_EQ(solver.discretisation().kind, ElementKind::q2_p1);
  const double ux = tip(solver, solver.solve_static_follower(Side::left, gate_water), 0);
  p.elements_along = 56;
  p.elements_across = 2;
  SolidSolver<2> finer(p);
  const double fine = tip(finer, finer.solve_static_follower(Side::left, gate_water), 0);
  std::printf("nu = 0.4999: %.4f mm with 28 cells, %.4f mm with 2 x 56\n", 1e3 * ux, 1e3 * fine);
  EXPECT_NEAR(ux / fine, 1, 0.01);
}

} // namespace
} // namespace sluice::solid
