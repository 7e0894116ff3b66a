// SPDX-License-Identifier: MIT
#include "fluid/pressure.hpp"

#include "fluid/parallel.hpp"
#include "fluid/weights.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace sluice::fluid {

namespace {

// Weight of a wall row: that of a neighbour at no distance.
constexpr double wall_weight = 1.0;
// Points farther from a wall than this, in spacings, have no row for it: they see enough
// neighbours.
constexpr double wall_row_reach = 1.5;

/// A neighbour in scaled coordinates.
template <int dim> struct Neighbour {
  int j;
  Vec<dim> q; // r / h
  double w;
};

/// All that the row of one point is made from, gathered once.
template <int dim> struct Stencil {
  int i;
  double h;                     // kernel radius [m]
  const PointWalls<dim> *walls; // or nullptr
  bool open;                    // touches air: no wall holds it, its pressure is not solved for
  Vec<dim> open_side;           // q of the zero of pressure half a spacing outside; 0: at the point
  int count;
  std::array<Neighbour<dim>, most_neighbours<dim>> neighbour;
};

template <int dim> double reach_of_rows(const Cloud<dim> &cloud) {
  return wall_row_reach * cloud.spacing;
}

// A sharp edge has no row: held at the direction towards it, a point would have to circle round the
// edge, and the suction of that circle tears the flow off. Contact alone keeps points out.
template <int dim> bool has_row(const Projection<dim> &p, const Cloud<dim> &cloud) {
  return p.distance < reach_of_rows(cloud) && !p.at_edge;
}

template <int dim, class Visit>
void for_each_wall_row(const Stencil<dim> &s, const Cloud<dim> &cloud, Visit &&visit) {
  if (!s.walls)
    return;
  for (int m = 0; m < s.walls->count; ++m)
    if (has_row(s.walls->projection[m], cloud))
      visit(m, s.walls->projection[m]);
}

template <int dim>
void gather(int i, const Points<dim> &points, const Cloud<dim> &cloud, Stencil<dim> &s) {
  s.i = i;
  s.h = cloud.radius;
  s.walls = cloud.walls_of(i);
  s.open = cloud.kind[i] != PointKind::interior;
  s.open_side = 0.5 * cloud.spacing / cloud.radius * cloud.surface_normal[i];
  s.count = 0;
  const Vec<dim> x = points.position[i];
  const double scale = 1 / s.h;
  for (const int j : cloud.neighbours.of(i)) {
    const Vec<dim> q = scale * (points.position[j] - x);
    s.neighbour[s.count++] = {j, q, weight(std::min(q.norm(), 1.0))};
  }
}

template <int dim, class Visit> void for_each_neighbour(const Stencil<dim> &s, Visit &&visit) {
  for (int k = 0; k < s.count; ++k)
    visit(s.neighbour[k]);
}

// --- fits -----------------------------------------------------------------------------------

template <int dim>
QuadraticFit<dim> quadratic_fit(const Stencil<dim> &s, const Points<dim> &points,
                                const Cloud<dim> &cloud) {
  QuadraticFit<dim> fit;
  for_each_neighbour(s, [&](const Neighbour<dim> &n) { fit.add_neighbour(n.q, n.w); });
  for_each_wall_row(s, cloud, [&](int, const Projection<dim> &p) {
    const Vec<dim> q = (p.point - points.position[s.i]) / s.h;
    fit.add_row(normal_derivative(q, p.normal), wall_weight);
  });
  return fit;
}

/// Functionals of the derivatives from the linear fit: with the walls' rows inside, with the zero
/// of pressure outside at open points. Walls hold no open point: contact does.
template <int dim>
Functionals<dim> linear_gradient(const Stencil<dim> &s, const Cloud<dim> &cloud) {
  LinearFit<dim> fit;
  for_each_neighbour(s, [&](const Neighbour<dim> &n) { fit.add(n.q, n.w); });
  if (s.open)
    fit.add(s.open_side, weight(s.open_side.norm()));
  else
    for_each_wall_row(s, cloud,
                      [&](int, const Projection<dim> &p) { fit.add(p.normal, wall_weight); });
  Functionals<dim> functional = Functionals<dim>::Zero();
  functional.template topRows<dim>() = (s.open ? fit.limited_inverse() : fit.inverse()) / s.h;
  return functional;
}

/// Functionals of the derivatives for fields known in the fluid only (velocity): no wall rows.
template <int dim> Mat<dim> fluid_gradient(const Stencil<dim> &s) {
  LinearFit<dim> fit;
  for_each_neighbour(s, [&](const Neighbour<dim> &n) { fit.add(n.q, n.w); });
  return (s.open ? fit.limited_inverse() : fit.inverse()) / s.h;
}

// --- velocity -------------------------------------------------------------------------------

/// Gradient of u* at the point [1/s], g(a, b) = d u_a / d x_b.
template <int dim>
Mat<dim> velocity_gradient(const Stencil<dim> &s, VecView<dim> velocity,
                           const Functionals<dim> &functional) {
  Mat<dim> g = Mat<dim>::Zero();
  const Vec<dim> u = velocity[s.i];
  constexpr int n = n_products<dim>;
  const bool is_linear = (functional.template bottomRows<n>().col(0).array() == 0).all();
  for_each_neighbour(s, [&](const Neighbour<dim> &m) {
    Vec<dim> coefficient = functional.template topRows<dim>().transpose() * m.q;
    if (!is_linear)
      coefficient += functional.template bottomRows<n>().transpose() * products(m.q);
    g += (m.w * (velocity[m.j] - u)) * coefficient.transpose();
  });
  return g;
}

// --- Laplacian rows -------------------------------------------------------------------------

/// One row under construction: neighbour weights in list order, wall weights by projection.
template <int dim> struct Row {
  std::span<double> neighbour;                      // of f_j - f_i
  std::array<double, most_projections<dim>> wall{}; // of g [m]
};

template <int dim> bool has_wrong_signs(const Row<dim> &row, double guard) {
  double negative = 0, positive = 0;
  for (const double a : row.neighbour)
    (a < 0 ? negative : positive) += std::abs(a);
  return negative > guard * positive || !(positive > 0);
}

template <int dim>
void quadratic_row(const Stencil<dim> &s, const Points<dim> &points, const Cloud<dim> &cloud,
                   const Basis<dim> &lap, Row<dim> &row) {
  std::size_t k = 0;
  for_each_neighbour(s, [&](const Neighbour<dim> &n) {
    row.neighbour[k++] = n.w * lap.dot(quadratic_basis(n.q));
  });
  for_each_wall_row(s, cloud, [&](int m, const Projection<dim> &p) {
    const Vec<dim> q = (p.point - points.position[s.i]) / s.h;
    row.wall[m] = wall_weight * s.h * lap.dot(normal_derivative(q, p.normal));
  });
}

/// Renormalised Laplacian with the point's own projections as neighbours of value f_i + d g:
/// 2 dim sum w (1 - r . B o) (f_j - f_i) / sum w |r|^2 (1 - r . B o), B the inverse second moment,
/// o the offset. Exact for linear fields and |r|^2. `skew` = B o = 0 gives positive weights.
/// Source: Basic, Degiuli, Ban, J. Comput. Phys. 354 (2018) 268 (form reconstructed; verified by
/// its identities in the tests).
template <int dim>
void renormalised_row(const Stencil<dim> &s, const Points<dim> &points, const Cloud<dim> &cloud,
                      const Vec<dim> &skew, Row<dim> &row) {
  double denominator = 0;
  std::size_t k = 0;
  for_each_neighbour(s, [&](const Neighbour<dim> &n) {
    const double a = n.w * (1 - n.q.dot(skew));
    row.neighbour[k++] = a;
    denominator += a * n.q.squaredNorm();
  });
  for_each_wall_row(s, cloud, [&](int m, const Projection<dim> &p) {
    const Vec<dim> q = (p.point - points.position[s.i]) / s.h;
    const double a = weight(std::min(q.norm(), 1.0)) * (1 - q.dot(skew));
    row.wall[m] = a * p.distance;
    denominator += a * q.squaredNorm();
  });
  const double scale = denominator != 0 ? 2 * dim / (denominator * s.h * s.h) : 0.0;
  for (double &a : row.neighbour)
    a *= scale;
  for (double &a : row.wall)
    a *= scale;
}

template <int dim>
Vec<dim> renormalising_skew(const Stencil<dim> &s, const Points<dim> &points,
                            const Cloud<dim> &cloud) {
  LinearFit<dim> fit;
  Vec<dim> offset = Vec<dim>::Zero();
  const auto add = [&](const Vec<dim> &q, double w) {
    fit.add(q, w);
    offset += w * q;
  };
  for_each_neighbour(s, [&](const Neighbour<dim> &n) { add(n.q, n.w); });
  for_each_wall_row(s, cloud, [&](int, const Projection<dim> &p) {
    const Vec<dim> q = (p.point - points.position[s.i]) / s.h;
    add(q, weight(std::min(q.norm(), 1.0)));
  });
  return fit.inverse() * offset;
}

/// The fallback ladder: the first row whose signs keep the matrix definite.
template <int dim>
RowKind laplacian_row(const Stencil<dim> &s, const Points<dim> &points, const Cloud<dim> &cloud,
                      const QuadraticFit<dim> *fit, double guard, Row<dim> &row) {
  if (fit) {
    quadratic_row(s, points, cloud, fit->solve(laplacian_functional<dim>(s.h)), row);
    if (!has_wrong_signs(row, guard))
      return RowKind::quadratic;
  }
  row.wall = {};
  renormalised_row(s, points, cloud, renormalising_skew(s, points, cloud), row);
  if (!has_wrong_signs(row, guard))
    return RowKind::linear;
  row.wall = {};
  renormalised_row<dim>(s, points, cloud, Vec<dim>::Zero(), row);
  return RowKind::plain;
}

/// Row of a surface point: pressure falls linearly to zero (or to what acts outside, then p stands
/// for the difference) at the plane half a spacing outside,
/// p_i = a D/2 with the slope a fitted to the interior neighbours at depth d_j below the plane:
/// p_i = D/2 sum w d_j p_j / sum w d_j^2. Exact for hydrostatic pressure; an M-matrix row.
template <int dim>
void surface_row(const Stencil<dim> &s, const Cloud<dim> &cloud, std::span<double> entry) {
  const Vec<dim> &n = cloud.surface_normal[s.i];
  const double half = 0.5 * cloud.spacing / s.h;
  double denominator = 0;
  std::size_t k = 0;
  for_each_neighbour(s, [&](const Neighbour<dim> &m) {
    const double depth = half - n.dot(m.q);
    const bool is_donor = cloud.kind[m.j] == PointKind::interior && depth > half;
    entry[k++] = is_donor ? -half * m.w * depth : 0.0;
    denominator += is_donor ? m.w * depth * depth : 0.0;
  });
  for (double &e : entry)
    e = denominator > 0 ? e / denominator : 0.0;
}

// --- assembly -------------------------------------------------------------------------------

template <int dim> void lay_out(const Cloud<dim> &cloud, PressureProblem<dim> &problem) {
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
template <int dim> class OperatorAssembler {
public:
  OperatorAssembler(const Points<dim> &points, const Cloud<dim> &cloud,
                    const PressureParams &params, PressureProblem<dim> &problem)
      : points_(points), cloud_(cloud), params_(params), problem_(problem) {}

  RowKind row(int i) const {
    Stencil<dim> s;
    gather(i, points_, cloud_, s);
    const RowKind kind = cloud_.kind[i] != PointKind::interior ? open_row(s) : poisson_row(s);
    problem_.row_kind[i] = kind;
    return kind;
  }

private:
  std::span<double> off_diagonal(const Stencil<dim> &s) const {
    return {problem_.matrix.value.data() + problem_.matrix.row_start[s.i] + 1,
            static_cast<std::size_t>(s.count)};
  }

  RowKind open_row(const Stencil<dim> &s) const {
    problem_.matrix.value[problem_.matrix.row_start[s.i]] = 1;
    surface_row(s, cloud_, off_diagonal(s));
    problem_.gradient[s.i] = linear_gradient(s, cloud_);
    if (s.walls)
      problem_.wall_rows[cloud_.wall_slot[s.i]] = {};
    return RowKind::open;
  }

  RowKind poisson_row(const Stencil<dim> &s) const {
    QuadraticFit<dim> fit = quadratic_fit(s, points_, cloud_);
    const bool regular = fit.factorise() && set_quadratic_gradient(s, fit);
    Row<dim> row{off_diagonal(s), {}};
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
  bool set_quadratic_gradient(const Stencil<dim> &s, const QuadraticFit<dim> &fit) const {
    auto &gradient = problem_.gradient[s.i];
    for (int d = 0; d < dim; ++d)
      gradient.col(d) = fit.solve(derivative_functional<dim>(d, s.h));
    return gradient.norm() * s.h < params_.gradient_guard;
  }

  void set_wall_rows(const Stencil<dim> &s,
                     const std::array<double, most_projections<dim>> &laplacian) const {
    const double scale = cloud_.spacing * cloud_.spacing;
    for_each_wall_row(s, cloud_, [&](int m, const Projection<dim> &p) {
      const Vec<dim> q = (p.point - points_.position[s.i]) / s.h;
      WallRow<dim> &wall = problem_.wall_rows[cloud_.wall_slot[s.i]][m];
      wall.laplacian = scale * laplacian[m];
      wall.gradient =
          wall_weight * s.h * (problem_.gradient[s.i].transpose() * normal_derivative(q, p.normal));
    });
  }

  void finish_poisson_row(const Stencil<dim> &s, const Row<dim> &row) const {
    const double scale = cloud_.spacing * cloud_.spacing;
    double sum = 0;
    for (double &a : row.neighbour) {
      a *= -scale;
      sum -= a;
    }
    problem_.matrix.value[problem_.matrix.row_start[s.i]] = sum > 0 ? sum : 1.0;
  }

  const Points<dim> &points_;
  const Cloud<dim> &cloud_;
  const PressureParams &params_;
  PressureProblem<dim> &problem_;
};

/// What the predicted velocity adds: its gradient, its approach to the walls, the source.
template <int dim> class SourceAssembler {
public:
  SourceAssembler(const Points<dim> &points, const Cloud<dim> &cloud, const PressureParams &params,
                  VecView<dim> velocity, std::span<const double> target, double dt,
                  PressureProblem<dim> &problem)
      : points_(points), cloud_(cloud), velocity_(velocity), target_(target),
        factor_(params.density / dt), problem_(problem) {}

  void row(int i) const {
    Stencil<dim> s;
    gather(i, points_, cloud_, s);
    problem_.velocity_gradient[i] = velocity_gradient(s, velocity_, functional_of(s));
    problem_.fluid_source[i] = s.open ? surface_source(s) : -source_of(s);
  }

private:
  // Far from walls the pressure's gradient, which is quadratic; next to one its rows do not hold
  // for a velocity.
  Functionals<dim> functional_of(const Stencil<dim> &s) const {
    bool near_wall = false;
    for_each_wall_row(s, cloud_, [&](int, const Projection<dim> &) { near_wall = true; });
    if (problem_.row_kind[s.i] == RowKind::quadratic && !near_wall)
      return problem_.gradient[s.i];
    Functionals<dim> functional = Functionals<dim>::Zero();
    functional.template topRows<dim>() = fluid_gradient(s);
    return functional;
  }

  // The row acts on the difference to the pressure outside.
  double surface_source(const Stencil<dim> &s) const {
    const double outside = points_.surface_pressure[s.i];
    if (outside == 0)
      return 0;
    const SparseMatrix &matrix = problem_.matrix;
    const auto first = matrix.value.begin() + matrix.row_start[s.i];
    return outside * std::accumulate(first, first + 1 + s.count, 0.0);
  }

  double source_of(const Stencil<dim> &s) const {
    const double scale = cloud_.spacing * cloud_.spacing;
    const Mat<dim> &gradient = problem_.velocity_gradient[s.i];
    double source = factor_ * (gradient.trace() - target_[s.i]) * scale;
    for_each_wall_row(s, cloud_, [&](int m, const Projection<dim> &p) {
      const Vec<dim> at_wall = velocity_[s.i] + gradient * (p.point - points_.position[s.i]);
      WallRow<dim> &wall = problem_.wall_rows[cloud_.wall_slot[s.i]][m];
      wall.approach = p.normal.dot(at_wall);
      source -= wall.laplacian * factor_ * wall.approach;
    });
    return source;
  }

  const Points<dim> &points_;
  const Cloud<dim> &cloud_;
  VecView<dim> velocity_;
  std::span<const double> target_;
  double factor_;
  PressureProblem<dim> &problem_;
};

// --- tension ----------------------------------------------------------------------------------

template <int dim> bool is_next_to_air(int i, const Points<dim> &points, const Cloud<dim> &cloud) {
  const double near = 1.5 * cloud.spacing;
  for (const int j : cloud.neighbours.of(i)) {
    const bool is_air =
        cloud.kind[j] != PointKind::interior || points.at_surface[j] == SurfaceMemory::released;
    if (is_air && (points.position[j] - points.position[i]).squaredNorm() < near * near)
      return true;
  }
  return false;
}

// One Jacobi step from the last pressure: is row i pulled below zero?
template <int dim>
bool is_in_tension(int i, const Points<dim> &points, const PressureProblem<dim> &problem) {
  const SparseMatrix &matrix = problem.matrix;
  double pull = problem.source[i];
  for (int k = matrix.row_start[i] + 1; k < matrix.row_start[i + 1]; ++k)
    pull -= matrix.value[k] * points.pressure[matrix.column[k]];
  return pull < 0;
}

} // namespace

template <int dim>
int release_tension(Points<dim> &points, const Walls<dim> &walls, const PressureParams &params,
                    VecView<dim> predicted_velocity, std::span<const double> target_divergence,
                    double dt, Cloud<dim> &cloud, PressureProblem<dim> &problem) {
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
  const OperatorAssembler<dim> operators(points, cloud, params, problem);
  const SourceAssembler<dim> sources(points, cloud, params, predicted_velocity, target_divergence,
                                     dt, problem);
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

template <int dim>
void assemble_pressure_operators(const Points<dim> &points, const Cloud<dim> &cloud,
                                 const PressureParams &params, PressureProblem<dim> &problem) {
  lay_out(cloud, problem);
  const OperatorAssembler<dim> assemble(points, cloud, params, problem);
  const auto counts = block_sums<4>(
      points.size(),
      [&](IndexRange range) {
        std::array<double, 4> count{};
        for (int i = range.begin; i < range.end; ++i)
          count[static_cast<std::size_t>(assemble.row(i))] += 1;
        return count;
      },
      Work::heavy);
  problem.rows = {static_cast<int>(counts[0]), static_cast<int>(counts[1]),
                  static_cast<int>(counts[2]), static_cast<int>(counts[3])};
  problem.has_open_point = problem.rows.open > 0;
}

template <int dim>
void assemble_pressure_source(const Points<dim> &points, const Cloud<dim> &cloud,
                              const PressureParams &params, VecView<dim> predicted_velocity,
                              std::span<const double> target_divergence, double dt,
                              PressureProblem<dim> &problem) {
  const SourceAssembler<dim> assemble(points, cloud, params, predicted_velocity, target_divergence,
                                      dt, problem);
  for_each_point(points.size(), [&](int i) { assemble.row(i); });
}

template <int dim>
void set_wall_velocity(const Walls<dim> &walls, const Cloud<dim> &cloud,
                       const PressureParams &params, double dt, PressureProblem<dim> &problem) {
  problem.source = problem.fluid_source;
  const double factor = params.density / dt;
  for_each_index(static_cast<int>(cloud.wall_points.size()), [&](int k) {
    const PointWalls<dim> &projections = cloud.point_walls[k];
    for (int m = 0; m < projections.count; ++m) {
      const Projection<dim> &p = projections.projection[m];
      if (!has_row(p, cloud))
        continue;
      WallRow<dim> &wall = problem.wall_rows[k][m];
      const double wall_speed = p.normal.dot(wall_velocity(walls, p));
      wall.datum = factor * (wall.approach - wall_speed);
      problem.source[cloud.wall_points[k]] -= wall.laplacian * factor * wall_speed;
    }
  });
}

namespace {

/// grad p at a point with the given data at its walls: datum(m, projection) [Pa/m].
template <int dim, class Datum>
Vec<dim> gradient_with(Datum &&datum, int i, const Points<dim> &points, const Cloud<dim> &cloud,
                       const PressureProblem<dim> &problem, std::span<const double> pressure) {
  Stencil<dim> s;
  gather(i, points, cloud, s);
  const auto &functional = problem.gradient[i];
  Vec<dim> gradient = Vec<dim>::Zero();
  for_each_neighbour(s, [&](const Neighbour<dim> &n) {
    const double scaled = n.w * (pressure[n.j] - pressure[i]);
    gradient += scaled * (functional.transpose() * quadratic_basis(n.q));
  });
  if (s.open)
    gradient -= weight(s.open_side.norm()) * (pressure[i] - points.surface_pressure[i]) *
                (functional.template topRows<dim>().transpose() * s.open_side);
  else
    for_each_wall_row(s, cloud, [&](int m, const Projection<dim> &p) {
      gradient += datum(m, p) * problem.wall_rows[cloud.wall_slot[i]][m].gradient;
    });
  return gradient;
}

} // namespace

template <int dim>
Vec<dim> pressure_gradient(int i, const Points<dim> &points, const Cloud<dim> &cloud,
                           const PressureProblem<dim> &problem, std::span<const double> pressure) {
  const auto datum = [&](int m, const Projection<dim> &) {
    return problem.wall_rows[cloud.wall_slot[i]][m].datum;
  };
  return gradient_with(datum, i, points, cloud, problem, pressure);
}

template <int dim>
Vec<dim> carried_pressure_gradient(int i, const Points<dim> &points, const Cloud<dim> &cloud,
                                   const PressureProblem<dim> &problem) {
  const auto datum = [&](int, const Projection<dim> &p) {
    return p.normal.dot(points.pressure_gradient[i]);
  };
  return gradient_with(datum, i, points, cloud, problem, points.pressure);
}

template void assemble_pressure_operators(const Points<2> &, const Cloud<2> &,
                                          const PressureParams &, PressureProblem<2> &);
template void assemble_pressure_source(const Points<2> &, const Cloud<2> &, const PressureParams &,
                                       VecView<2>, std::span<const double>, double,
                                       PressureProblem<2> &);
template int release_tension(Points<2> &, const Walls<2> &, const PressureParams &, VecView<2>,
                             std::span<const double>, double, Cloud<2> &, PressureProblem<2> &);
template void set_wall_velocity(const Walls<2> &, const Cloud<2> &, const PressureParams &, double,
                                PressureProblem<2> &);
template Vec<2> carried_pressure_gradient(int, const Points<2> &, const Cloud<2> &,
                                          const PressureProblem<2> &);
template Vec<3> carried_pressure_gradient(int, const Points<3> &, const Cloud<3> &,
                                          const PressureProblem<3> &);
template Vec<2> pressure_gradient(int, const Points<2> &, const Cloud<2> &,
                                  const PressureProblem<2> &, std::span<const double>);
template void assemble_pressure_operators(const Points<3> &, const Cloud<3> &,
                                          const PressureParams &, PressureProblem<3> &);
template void assemble_pressure_source(const Points<3> &, const Cloud<3> &, const PressureParams &,
                                       VecView<3>, std::span<const double>, double,
                                       PressureProblem<3> &);
template int release_tension(Points<3> &, const Walls<3> &, const PressureParams &, VecView<3>,
                             std::span<const double>, double, Cloud<3> &, PressureProblem<3> &);
template void set_wall_velocity(const Walls<3> &, const Cloud<3> &, const PressureParams &, double,
                                PressureProblem<3> &);
template Vec<3> pressure_gradient(int, const Points<3> &, const Cloud<3> &,
                                  const PressureProblem<3> &, std::span<const double>);

} // namespace sluice::fluid
