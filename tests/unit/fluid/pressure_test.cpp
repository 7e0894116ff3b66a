// SPDX-License-Identifier: MIT
#include "fluid/multigrid.hpp"
#include "fluid/pressure.hpp"
#include "fluid/pressure_stencil.hpp"
#include "tests/support/fluid_cases.hpp"

#include <gtest/gtest.h>

#include <functional>
#include <numbers>

namespace sluice::fluid {
namespace {

using testing::FrozenCloud;

constexpr double density = 1000, dt = 1e-3;

/// A field and its gradient.
struct Field {
  std::function<double(Vec<2>)> value;
  std::function<Vec<2>(Vec<2>)> gradient;
};

/// The pressure problem whose exact solution is the field: u* = dt / rho grad p, walls at rest.
struct Problem {
  FrozenCloud frozen;
  PressureParams params;
  PressureProblem<2> pressure;
  std::vector<Vec<2>> predicted;
  std::vector<double> target;

  Problem(FrozenCloud cloud, const std::function<Vec<2>(Vec<2>)> &velocity, double guard = 0.1,
          PressureOperators operators = PressureOperators::quadratic)
      : frozen(std::move(cloud)), target(frozen.size(), 0) {
    params.density = density;
    params.row_guard = guard;
    params.operators = operators;
    predicted = frozen.values(velocity);
    assemble_pressure_operators(frozen.points, frozen.cloud, params, pressure);
    assemble_pressure_source(frozen.points, frozen.cloud, params, predicted, target, dt, pressure);
    set_wall_velocity(frozen.walls, frozen.cloud, params, dt, pressure);
  }
  double row_times(int i, const std::vector<double> &p) const {
    double total = pressure.matrix.diagonal[i] * p[i];
    pressure.matrix.for_each_entry(i, [&](int j, double value) { total += value * p[j]; });
    return total;
  }
  Vec<2> gradient(int i, const std::vector<double> &p) const {
    return pressure_gradient(i, frozen.points, frozen.cloud, pressure, p);
  }
  /// Laplacian of the row, walls included, where the field's exact source is known.
  double defect(int i, const std::vector<double> &p) const {
    return row_times(i, p) - pressure.source[i];
  }
};

Problem problem_of(const Field &field, FrozenCloud cloud, double guard = 0.1,
                   PressureOperators operators = PressureOperators::quadratic) {
  return Problem(
      std::move(cloud), [&](const Vec<2> &x) { return Vec<2>(dt / density * field.gradient(x)); },
      guard, operators);
}

constexpr double no_guard = 1e30;
constexpr double h = 0.1;

FrozenCloud jittered_box(double jitter = 0.15, unsigned seed = 1) {
  return FrozenCloud(testing::lattice(12, 10, h, jitter, seed), testing::closed_box(1.2, 1), h);
}

const Field linear{[](Vec<2> x) { return 3 + 2 * x.x() - 5 * x.y(); },
                   [](Vec<2>) { return Vec<2>(2, -5); }};
const Field quadratic{
    [](Vec<2> x) { return 1 - 2 * x.y() + x.x() * x.x() - 3 * x.x() * x.y() + 2 * x.y() * x.y(); },
    [](Vec<2> x) { return Vec<2>(2 * x.x() - 3 * x.y(), -2 - 3 * x.x() + 4 * x.y()); }};

// Sums run in the same order; the two differ by the rounding of fused operations, amplified by the
// condition of the fit (a few hundred).
TEST(Pressure, RowsOfEightPointsAtOnceAreThoseOfSinglePoints) {
  Problem problem = problem_of(quadratic, jittered_box());
  const PressureProblem<2> packed = problem.pressure;
  const auto &pattern = packed.matrix.pattern;
  for (int i = 0; i < problem.frozen.size(); ++i) {
    const RowKind kind = assemble_pressure_row(i, problem.frozen.points, problem.frozen.cloud,
                                               problem.params, problem.pressure);
    EXPECT_EQ(kind, packed.row_kind[i]);
    EXPECT_NEAR(packed.matrix.diagonal[i], problem.pressure.matrix.diagonal[i], 1e-12);
    EXPECT_NEAR((packed.gradient[i] - problem.pressure.gradient[i]).norm() * h, 0, 1e-12);
    for (int k = 0; k < pattern.width(i); ++k)
      EXPECT_NEAR(packed.matrix.off_diagonal[pattern.place(i, k)],
                  problem.pressure.matrix.off_diagonal[pattern.place(i, k)], 1e-12);
  }
}

TEST(Pressure, GradientOfALinearFieldIsExactOnAJitteredCloudBetweenWalls) {
  for (const double guard : {no_guard, 0.1, 0.0}) { // with every kind of row
    const Problem problem = problem_of(linear, jittered_box(), guard);
    const auto p = problem.frozen.values(linear.value);
    for (int i = 0; i < problem.frozen.size(); ++i) {
      EXPECT_NEAR((problem.gradient(i, p) - Vec<2>(2, -5)).norm(), 0, 1e-11);
    }
  }
}

TEST(Pressure, GradientAndRowsAreExactForQuadraticFieldsUpToTheWalls) {
  const Problem problem = problem_of(quadratic, jittered_box(), no_guard);
  const auto p = problem.frozen.values(quadratic.value);
  // u* is linear, so velocity gradients and wall data are exact; condition of the fit: 1e3. Where
  // the cloud hardly determines the quadratic (a few rows in corners) a linear row takes its place.
  int exact_rows = 0;
  for (int i = 0; i < problem.frozen.size(); ++i) {
    const Vec<2> exact = quadratic.gradient(problem.frozen.points.position[i]);
    exact_rows +=
        (problem.gradient(i, p) - exact).norm() < 1e-10 && std::abs(problem.defect(i, p)) < 1e-10;
  }
  std::printf("%d of %d rows exact for quadratics\n", exact_rows, problem.frozen.size());
  EXPECT_GE(exact_rows, problem.pressure.rows.quadratic);
  EXPECT_GE(problem.pressure.rows.quadratic, 0.9 * problem.frozen.size());
}

TEST(Pressure, ThePublishedOperatorsAreExactForLinearFields) {
  const Problem problem =
      problem_of(linear, jittered_box(0.2), no_guard, PressureOperators::renormalised);
  EXPECT_EQ(problem.pressure.rows.linear, problem.frozen.size());
  const auto p = problem.frozen.values(linear.value);
  for (int i = 0; i < problem.frozen.size(); ++i) {
    EXPECT_NEAR(problem.defect(i, p), 0, 1e-10);
    EXPECT_NEAR((problem.gradient(i, p) - Vec<2>(2, -5)).norm(), 0, 1e-11);
  }
}

// A blended row passes the guard, and a 64th less of the other row would not do: it passes by
// little.
TEST(Pressure, BlendedRowsPassTheGuardByLittle) {
  constexpr double guard = 0.02;
  const Problem problem = problem_of(linear, jittered_box(0.3), guard);
  int blended = 0;
  for (int i = 0; i < problem.frozen.size(); ++i) {
    if (problem.pressure.row_kind[i] != RowKind::blended)
      continue;
    double negative = 0, positive = 0;
    problem.pressure.matrix.for_each_entry(
        i, [&](int, double entry) { (entry > 0 ? negative : positive) += std::abs(entry); });
    EXPECT_LE(negative, guard * positive * (1 + 1e-12));
    EXPECT_GT(negative, 0);
    ++blended;
  }
  EXPECT_GT(blended, 0);
}

TEST(Pressure, RowsOfTheFallbackAreExactForLinearFields) {
  // a guard of zero refuses every row with a negative weight
  const Problem problem = problem_of(linear, jittered_box(0.3), 0.0);
  EXPECT_GT(problem.pressure.rows.blended, 0);
  const FrozenCloud &frozen = problem.frozen;
  const auto p = frozen.values(linear.value);
  int checked = 0;
  for (int i = 0; i < frozen.size(); ++i)
    if (problem.pressure.rows.plain == 0 || !frozen.cloud.walls_of(i) ||
        frozen.cloud.walls_of(i)->count == 0) {
      EXPECT_NEAR(problem.defect(i, p), 0, 1e-10);
      ++checked;
    }
  std::printf("%d rows checked, %d linear, %d plain\n", checked, problem.pressure.rows.linear,
              problem.pressure.rows.plain);
}

TEST(Pressure, GradientAndLaplacianConverge) {
  const double k = std::numbers::pi;
  const Field wave{[=](Vec<2> x) { return std::sin(k * x.x() + 0.3) * std::cos(k * x.y() + 0.5); },
                   [=](Vec<2> x) {
                     return Vec<2>(k * std::cos(k * x.x() + 0.3) * std::cos(k * x.y() + 0.5),
                                   -k * std::sin(k * x.x() + 0.3) * std::sin(k * x.y() + 0.5));
                   }};
  std::vector<double> spacing, gradient_error, laplacian_error;
  for (const int n : {16, 32, 64}) {
    const double s = 1.0 / n;
    const Problem problem = problem_of(
        wave, FrozenCloud(testing::lattice(n, n, s, 0.2, n), testing::closed_box(1, 1), s));
    const FrozenCloud &frozen = problem.frozen;
    const auto p = frozen.values(wave.value);
    double gradient = 0, laplacian = 0;
    int count = 0;
    for (int i = 0; i < frozen.size(); ++i) {
      const Vec<2> x = frozen.points.position[i];
      if ((x - Vec<2>(0.5, 0.5)).cwiseAbs().maxCoeff() > 0.3)
        continue;
      gradient += (problem.gradient(i, p) - wave.gradient(x)).squaredNorm();
      const double exact = -2 * k * k * wave.value(x);
      laplacian += std::pow(-problem.row_times(i, p) / (s * s) - exact, 2);
      ++count;
    }
    spacing.push_back(s);
    gradient_error.push_back(std::sqrt(gradient / count));
    laplacian_error.push_back(std::sqrt(laplacian / count));
    std::printf("n = %2d: gradient %.3e, Laplacian %.3e, rows %d / %d / %d\n", n,
                gradient_error.back(), laplacian_error.back(), problem.pressure.rows.quadratic,
                problem.pressure.rows.linear, problem.pressure.rows.plain);
  }
  const double gradient_order = testing::fitted_order(spacing, gradient_error);
  const double laplacian_order = testing::fitted_order(spacing, laplacian_error);
  std::printf("orders: gradient %.2f, Laplacian %.2f\n", gradient_order, laplacian_order);
  EXPECT_GE(gradient_order, 1.8);  // quadratic fit: 2, less 0.2
  EXPECT_GE(laplacian_order, 0.8); // 1, less 0.2
}

// Largest ratio of negative to positive neighbour weights in the rows of interior points.
double worst_ratio(const Problem &problem) {
  double worst = 0;
  const SparseMatrix matrix = compressed(problem.pressure.matrix);
  for (int i = 0; i < matrix.rows(); ++i) {
    double negative = 0, positive = 0;
    for (int k = matrix.row_start[i] + 1; k < matrix.row_start[i + 1]; ++k)
      (matrix.value[k] > 0 ? negative : positive) += std::abs(matrix.value[k]);
    if (positive > 0 || negative > 0)
      worst = std::max(worst, negative / positive);
  }
  return worst;
}

TEST(Pressure, NoRowHasMoreNegativeWeightThanTheGuardAllows) {
  for (const unsigned seed : {1u, 2u, 3u}) {
    const auto cloud = [&] {
      return FrozenCloud(testing::random_points(150, {1.2, 1}, seed), testing::closed_box(1.2, 1),
                         h);
    };
    const auto at_rest = [](const Vec<2> &) { return Vec<2>(0, 0); };
    const double guarded = worst_ratio(Problem(cloud(), at_rest));
    const double unguarded = worst_ratio(Problem(cloud(), at_rest, no_guard));
    std::printf("random cloud: worst ratio %.3f, %.3f without the guard\n", guarded, unguarded);
    EXPECT_LE(guarded, 0.1 * (1 + 1e-12));
    EXPECT_GT(unguarded, 0.2); // the guard has something to do
  }
}

TEST(Pressure, DiagonalsArePositiveAndInteriorRowsSumToZero) {
  const Problem problem(jittered_box(0.3), [](const Vec<2> &) { return Vec<2>(0, 0); });
  const std::vector<double> ones(problem.frozen.size(), 1.0);
  for (int i = 0; i < problem.frozen.size(); ++i) {
    EXPECT_GT(problem.pressure.matrix.diagonal[i], 0);
    EXPECT_NEAR(problem.row_times(i, ones), 0, 1e-12);
  }
}

// --- with the solver ------------------------------------------------------------------------

TEST(PressureSolve, StillWaterHasHydrostaticPressureAndNoAccelerationAtEveryPoint) {
  FluidSolver<2> solver(
      testing::scene_of(testing::gate_tank(), {"fluid.pressure_tolerance=1e-12"}));
  solver.begin_step(1e-3);
  solver.iterate();
  const Points<2> &points = solver.state.points;
  double worst = 0, worst_force = 0;
  for (int i = 0; i < points.size(); ++i) {
    const double exact = 9810 * (0.14 - points.position[i].y());
    worst = std::max(worst, std::abs(points.pressure[i] - exact));
    const Vec<2> force =
        pressure_gradient(i, points, solver.cloud(), solver.problem(), points.pressure) -
        Vec<2>(0, -9810);
    worst_force = std::max(worst_force, force.norm());
  }
  std::printf("hydrostatic: worst error %.2e Pa of 1373, %.2e Pa/m of 9810\n", worst, worst_force);
  EXPECT_LT(worst, 1e-6);       // 1e-12 of the source times the number of rows, condition 1e3
  EXPECT_LT(worst_force, 1e-2); // the same over a spacing, with margin
}

TEST(PressureSolve, LeavesTheResidualThatItWasAskedFor) {
  FluidSolver<2> solver(testing::scene_of(testing::dam_break));
  for (int n = 0; n < 3; ++n) {
    solver.begin_step(5e-4);
    solver.iterate();
    const SparseMatrix a = compressed(solver.problem().matrix);
    double residual = 0, source = 0;
    for (int i = 0; i < a.rows(); ++i) {
      double r = solver.problem().source[i];
      source += std::pow(r / a.diagonal(i), 2);
      for (int k = a.row_start[i]; k < a.row_start[i + 1]; ++k)
        r -= a.value[k] * solver.state.points.pressure[a.column[k]];
      residual += std::pow(r / a.diagonal(i), 2);
    }
    EXPECT_LE(std::sqrt(residual), 1.01 * solver.params().pressure_tolerance * std::sqrt(source));
    solver.end_step();
  }
}

TEST(PressureSolve, WallVelocityEntersTheRightHandSideAloneAndAffinely) {
  FluidSolver<2> solver(
      testing::scene_of(testing::gate_tank(), {"fluid.pressure_tolerance=1e-12"}));
  solver.begin_step(1e-3);
  const auto matrix = solver.problem().matrix.off_diagonal;
  const auto fluid_source = solver.problem().fluid_source;
  std::mt19937 engine(8);
  std::uniform_real_distribution<double> uniform(-0.1, 0.1);
  const std::size_t n = solver.walls.velocity.size();
  std::vector<Vec<2>> zero(n, Vec<2>::Zero()), u1 = zero, u2 = zero, both = zero;
  for (const int v : solver.walls.coupled_vertices) {
    u1[v] = {uniform(engine), uniform(engine)};
    u2[v] = {uniform(engine), uniform(engine)};
    both[v] = u1[v] + u2[v];
  }
  const auto respond = [&](const std::vector<Vec<2>> &u) {
    solver.walls.velocity = u;
    solver.iterate();
    return solver.state.points.pressure;
  };
  const auto p0 = respond(zero), p1 = respond(u1), p2 = respond(u2), p12 = respond(both);
  double size = 0, error = 0;
  for (std::size_t i = 0; i < p0.size(); ++i) {
    size = std::max(size, std::abs(p2[i] - p0[i]));
    error = std::max(error, std::abs((p12[i] - p1[i]) - (p2[i] - p0[i])));
  }
  EXPECT_EQ(solver.problem().matrix.off_diagonal, matrix);
  EXPECT_EQ(solver.problem().fluid_source, fluid_source);
  std::printf("affine to %.1e of %.1e Pa\n", error, size);
  EXPECT_GT(size, 10);
  EXPECT_LT(error, 1e-8 * size);
}

// --- in space -----------------------------------------------------------------------------------

TEST(PressureInSpace, GradientAndRowsAreExactForQuadraticFieldsUpToTheWalls) {
  const Vec<3> size(0.8, 0.7, 0.6);
  const testing::FrozenCloudIn<3> frozen(testing::lattice({8, 7, 6}, h, 0.15),
                                         testing::box_of_triangles(size), h);
  Mat<3> curvature;
  curvature << 1, -1.5, 0.5, -1.5, 2, -0.7, 0.5, -0.7, -1;
  const Vec<3> slope(1, -2, 0.5);
  const auto field = [&](const Vec<3> &x) { return slope.dot(x) + x.dot(curvature * x); };
  const auto gradient = [&](const Vec<3> &x) { return Vec<3>(slope + 2 * curvature * x); };
  PressureParams params;
  params.density = density;
  params.row_guard = no_guard;
  PressureProblem<3> problem;
  const std::vector<Vec<3>> predicted =
      frozen.values([&](const Vec<3> &x) { return Vec<3>(dt / density * gradient(x)); });
  const std::vector<double> target(frozen.size(), 0), p = frozen.values(field);
  assemble_pressure_operators(frozen.points, frozen.cloud, params, problem);
  assemble_pressure_source<3>(frozen.points, frozen.cloud, params, predicted, target, dt, problem);
  set_wall_velocity(frozen.walls, frozen.cloud, params, dt, problem);
  int exact_rows = 0;
  for (int i = 0; i < frozen.size(); ++i) {
    double defect = -problem.source[i];
    defect += problem.matrix.diagonal[i] * p[i];
    problem.matrix.for_each_entry(i, [&](int j, double value) { defect += value * p[j]; });
    const Vec<3> found = pressure_gradient(i, frozen.points, frozen.cloud, problem, p);
    exact_rows +=
        (found - gradient(frozen.points.position[i])).norm() < 1e-9 && std::abs(defect) < 1e-9;
  }
  std::printf("%d of %d rows exact for quadratics in space\n", exact_rows, frozen.size());
  EXPECT_GE(exact_rows, problem.rows.quadratic);
  EXPECT_GE(problem.rows.quadratic, 0.9 * frozen.size());
}

// --- orders, in the plane and in space
// ------------------------------------------------------------

Walls<2> unit_box(const Vec<2> &) { return testing::closed_box(1, 1); }
Walls<3> unit_box(const Vec<3> &) { return testing::box_of_triangles(Vec<3>::Ones()); }

std::vector<Vec<2>> jittered(int n, const Vec<2> &) {
  return testing::lattice(n, n, 1.0 / n, 0.2, n);
}
std::vector<Vec<3>> jittered(int n, const Vec<3> &) {
  return testing::lattice({n, n, n}, 1.0 / n, 0.2, n);
}

/// f = prod_d sin(pi x_d + phase_d) in a unit box of n^dim jittered points, with the exact slope as
/// datum at every wall.
template <int dim> class WaveInABox {
public:
  WaveInABox(int n, double guard)
      : spacing(1.0 / n), frozen(jittered(n, Vec<dim>()), unit_box(Vec<dim>()), spacing) {
    PressureParams params;
    params.row_guard = guard;
    assemble_pressure_operators(frozen.points, frozen.cloud, params, problem_);
    for (std::size_t slot = 0; slot < frozen.cloud.point_walls.size(); ++slot) {
      const PointWalls<dim> &walls = frozen.cloud.point_walls[slot];
      for (int m = 0; m < walls.count; ++m)
        problem_.wall_rows[slot][m].datum =
            walls.projection[m].normal.dot(gradient(walls.projection[m].point));
    }
    wave_ = frozen.values([&](const Vec<dim> &x) { return value(x); });
  }

  static double value(const Vec<dim> &x) {
    double product = 1;
    for (int d = 0; d < dim; ++d)
      product *= std::sin(k * x[d] + phase(d));
    return product;
  }
  static Vec<dim> gradient(const Vec<dim> &x) {
    Vec<dim> g;
    for (int d = 0; d < dim; ++d) {
      g[d] = k * std::cos(k * x[d] + phase(d));
      for (int e = 0; e < dim; ++e)
        g[d] *= e == d ? 1 : std::sin(k * x[e] + phase(e));
    }
    return g;
  }
  static double laplacian(const Vec<dim> &x) { return -dim * k * k * value(x); }

  double gradient_error(int i) const {
    return (pressure_gradient(i, frozen.points, frozen.cloud, problem_, wave_) -
            gradient(frozen.points.position[i]))
        .norm();
  }
  double laplacian_error(int i) const {
    double row = problem_.matrix.diagonal[i] * wave_[i];
    problem_.matrix.for_each_entry(i, [&](int j, double value) { row += value * wave_[j]; });
    return (slopes(i) - row) / (spacing * spacing) - laplacian(frozen.points.position[i]);
  }
  const RowCounts &rows() const { return problem_.rows; }
  bool is_quadratic(int i) const { return problem_.row_kind[i] == RowKind::quadratic; }
  bool is_at_wall(int i) const { return has_wall_row(i, frozen.cloud); }

  /// Solves lap p = lap f with the slopes of f at all walls; rms of p - f, both without their mean.
  double solution_error() {
    const int n = frozen.size();
    std::vector<double> source(n), p(n, 0);
    std::vector<Cell> cells(n);
    for (int i = 0; i < n; ++i) {
      const Vec<dim> &x = frozen.points.position[i];
      source[i] = slopes(i) - spacing * spacing * laplacian(x);
      for (int d = 0; d < dim; ++d)
        cells[i][d] = static_cast<int>(x[d] / (2 * spacing));
    }
    ScaledMatrix scaled;
    scaled.build(problem_.matrix);
    Multigrid multigrid;
    multigrid.build(scaled, cells);
    SolveOptions options;
    options.relative_tolerance = 1e-9;
    options.null_space = NullSpace::constants;
    KrylovMemory memory;
    EXPECT_TRUE(bicgstab(scaled, source, p, multigrid, options, memory).converged);
    double mean = 0, square = 0;
    for (int i = 0; i < n; ++i)
      mean += (p[i] - wave_[i]) / n;
    for (int i = 0; i < n; ++i)
      square += std::pow(p[i] - wave_[i] - mean, 2) / n;
    return std::sqrt(square);
  }

  double spacing;
  testing::FrozenCloudIn<dim> frozen;

private:
  static constexpr double k = std::numbers::pi;
  static double phase(int d) { return 0.3 + 0.2 * d; }
  // What the data at walls add to a point's row.
  double slopes(int i) const {
    double total = 0;
    for_each_wall_row(frozen.cloud.walls_of(i), frozen.cloud, [&](int m, const Projection<dim> &) {
      const WallRow<dim> &wall = problem_.wall_rows[frozen.cloud.wall_slot[i]][m];
      total += wall.laplacian * wall.datum;
    });
    return total;
  }

  PressureProblem<dim> problem_;
  std::vector<double> wave_;
};

/// Root of the mean of error(i)^2 over the points with a quadratic row that are at a wall, or not.
template <int dim, class Error>
double rms(const WaveInABox<dim> &box, bool at_wall, Error &&error) {
  double square = 0;
  int count = 0;
  for (int i = 0; i < box.frozen.size(); ++i)
    if (box.is_quadratic(i) && box.is_at_wall(i) == at_wall) {
      square += std::pow(error(i), 2);
      ++count;
    }
  return std::sqrt(square / count);
}

template <int dim> void expect_orders_of_rows(const std::vector<int> &points_per_side) {
  for (const bool at_wall : {false, true}) {
    std::vector<double> spacing, gradient, laplacian;
    for (const int n : points_per_side) {
      const WaveInABox<dim> box(n, 0.1);
      spacing.push_back(box.spacing);
      gradient.push_back(rms(box, at_wall, [&](int i) { return box.gradient_error(i); }));
      laplacian.push_back(rms(box, at_wall, [&](int i) { return box.laplacian_error(i); }));
      std::printf("%dD, n = %2d, %s: gradient %.2e, Laplacian %.2e\n", dim, n,
                  at_wall ? "at walls" : "inside", gradient.back(), laplacian.back());
    }
    const double first = testing::fitted_order(spacing, gradient),
                 second = testing::fitted_order(spacing, laplacian);
    std::printf("orders: gradient %.2f, Laplacian %.2f\n", first, second);
    EXPECT_GE(first, 1.8);  // quadratic fit: 2, less 0.2
    EXPECT_GE(second, 0.8); // 1, less 0.2
  }
}

/// Order of the solution with the given guard of the rows' signs.
template <int dim> double order_of_poisson(const std::vector<int> &points_per_side, double guard) {
  std::vector<double> spacing, error;
  for (const int n : points_per_side) {
    WaveInABox<dim> box(n, guard);
    spacing.push_back(box.spacing);
    error.push_back(box.solution_error());
    std::printf("%dD, n = %2d, guard %g: error %.2e; %d rows quadratic, %d linear, %d plain\n", dim,
                n, guard, error.back(), box.rows().quadratic, box.rows().linear, box.rows().plain);
  }
  const double order = testing::fitted_order(spacing, error);
  std::printf("order of Poisson with Neumann walls: %.2f\n", order);
  return order;
}

TEST(PressureOrders, OfGradientAndLaplacianInsideAndAtWalls) {
  expect_orders_of_rows<2>({16, 32, 64});
  expect_orders_of_rows<3>({8, 12, 18});
}

// The guard blends a few rows with first-order ones, most of them at walls: no more than their
// signs need, which keeps the order.
TEST(PressureOrders, OfPoissonWithNeumannWalls) {
  EXPECT_GE(order_of_poisson<2>({16, 32, 64}, no_guard), 1.8); // 2, less 0.2
  EXPECT_GE(order_of_poisson<2>({16, 32, 64}, 0.1), 1.8);
  EXPECT_GE(order_of_poisson<3>({8, 12, 18}, 0.1), 1.8);
}

} // namespace
} // namespace sluice::fluid
