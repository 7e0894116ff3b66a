// SPDX-License-Identifier: MIT
// The rows of the pressure's matrix. Most points are like their neighbours, enclosed by water and
// far from walls: their rows are made eight at a time. What is left, and what the guard refuses, is
// made one by one.
#include "fluid/packed_stencil.hpp"
#include "fluid/pressure_stencil.hpp"

#include <bit>
#include <cmath>

namespace sluice::fluid {

namespace {

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

// --- Laplacian rows -------------------------------------------------------------------------

/// One row under construction: neighbour weights in list order, wall weights by projection.
template <int dim> struct Row {
  int count = 0;
  std::array<double, most_neighbours<dim>> neighbour; // of f_j - f_i
  std::array<double, most_projections<dim>> wall{};   // of g [m]

  std::span<double> weights() { return {neighbour.data(), static_cast<std::size_t>(count)}; }
};

template <int dim> bool has_wrong_signs(Row<dim> &row, double guard) {
  double negative = 0, positive = 0;
  for (const double a : row.weights())
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
  for (double &a : row.weights())
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

/// Blends `row` with as much of `other`, whose signs pass the guard, as it takes to pass it too,
/// to 1/64. With N and P the sums of negative and positive weights, N - guard P is convex in the
/// share (for a guard above 1 concave): it has one zero. Both rows are consistent, and so is what
/// lies between. Derived here.
template <int dim> void blend_until_signs_pass(const Row<dim> &other, double guard, Row<dim> &row) {
  const auto blend = [](double share, double a, double b) { return (1 - share) * a + share * b; };
  const auto passes = [&](double share) {
    double negative = 0, positive = 0;
    for (int k = 0; k < row.count; ++k) {
      const double a = blend(share, row.neighbour[k], other.neighbour[k]);
      (a < 0 ? negative : positive) += std::abs(a);
    }
    return negative <= guard * positive;
  };
  double too_little = 0, enough = 1;
  while (enough - too_little > 1.0 / 64) {
    const double middle = 0.5 * (too_little + enough);
    (passes(middle) ? enough : too_little) = middle;
  }
  for (int k = 0; k < row.count; ++k)
    row.neighbour[k] = blend(enough, row.neighbour[k], other.neighbour[k]);
  for (std::size_t m = 0; m < row.wall.size(); ++m)
    row.wall[m] = blend(enough, row.wall[m], other.wall[m]);
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
  Row<dim> linear;
  linear.count = row.count;
  renormalised_row(s, points, cloud, renormalising_skew(s, points, cloud), linear);
  if (!has_wrong_signs(linear, guard)) {
    if (fit)
      blend_until_signs_pass(linear, guard, row);
    else
      row = linear;
    return fit ? RowKind::blended : RowKind::linear;
  }
  row.wall = {};
  renormalised_row<dim>(s, points, cloud, Vec<dim>::Zero(), row);
  return RowKind::plain;
}

/// Row of a surface point: pressure falls linearly to zero (or to what acts outside, then p stands
/// for the difference) at the plane of the surface, at distance D outside,
/// p_i = a D with the slope a fitted to the interior neighbours at depth d_j below the plane:
/// p_i = D sum w d_j p_j / sum w d_j^2. Exact for hydrostatic pressure; an M-matrix row.
template <int dim>
void surface_row(const Stencil<dim> &s, const Cloud<dim> &cloud, std::span<double> entry) {
  const Vec<dim> &n = cloud.surface_normal[s.i];
  const double outside = cloud.surface_depth[s.i] / s.h;
  double denominator = 0;
  std::size_t k = 0;
  for_each_neighbour(s, [&](const Neighbour<dim> &m) {
    const double depth = outside - n.dot(m.q);
    const bool is_donor = cloud.kind[m.j] == PointKind::interior && depth > outside;
    entry[k++] = is_donor ? -outside * m.w * depth : 0.0;
    denominator += is_donor ? m.w * depth * depth : 0.0;
  });
  for (double &e : entry)
    e = denominator > 0 ? e / denominator : 0.0;
}

// --- assembly -------------------------------------------------------------------------------

template <int dim> void lay_out(const Cloud<dim> &cloud, PressureProblem<dim> &problem) {
  const int n = static_cast<int>(cloud.kind.size());
  copy_pattern(cloud.slices, problem.matrix.pattern);
  problem.matrix.diagonal.resize(n);
  problem.matrix.off_diagonal.resize(cloud.slices.stored());
  problem.fluid_source.resize(n);
  problem.source.resize(n);
  problem.gradient.resize(n);
  problem.row_kind.resize(n);
  problem.velocity_gradient.resize(n);
  problem.wall_rows.resize(cloud.point_walls.size()); // grows in large pieces, unlike assign()
  std::fill(problem.wall_rows.begin(), problem.wall_rows.end(),
            std::array<WallRow<dim>, most_projections<dim>>{});
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
    Row<dim> row;
    row.count = s.count;
    const RowKind kind =
        cloud_.kind[i] != PointKind::interior ? open_row(s, row) : poisson_row(s, row);
    store(i, row);
    problem_.row_kind[i] = kind;
    return kind;
  }

  /// Rows of the points first .. first + 7.
  void rows(int first) const {
    const PackedStencil<dim> s(first, points_, cloud_);
    unsigned made = is_quadratic() ? regular_points(s) : 0;
    if (std::popcount(made) >= fewest_in_pack)
      made &= quadratic_rows(s);
    else
      made = 0;
    for (int l = 0; l < s.count(); ++l)
      if ((made >> l & 1) == 0)
        row(first + l);
  }

private:
  bool is_quadratic() const { return params_.operators == PressureOperators::quadratic; }

  // Below this a pack costs more than the points one by one.
  static constexpr int fewest_in_pack = 2;

  unsigned regular_points(const PackedStencil<dim> &s) const {
    unsigned regular = 0;
    for (int l = 0; l < s.count(); ++l) {
      const int i = s.first() + l;
      const bool is_regular = cloud_.openness[i] == 0 && !has_wall_row(i, cloud_);
      regular |= static_cast<unsigned>(is_regular) << l;
    }
    return regular;
  }

  // Quadratic rows and gradients for all, of use where there is air or wall no more than for the
  // lanes that do not pass the guards; returns those that do.
  unsigned quadratic_rows(const PackedStencil<dim> &s) const {
    std::array<PackVec<dim>, most_neighbours<dim>> q;
    std::array<Pack, most_neighbours<dim>> w;
    PackedFit<dim> fit;
    for (int k = 0; k < s.width(); ++k) {
      q[k] = s.offset(k);
      w[k] = s.weight_at(q[k]);
      fit.add_neighbour(q[k], w[k]);
    }
    PackMask passes = fit.factorise();
    passes &= packed_gradients(s, fit);
    const auto lap =
        fit.solve(-cloud_.spacing * cloud_.spacing * laplacian_functional<dim>(cloud_.radius));
    Pack negative{}, positive{};
    double *entry = &problem_.matrix.off_diagonal[cloud_.slices.place(s.first(), 0)];
    for (int k = 0; k < s.width(); ++k, entry += SlicedPattern::lanes) {
      const auto basis = quadratic_basis(q[k]);
      Pack a = lap[0] * basis[0];
      for (std::size_t t = 1; t < basis.size(); ++t)
        a += lap[t] * basis[t];
      a *= w[k];
      sluice::fluid::store(a, entry);
      negative += a < 0 ? Pack{} : a; // of -a, the weight in the Laplacian
      positive -= a < 0 ? a : Pack{};
    }
    passes &= (negative <= params_.row_guard * positive) & (positive > 0);
    const Pack sum = positive - negative;
    scatter(sum > 0 ? sum : Pack{} + 1, s.count(), &problem_.matrix.diagonal[s.first()]);
    std::fill_n(&problem_.row_kind[s.first()], s.count(), RowKind::quadratic);
    return bits_of(passes);
  }

  PackMask packed_gradients(const PackedStencil<dim> &s, const PackedFit<dim> &fit) const {
    std::array<Pack, n_terms<dim> * dim> gradient;
    Pack norm2{};
    for (int d = 0; d < dim; ++d) {
      const auto functional = fit.solve(derivative_functional<dim>(d, cloud_.radius));
      for (int t = 0; t < n_terms<dim>; ++t) {
        gradient[d * n_terms<dim> + t] = functional[t];
        norm2 += functional[t] * functional[t];
      }
    }
    scatter(gradient, s.count(), &problem_.gradient[s.first()]);
    const double largest = params_.gradient_guard / cloud_.radius;
    return norm2 < largest * largest;
  }

  // Filled up with zeros.
  void store(int i, const Row<dim> &row) const {
    SlicedMatrix &matrix = problem_.matrix;
    for (int k = 0; k < matrix.pattern.width(i); ++k)
      matrix.off_diagonal[matrix.pattern.place(i, k)] = k < row.count ? row.neighbour[k] : 0.0;
  }

  RowKind open_row(const Stencil<dim> &s, Row<dim> &row) const {
    problem_.matrix.diagonal[s.i] = 1;
    surface_row(s, cloud_, row.weights());
    problem_.gradient[s.i] = linear_gradient(s, cloud_);
    if (s.walls)
      problem_.wall_rows[cloud_.wall_slot[s.i]] = {};
    return RowKind::open;
  }

  RowKind poisson_row(const Stencil<dim> &s, Row<dim> &row) const {
    QuadraticFit<dim> fit = quadratic_fit(s, points_, cloud_);
    const bool regular = is_quadratic() && fit.factorise() && set_quadratic_gradient(s, fit);
    const RowKind kind =
        laplacian_row(s, points_, cloud_, regular ? &fit : nullptr, params_.row_guard, row);
    if (!has_quadratic_gradient(kind))
      problem_.gradient[s.i] = linear_gradient(s, cloud_);
    const double share = 1 - cloud_.openness[s.i];
    for (double &w : row.wall)
      w *= share;
    set_wall_rows(s, row.wall);
    finish_poisson_row(s, row);
    if (share < 1)
      blend_with_surface(s, share, row);
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

  void finish_poisson_row(const Stencil<dim> &s, Row<dim> &row) const {
    const double scale = cloud_.spacing * cloud_.spacing;
    double sum = 0;
    for (double &a : row.weights()) {
      a *= -scale;
      sum -= a;
    }
    problem_.matrix.diagonal[s.i] = sum > 0 ? sum : 1.0;
  }

  // A point that comes up to the surface passes from one row to the other without a jump.
  void blend_with_surface(const Stencil<dim> &s, double share, Row<dim> &row) const {
    std::array<double, most_neighbours<dim>> at_surface;
    const std::span<double> entry(at_surface.data(), s.count);
    surface_row(s, cloud_, entry);
    const double diagonal = problem_.matrix.diagonal[s.i];
    for (int k = 0; k < s.count; ++k)
      row.neighbour[k] = share * row.neighbour[k] + (1 - share) * diagonal * entry[k];
  }

  const Points<dim> &points_;
  const Cloud<dim> &cloud_;
  const PressureParams &params_;
  PressureProblem<dim> &problem_;
};

} // namespace

template <int dim>
RowKind assemble_pressure_row(int i, const Points<dim> &points, const Cloud<dim> &cloud,
                              const PressureParams &params, PressureProblem<dim> &problem) {
  return OperatorAssembler<dim>(points, cloud, params, problem).row(i);
}

template <int dim>
void assemble_pressure_operators(const Points<dim> &points, const Cloud<dim> &cloud,
                                 const PressureParams &params, PressureProblem<dim> &problem) {
  lay_out(cloud, problem);
  const OperatorAssembler<dim> assemble(points, cloud, params, problem);
  for_each_pack(points.size(), [&](int first) { assemble.rows(first); });
  problem.rows = {};
  for (const RowKind kind : problem.row_kind)
    ++problem.rows.of(kind);
  problem.has_open_point = problem.rows.open > 0;
}

template void assemble_pressure_operators(const Points<2> &, const Cloud<2> &,
                                          const PressureParams &, PressureProblem<2> &);
template RowKind assemble_pressure_row(int, const Points<2> &, const Cloud<2> &,
                                       const PressureParams &, PressureProblem<2> &);
template void assemble_pressure_operators(const Points<3> &, const Cloud<3> &,
                                          const PressureParams &, PressureProblem<3> &);
template RowKind assemble_pressure_row(int, const Points<3> &, const Cloud<3> &,
                                       const PressureParams &, PressureProblem<3> &);

} // namespace sluice::fluid
