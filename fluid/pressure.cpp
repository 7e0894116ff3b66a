// SPDX-License-Identifier: MIT
#include "fluid/pressure.hpp"

#include "fluid/parallel.hpp"
#include "fluid/weights.hpp"

#include <algorithm>
#include <cmath>

namespace sluice::fluid {

namespace {

// Weight of a wall row: that of a neighbour at no distance.
constexpr double wall_weight = 1.0;
// Points farther from a wall than this, in spacings, have no row for it: they see enough neighbours.
constexpr double wall_row_reach = 1.5;

/// A neighbour in scaled coordinates.
struct Neighbour {
  int j;
  Vec<2> q; // r / h
  double w;
};

/// All that the row of one point is made from, gathered once.
struct Stencil {
  int i;
  double h;                // kernel radius [m]
  const PointWalls *walls; // or nullptr
  bool open;               // touches air: no wall holds it, its pressure is not solved for
  Vec<2> open_side;        // q of the zero of pressure half a spacing outside; 0: at the point
  int count;
  std::array<Neighbour, most_neighbours> neighbour;
};

double reach_of_rows(const Cloud &cloud) { return wall_row_reach * cloud.spacing; }

// A sharp edge has no row: held at the direction towards it, a point would have to circle round the
// edge, and the suction of that circle tears the flow off. Contact alone keeps points out.
bool has_row(const Projection &p, const Cloud &cloud) {
  return p.distance < reach_of_rows(cloud) && !p.at_edge;
}

template <class Visit> void for_each_wall_row(const Stencil &s, const Cloud &cloud, Visit &&visit) {
  if (!s.walls)
    return;
  for (int m = 0; m < s.walls->count; ++m)
    if (has_row(s.walls->projection[m], cloud))
      visit(m, s.walls->projection[m]);
}

void gather(int i, const Points &points, const Cloud &cloud, Stencil &s) {
  s.i = i;
  s.h = cloud.radius;
  s.walls = cloud.walls_of(i);
  s.open = cloud.kind[i] != PointKind::interior;
  s.open_side = 0.5 * cloud.spacing / cloud.radius * cloud.surface_normal[i];
  s.count = 0;
  const Vec<2> x = points.position[i];
  const double scale = 1 / s.h;
  for (const int j : cloud.neighbours.of(i)) {
    const Vec<2> q = scale * (points.position[j] - x);
    s.neighbour[s.count++] = {j, q, weight(std::min(q.norm(), 1.0))};
  }
}

template <class Visit> void for_each_neighbour(const Stencil &s, Visit &&visit) {
  for (int k = 0; k < s.count; ++k)
    visit(s.neighbour[k]);
}

// --- fits -----------------------------------------------------------------------------------

QuadraticFit quadratic_fit(const Stencil &s, const Points &points, const Cloud &cloud) {
  QuadraticFit fit;
  for_each_neighbour(s, [&](const Neighbour &n) { fit.add_neighbour(n.q, n.w); });
  for_each_wall_row(s, cloud, [&](int, const Projection &p) {
    const Vec<2> q = (p.point - points.position[s.i]) / s.h;
    fit.add_row(normal_derivative(q, p.normal), wall_weight);
  });
  return fit;
}

/// Functionals of d/dx, d/dy from the linear fit: with the walls' rows inside, with the zero of
/// pressure outside at open points. Walls hold no open point: contact does.
Eigen::Matrix<double, 5, 2> linear_gradient(const Stencil &s, const Cloud &cloud) {
  LinearFit fit;
  for_each_neighbour(s, [&](const Neighbour &n) { fit.add(n.q, n.w); });
  if (s.open)
    fit.add(s.open_side, weight(s.open_side.norm()));
  else
    for_each_wall_row(s, cloud,
                      [&](int, const Projection &p) { fit.add(p.normal, wall_weight); });
  Eigen::Matrix<double, 5, 2> functional = Eigen::Matrix<double, 5, 2>::Zero();
  functional.topRows<2>() = (s.open ? fit.limited_inverse() : fit.inverse()) / s.h;
  return functional;
}

/// Functionals of d/dx, d/dy for fields known in the fluid only (velocity): no wall rows.
Mat<2> fluid_gradient(const Stencil &s) {
  LinearFit fit;
  for_each_neighbour(s, [&](const Neighbour &n) { fit.add(n.q, n.w); });
  return (s.open ? fit.limited_inverse() : fit.inverse()) / s.h;
}

// --- velocity -------------------------------------------------------------------------------

/// Gradient of u* at the point [1/s], g(a, b) = d u_a / d x_b.
Mat<2> velocity_gradient(const Stencil &s, std::span<const Vec<2>> velocity,
                         const Eigen::Matrix<double, 5, 2> &functional) {
  Mat<2> g = Mat<2>::Zero();
  const Vec<2> u = velocity[s.i];
  const bool is_linear = functional(2, 0) == 0 && functional(3, 0) == 0 && functional(4, 0) == 0;
  for_each_neighbour(s, [&](const Neighbour &n) {
    Vec<2> coefficient = functional.topRows<2>().transpose() * n.q;
    if (!is_linear)
      coefficient += functional.bottomRows<3>().transpose() *
                     Vec<3>(n.q.x() * n.q.x(), n.q.x() * n.q.y(), n.q.y() * n.q.y());
    g += (n.w * (velocity[n.j] - u)) * coefficient.transpose();
  });
  return g;
}

// --- Laplacian rows -------------------------------------------------------------------------

/// One row under construction: neighbour weights in list order, wall weights by projection.
struct Row {
  std::span<double> neighbour;   // of f_j - f_i
  std::array<double, 3> wall{};  // of g [m]
};

bool has_wrong_signs(const Row &row, double guard) {
  double negative = 0, positive = 0;
  for (const double a : row.neighbour)
    (a < 0 ? negative : positive) += std::abs(a);
  return negative > guard * positive || !(positive > 0);
}

void quadratic_row(const Stencil &s, const Points &points, const Cloud &cloud, const Basis &lap,
                   Row &row) {
  std::size_t k = 0;
  for_each_neighbour(s, [&](const Neighbour &n) {
    row.neighbour[k++] = n.w * lap.dot(quadratic_basis(n.q));
  });
  for_each_wall_row(s, cloud, [&](int m, const Projection &p) {
    const Vec<2> q = (p.point - points.position[s.i]) / s.h;
    row.wall[m] = wall_weight * s.h * lap.dot(normal_derivative(q, p.normal));
  });
}

/// Renormalised Laplacian with the point's own projections as neighbours of value f_i + d g:
/// 2 dim sum w (1 - r . B o) (f_j - f_i) / sum w |r|^2 (1 - r . B o), B the inverse second moment,
/// o the offset. Exact for linear fields and |r|^2. `skew` = B o = 0 gives positive weights.
/// Source: Basic, Degiuli, Ban, J. Comput. Phys. 354 (2018) 268 (form reconstructed; verified by
/// its identities in the tests).
void renormalised_row(const Stencil &s, const Points &points, const Cloud &cloud,
                      const Vec<2> &skew, Row &row) {
  double denominator = 0;
  std::size_t k = 0;
  for_each_neighbour(s, [&](const Neighbour &n) {
    const double a = n.w * (1 - n.q.dot(skew));
    row.neighbour[k++] = a;
    denominator += a * n.q.squaredNorm();
  });
  for_each_wall_row(s, cloud, [&](int m, const Projection &p) {
    const Vec<2> q = (p.point - points.position[s.i]) / s.h;
    const double a = weight(std::min(q.norm(), 1.0)) * (1 - q.dot(skew));
    row.wall[m] = a * p.distance;
    denominator += a * q.squaredNorm();
  });
  const double scale = denominator != 0 ? 4 / (denominator * s.h * s.h) : 0.0;
  for (double &a : row.neighbour)
    a *= scale;
  for (double &a : row.wall)
    a *= scale;
}

Vec<2> renormalising_skew(const Stencil &s, const Points &points, const Cloud &cloud) {
  LinearFit fit;
  Vec<2> offset = Vec<2>::Zero();
  const auto add = [&](const Vec<2> &q, double w) {
    fit.add(q, w);
    offset += w * q;
  };
  for_each_neighbour(s, [&](const Neighbour &n) { add(n.q, n.w); });
  for_each_wall_row(s, cloud, [&](int, const Projection &p) {
    const Vec<2> q = (p.point - points.position[s.i]) / s.h;
    add(q, weight(std::min(q.norm(), 1.0)));
  });
  return fit.inverse() * offset;
}

/// The fallback ladder: the first row whose signs keep the matrix definite.
RowKind laplacian_row(const Stencil &s, const Points &points, const Cloud &cloud,
                      const QuadraticFit *fit, double guard, Row &row) {
  if (fit) {
    const double h2 = s.h * s.h;
    quadratic_row(s, points, cloud, fit->solve({0, 0, 2 / h2, 0, 2 / h2}), row);
    if (!has_wrong_signs(row, guard))
      return RowKind::quadratic;
  }
  row.wall = {};
  renormalised_row(s, points, cloud, renormalising_skew(s, points, cloud), row);
  if (!has_wrong_signs(row, guard))
    return RowKind::linear;
  row.wall = {};
  renormalised_row(s, points, cloud, Vec<2>::Zero(), row);
  return RowKind::plain;
}

/// Row of a surface point: pressure falls linearly to zero at the plane half a spacing outside,
/// p_i = a D/2 with the slope a fitted to the interior neighbours at depth d_j below the plane:
/// p_i = D/2 sum w d_j p_j / sum w d_j^2. Exact for hydrostatic pressure; an M-matrix row.
void surface_row(const Stencil &s, const Cloud &cloud, std::span<double> entry) {
  const Vec<2> &n = cloud.surface_normal[s.i];
  const double half = 0.5 * cloud.spacing / s.h;
  double denominator = 0;
  std::size_t k = 0;
  for_each_neighbour(s, [&](const Neighbour &m) {
    const double depth = half - n.dot(m.q);
    const bool is_donor = cloud.kind[m.j] == PointKind::interior && depth > half;
    entry[k++] = is_donor ? -half * m.w * depth : 0.0;
    denominator += is_donor ? m.w * depth * depth : 0.0;
  });
  for (double &e : entry)
    e = denominator > 0 ? e / denominator : 0.0;
}

// --- assembly -------------------------------------------------------------------------------

void lay_out(const Cloud &cloud, PressureProblem &problem) {
  const int n = static_cast<int>(cloud.kind.size());
  lay_out_rows(cloud.neighbours, problem.matrix);
  problem.fluid_source.resize(n);
  problem.source.resize(n);
  problem.gradient.resize(n);
  problem.row_kind.resize(n);
  problem.velocity_gradient.resize(n);
  problem.wall_rows.assign(cloud.point_walls.size(), {});
}

/// What the cloud alone decides: matrix, gradient functionals, weights of the wall data.
class OperatorAssembler {
public:
  OperatorAssembler(const Points &points, const Cloud &cloud, const PressureParams &params,
                    PressureProblem &problem)
      : points_(points), cloud_(cloud), params_(params), problem_(problem) {}

  RowKind row(int i) const {
    Stencil s;
    gather(i, points_, cloud_, s);
    const RowKind kind = cloud_.kind[i] != PointKind::interior ? open_row(s) : poisson_row(s);
    problem_.row_kind[i] = kind;
    return kind;
  }

private:
  std::span<double> off_diagonal(const Stencil &s) const {
    return {problem_.matrix.value.data() + problem_.matrix.row_start[s.i] + 1,
            static_cast<std::size_t>(s.count)};
  }

  RowKind open_row(const Stencil &s) const {
    problem_.matrix.value[problem_.matrix.row_start[s.i]] = 1;
    surface_row(s, cloud_, off_diagonal(s));
    problem_.gradient[s.i] = linear_gradient(s, cloud_);
    if (s.walls)
      problem_.wall_rows[cloud_.wall_slot[s.i]] = {};
    return RowKind::open;
  }

  RowKind poisson_row(const Stencil &s) const {
    QuadraticFit fit = quadratic_fit(s, points_, cloud_);
    const bool regular = fit.factorise() && set_quadratic_gradient(s, fit);
    Row row{off_diagonal(s), {}};
    const RowKind kind =
        laplacian_row(s, points_, cloud_, regular ? &fit : nullptr, params_.row_guard, row);
    if (kind != RowKind::quadratic)
      problem_.gradient[s.i] = linear_gradient(s, cloud_);
    set_wall_rows(s, row.wall);
    finish_poisson_row(s, row);
    return kind;
  }

  // False when the cloud hardly determines the quadratic: on a lattice the functionals have a norm
  // of 2.5 / h, next to walls 15 / h; beyond the limit they amplify the noise of single points.
  bool set_quadratic_gradient(const Stencil &s, const QuadraticFit &fit) const {
    auto &gradient = problem_.gradient[s.i];
    gradient.col(0) = fit.solve({1 / s.h, 0, 0, 0, 0});
    gradient.col(1) = fit.solve({0, 1 / s.h, 0, 0, 0});
    return gradient.norm() * s.h < params_.gradient_guard;
  }

  void set_wall_rows(const Stencil &s, const std::array<double, 3> &laplacian) const {
    const double scale = cloud_.spacing * cloud_.spacing;
    for_each_wall_row(s, cloud_, [&](int m, const Projection &p) {
      const Vec<2> q = (p.point - points_.position[s.i]) / s.h;
      WallRow &wall = problem_.wall_rows[cloud_.wall_slot[s.i]][m];
      wall.laplacian = scale * laplacian[m];
      wall.gradient = wall_weight * s.h *
                      (problem_.gradient[s.i].transpose() * normal_derivative(q, p.normal));
    });
  }

  void finish_poisson_row(const Stencil &s, const Row &row) const {
    const double scale = cloud_.spacing * cloud_.spacing;
    double sum = 0;
    for (double &a : row.neighbour) {
      a *= -scale;
      sum -= a;
    }
    problem_.matrix.value[problem_.matrix.row_start[s.i]] = sum > 0 ? sum : 1.0;
  }

  const Points &points_;
  const Cloud &cloud_;
  const PressureParams &params_;
  PressureProblem &problem_;
};

/// What the predicted velocity adds: its gradient, its approach to the walls, the source.
class SourceAssembler {
public:
  SourceAssembler(const Points &points, const Cloud &cloud, const PressureParams &params,
                  std::span<const Vec<2>> velocity, std::span<const double> target, double dt,
                  PressureProblem &problem)
      : points_(points), cloud_(cloud), velocity_(velocity), target_(target),
        factor_(params.density / dt), problem_(problem) {}

  void row(int i) const {
    Stencil s;
    gather(i, points_, cloud_, s);
    problem_.velocity_gradient[i] = velocity_gradient(s, velocity_, functional_of(s));
    problem_.fluid_source[i] = s.open ? 0.0 : -source_of(s);
  }

private:
  // Far from walls the pressure's gradient, which is quadratic; next to one its rows do not hold for
  // a velocity.
  Eigen::Matrix<double, 5, 2> functional_of(const Stencil &s) const {
    bool near_wall = false;
    for_each_wall_row(s, cloud_, [&](int, const Projection &) { near_wall = true; });
    if (problem_.row_kind[s.i] == RowKind::quadratic && !near_wall)
      return problem_.gradient[s.i];
    Eigen::Matrix<double, 5, 2> functional = Eigen::Matrix<double, 5, 2>::Zero();
    functional.topRows<2>() = fluid_gradient(s);
    return functional;
  }

  double source_of(const Stencil &s) const {
    const double scale = cloud_.spacing * cloud_.spacing;
    const Mat<2> &gradient = problem_.velocity_gradient[s.i];
    double source = factor_ * (gradient.trace() - target_[s.i]) * scale;
    for_each_wall_row(s, cloud_, [&](int m, const Projection &p) {
      const Vec<2> at_wall = velocity_[s.i] + gradient * (p.point - points_.position[s.i]);
      WallRow &wall = problem_.wall_rows[cloud_.wall_slot[s.i]][m];
      wall.approach = p.normal.dot(at_wall);
      source -= wall.laplacian * factor_ * wall.approach;
    });
    return source;
  }

  const Points &points_;
  const Cloud &cloud_;
  std::span<const Vec<2>> velocity_;
  std::span<const double> target_;
  double factor_;
  PressureProblem &problem_;
};

// --- tension ----------------------------------------------------------------------------------

bool is_next_to_air(int i, const Points &points, const Cloud &cloud) {
  const double near = 1.5 * cloud.spacing;
  for (const int j : cloud.neighbours.of(i)) {
    const bool is_air = cloud.kind[j] != PointKind::interior ||
                        points.at_surface[j] == SurfaceMemory::released;
    if (is_air && (points.position[j] - points.position[i]).squaredNorm() < near * near)
      return true;
  }
  return false;
}

// One Jacobi step from the last pressure: is row i pulled below zero?
bool is_in_tension(int i, const Points &points, const PressureProblem &problem) {
  const SparseMatrix &matrix = problem.matrix;
  double pull = problem.source[i];
  for (int k = matrix.row_start[i] + 1; k < matrix.row_start[i + 1]; ++k)
    pull -= matrix.value[k] * points.pressure[matrix.column[k]];
  return pull < 0;
}

} // namespace

int release_tension(Points &points, const Walls &walls, const PressureParams &params,
                    std::span<const Vec<2>> predicted_velocity,
                    std::span<const double> target_divergence, double dt, Cloud &cloud,
                    PressureProblem &problem) {
  set_wall_velocity(walls, cloud, params, dt, problem);
  std::vector<char> released(points.size(), 0);
  for_each_point(points.size(), [&](int i) {
    released[i] = cloud.kind[i] == PointKind::interior && is_next_to_air(i, points, cloud) &&
                  is_in_tension(i, points, problem);
  });
  std::vector<int> changed;
  for (int i = 0; i < points.size(); ++i) {
    if (cloud.kind[i] != PointKind::interior)
      continue;
    points.at_surface[i] = released[i] ? SurfaceMemory::released : SurfaceMemory::enclosed;
    if (released[i]) {
      cloud.kind[i] = PointKind::thin;
      changed.push_back(i);
    }
  }
  const OperatorAssembler operators(points, cloud, params, problem);
  const SourceAssembler sources(points, cloud, params, predicted_velocity, target_divergence, dt,
                                problem);
  const auto assemble = [&](int i) {
    operators.row(i);
    sources.row(i);
  };
  for (const int i : changed) {
    assemble(i);
    for (const int j : cloud.neighbours.of(i))
      if (cloud.kind[j] == PointKind::surface)
        assemble(j);
  }
  return static_cast<int>(changed.size());
}

void assemble_pressure_operators(const Points &points, const Cloud &cloud,
                                 const PressureParams &params, PressureProblem &problem) {
  lay_out(cloud, problem);
  const OperatorAssembler assemble(points, cloud, params, problem);
  const auto counts = block_sums<4>(points.size(), [&](IndexRange range) {
    std::array<double, 4> count{};
    for (int i = range.begin; i < range.end; ++i)
      count[static_cast<std::size_t>(assemble.row(i))] += 1;
    return count;
  }, Work::heavy);
  problem.rows = {static_cast<int>(counts[0]), static_cast<int>(counts[1]),
                  static_cast<int>(counts[2]), static_cast<int>(counts[3])};
  problem.has_open_point = problem.rows.open > 0;
}

void assemble_pressure_source(const Points &points, const Cloud &cloud,
                              const PressureParams &params,
                              std::span<const Vec<2>> predicted_velocity,
                              std::span<const double> target_divergence, double dt,
                              PressureProblem &problem) {
  const SourceAssembler assemble(points, cloud, params, predicted_velocity, target_divergence, dt,
                                 problem);
  for_each_point(points.size(), [&](int i) { assemble.row(i); });
}

void set_wall_velocity(const Walls &walls, const Cloud &cloud, const PressureParams &params,
                       double dt, PressureProblem &problem) {
  problem.source = problem.fluid_source;
  const double factor = params.density / dt;
  for_each_index(static_cast<int>(cloud.wall_points.size()), [&](int k) {
    const PointWalls &projections = cloud.point_walls[k];
    for (int m = 0; m < projections.count; ++m) {
      const Projection &p = projections.projection[m];
      if (!has_row(p, cloud))
        continue;
      WallRow &wall = problem.wall_rows[k][m];
      const double wall_speed = p.normal.dot(wall_velocity(walls, p));
      wall.datum = factor * (wall.approach - wall_speed);
      problem.source[cloud.wall_points[k]] -= wall.laplacian * factor * wall_speed;
    }
  });
}

Vec<2> pressure_gradient(int i, const Points &points, const Cloud &cloud,
                         const PressureProblem &problem, std::span<const double> pressure) {
  Stencil s;
  gather(i, points, cloud, s);
  const auto &functional = problem.gradient[i];
  Vec<2> gradient = Vec<2>::Zero();
  for_each_neighbour(s, [&](const Neighbour &n) {
    const double scaled = n.w * (pressure[n.j] - pressure[i]);
    gradient += scaled * (functional.transpose() * quadratic_basis(n.q));
  });
  if (s.open)
    gradient -= weight(s.open_side.norm()) * pressure[i] *
                (functional.topRows<2>().transpose() * s.open_side);
  else
    for_each_wall_row(s, cloud, [&](int m, const Projection &) {
      const WallRow &wall = problem.wall_rows[cloud.wall_slot[i]][m];
      gradient += wall.datum * wall.gradient;
    });
  return gradient;
}

} // namespace sluice::fluid
