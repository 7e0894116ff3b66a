// SPDX-License-Identifier: MIT
#include "fluid/viscous_rows.hpp"

#include "fluid/least_squares.hpp"
#include "fluid/parallel.hpp"
#include "fluid/weights.hpp"

#include <algorithm>
#include <cmath>

namespace sluice::fluid {

namespace {

// Largest share of negative weights in a row; as in the pressure's rows.
constexpr double row_guard = 0.1;
// Weight of a wall's velocity in the fits, in that of a neighbour at its place: it stands for all
// the fluid beyond. With 1 rows half a spacing from the wall have 7 % of negative weights, a
// quarter of a spacing from it 31 %; from 10 on none.
constexpr double wall_weight = 20;
// Norm of the gradient's functional, times the kernel radius, beyond which it amplifies the noise
// of single points. On a lattice it is 14 next to a wall and 24 to 40 at the surface, where the
// cloud is one-sided.
constexpr double largest_norm = 45;

// Sum of w r^2 / radius^2 over the neighbours on a square lattice: what a pair's weight is measured
// against.
template <int dim> double lattice_second_moment() {
  double sum = 0;
  constexpr int reach = 3, depth = dim == 3 ? reach : 0;
  static_assert(reach >= kernel_radius_ratio);
  for (int k = -depth; k <= depth; ++k)
    for (int j = -reach; j <= reach; ++j)
      for (int i = -reach; i <= reach; ++i) {
        const double q = (dim == 2 ? std::hypot(i, j) : std::hypot(i, j, k)) / kernel_radius_ratio;
        if (q > 0 && q < 1)
          sum += weight(q) * q * q;
      }
  return sum;
}

bool has_wrong_signs(double negative, double positive) {
  return negative > row_guard * positive || !(positive > 0);
}

// Unit vectors along the surface with the normal n.
std::array<Vec<2>, 1> tangents_of(const Vec<2> &n) { return {rotated_left(n)}; }
std::array<Vec<3>, 2> tangents_of(const Vec<3> &n) {
  int least = 0; // the axis farthest from n
  n.cwiseAbs().minCoeff(&least);
  const Vec<3> t = cross(n, Vec<3>(Vec<3>::Unit(least))).normalized();
  return {t, cross(n, t)};
}

enum class Kind { quadratic, linear, surface, pairs };

/// Is the pressure's row that of a velocity too?
template <int dim>
bool is_like_pressures(int i, const Cloud<dim> &cloud, const PressureProblem<dim> &pressure) {
  const PointWalls<dim> *walls = cloud.walls_of(i);
  return cloud.openness[i] == 0 && (!walls || walls->count == 0) &&
         has_quadratic_gradient(pressure.row_kind[i]);
}

/// Builds the rows of one point, with or without those of the gradient.
template <int dim, bool with_gradient> class StencilBuilder {
public:
  StencilBuilder(const Points<dim> &points, const Cloud<dim> &cloud,
                 const PressureProblem<dim> &pressure, ViscousRows<dim> &rows)
      : points_(points), cloud_(cloud), pressure_(pressure), rows_(rows) {}

  Kind build(int i) const {
    if (!with_gradient && is_like_pressures(i, cloud_, pressure_)) {
      rows_.form[i] = ViscousRowForm::pressures;
      return Kind::quadratic;
    }
    const Row row = gather(i);
    rows_.form[i] = ViscousRowForm::blocks;
    if (cloud_.kind[i] == PointKind::surface && surface_row(row))
      return Kind::surface;
    if (cloud_.kind[i] != PointKind::interior) {
      pair_row(row);
      return Kind::pairs;
    }
    if (slides(row) && slip_row(row))
      return Kind::quadratic;
    rows_.form[i] = ViscousRowForm::scalar;
    if (is_like_pressures(i, cloud_, pressure_)) {
      pressures_row(row);
      return Kind::quadratic;
    }
    if (!slides(row) && quadratic_row(row))
      return Kind::quadratic;
    linear_row(row);
    return Kind::linear;
  }

private:
  struct Row {
    int i;
    std::span<const int> neighbours;
    double *laplacian;
    Vec<dim> *gradient;
    Mat<dim> *block;
    const PointWalls<dim> *walls;                                    // or nullptr
    std::array<ViscousWallWeight<dim>, most_projections<dim>> *wall; // with them
  };

  Row gather(int i) const {
    const int start = rows_.start[i];
    return {i,
            cloud_.neighbours.of(i),
            rows_.laplacian.data() + start,
            rows_.gradient.data() + start,
            rows_.block.data() + start,
            cloud_.walls_of(i),
            cloud_.walls_of(i) ? &rows_.wall_weights[cloud_.wall_slot[i]] : nullptr};
  }
  Vec<dim> scaled(int i, const Vec<dim> &x) const {
    return (x - points_.position[i]) / cloud_.radius;
  }
  static double weight_at(const Vec<dim> &q) { return weight(std::min(q.norm(), 1.0)); }

  /// visit(k, q, w) for neighbours, wall_visit(m, q, w) for walls.
  template <class Visit, class WallVisit>
  void for_each(const Row &row, Visit &&visit, WallVisit &&wall_visit) const {
    for (std::size_t k = 0; k < row.neighbours.size(); ++k) {
      const Vec<dim> q = scaled(row.i, points_.position[row.neighbours[k]]);
      visit(k, q, weight_at(q));
    }
    if (row.walls)
      for (int m = 0; m < row.walls->count; ++m) {
        const Vec<dim> q = scaled(row.i, row.walls->projection[m].point);
        if (!row.walls->projection[m].slips)
          wall_visit(m, q, wall_weight * weight_at(q));
      }
  }

  static bool is_gliding(const Projection<dim> &p) { return p.slips && !p.at_edge; }
  bool slides(const Row &row) const {
    return row.walls && std::any_of(row.walls->begin(), row.walls->end(), is_gliding);
  }

  // Does the wall's velocity hold for the component along e? A no-slip wall's for all, that of one
  // that slips for what crosses it.
  static bool holds_along(const Projection<dim> &p, const Vec<dim> &e) {
    constexpr double closer_to_normal = 0.7;
    return !p.slips || std::abs(p.normal.dot(e)) > closer_to_normal;
  }

  /// The neighbours in scaled coordinates, and their fit.
  struct Fitted {
    std::array<Basis<dim>, most_neighbours<dim>> basis; // times the weight
    QuadraticFit<dim> fit;
  };
  void fit_neighbours(const Row &row, Fitted &fitted) const {
    for (std::size_t k = 0; k < row.neighbours.size(); ++k) {
      const Vec<dim> q = scaled(row.i, points_.position[row.neighbours[k]]);
      const double w = weight_at(q);
      fitted.basis[k] = w * quadratic_basis(q);
      fitted.fit.add_neighbour(q, w);
    }
  }

  /// One quadratic fit for the component along the normal of the first wall that slips, and one for
  /// each along it.
  bool slip_row(const Row &row) const {
    std::fill_n(row.block, row.neighbours.size(), Mat<dim>(Mat<dim>::Zero()));
    for (int m = 0; m < row.walls->count; ++m)
      (*row.wall)[m] = {};
    Fitted fitted;
    fit_neighbours(row, fitted);
    const Vec<dim> n = std::find_if(row.walls->begin(), row.walls->end(), is_gliding)->normal;
    if (!add_component(row, fitted, n))
      return false;
    for (const Vec<dim> &t : tangents_of(n))
      if (!add_component(row, fitted, t))
        return false;
    set_linear_gradient(row);
    return true;
  }

  // Adds the Laplacian of the component along e to the row's blocks.
  bool add_component(const Row &row, const Fitted &fitted, const Vec<dim> &e) const {
    QuadraticFit<dim> fit = fitted.fit;
    const auto for_each_held = [&](auto &&visit) {
      for (int m = 0; m < row.walls->count; ++m)
        if (const Projection<dim> &p = row.walls->projection[m]; holds_along(p, e))
          visit(m, scaled(row.i, p.point));
    };
    for_each_held(
        [&](int, const Vec<dim> &q) { fit.add_neighbour(q, wall_weight * weight_at(q)); });
    for (const Projection<dim> &p : *row.walls)
      if (const Vec<dim> q = scaled(row.i, p.point); is_gliding(p) && !holds_along(p, e))
        fit.add_row(normal_derivative(q, p.normal), weight_at(q));
    if (!fit.factorise())
      return false;
    const Basis<dim> laplacian = fit.solve(laplacian_functional<dim>(cloud_.radius));
    const Mat<dim> along = outer(e, e);
    double negative = 0, positive = 0;
    const auto add = [&](Mat<dim> &block, double value) {
      block += value * along;
      (value < 0 ? negative : positive) += std::abs(value);
    };
    for (std::size_t k = 0; k < row.neighbours.size(); ++k)
      add(row.block[k], laplacian.dot(fitted.basis[k]));
    for_each_held([&](int m, const Vec<dim> &q) {
      add((*row.wall)[m].block, wall_weight * weight_at(q) * laplacian.dot(quadratic_basis(q)));
    });
    return !has_wrong_signs(negative, positive);
  }

  void pressures_row(const Row &row) const {
    const SlicedMatrix &matrix = pressure_.matrix;
    for (std::size_t k = 0; k < row.neighbours.size(); ++k)
      row.laplacian[k] = rows_.pressure_scale *
                         matrix.off_diagonal[matrix.pattern.place(row.i, static_cast<int>(k))];
    const auto &functional = pressure_.gradient[row.i];
    for (std::size_t k = 0; k < row.neighbours.size(); ++k) {
      const Vec<dim> q = scaled(row.i, points_.position[row.neighbours[k]]);
      row.gradient[k] = weight_at(q) * (functional.transpose() * quadratic_basis(q));
    }
  }

  bool quadratic_row(const Row &row) const {
    QuadraticFit<dim> fit;
    const auto add = [&](std::size_t, const Vec<dim> &q, double w) { fit.add_neighbour(q, w); };
    for_each(row, add, add);
    if (!fit.factorise())
      return false;
    const double h = cloud_.radius;
    const Basis<dim> lap = fit.solve(laplacian_functional<dim>(h));
    std::array<Basis<dim>, dim> slope;
    double norm2 = 0;
    for (int d = 0; d < dim; ++d) {
      slope[d] = fit.solve(derivative_functional<dim>(d, h));
      norm2 += slope[d].squaredNorm();
    }
    if (std::sqrt(norm2) * h > largest_norm)
      return false;
    double negative = 0, positive = 0;
    const auto set = [&](double &laplacian, Vec<dim> &gradient, const Vec<dim> &q, double w) {
      const Basis<dim> basis = w * quadratic_basis(q);
      laplacian = lap.dot(basis);
      for (int d = 0; d < dim; ++d)
        gradient[d] = slope[d].dot(basis);
      (laplacian < 0 ? negative : positive) += std::abs(laplacian);
    };
    for_each(
        row,
        [&](std::size_t k, const Vec<dim> &q, double w) {
          set(row.laplacian[k], row.gradient[k], q, w);
        },
        [&](int m, const Vec<dim> &q, double w) {
          set((*row.wall)[m].laplacian, (*row.wall)[m].gradient, q, w);
        });
    return !has_wrong_signs(negative, positive);
  }

  /// Renormalised Laplacian (see pressure.cpp) with the skewness limited so that no weight is
  /// negative, and the linear gradient.
  void linear_row(const Row &row) const {
    LinearFit<dim> fit;
    Vec<dim> offset = Vec<dim>::Zero();
    const auto add = [&](std::size_t, const Vec<dim> &q, double w) {
      fit.add(q, w);
      offset += w * q;
    };
    for_each(row, add, add);
    const Mat<dim> inverse = fit.inverse();
    const Vec<dim> skew = inverse * offset;
    double denominator = 0;
    const auto set = [&](double &laplacian, Vec<dim> &gradient, const Vec<dim> &q, double w) {
      laplacian = w * std::max(1 - q.dot(skew), 0.0);
      denominator += laplacian * q.squaredNorm();
      gradient = w / cloud_.radius * (inverse * q);
    };
    for_each(
        row,
        [&](std::size_t k, const Vec<dim> &q, double w) {
          set(row.laplacian[k], row.gradient[k], q, w);
        },
        [&](int m, const Vec<dim> &q, double w) {
          set((*row.wall)[m].laplacian, (*row.wall)[m].gradient, q, w);
        });
    const double scale =
        denominator > 0 ? 2 * dim / (denominator * cloud_.radius * cloud_.radius) : 0.0;
    for (std::size_t k = 0; k < row.neighbours.size(); ++k)
      row.laplacian[k] *= scale;
    if (row.walls)
      for (int m = 0; m < row.walls->count; ++m)
        (*row.wall)[m].laplacian *= scale;
  }

  // Functionals on the coefficients of each component that vanish half a spacing outside a surface
  // point: tangential tractions, and the divergence.
  std::array<std::array<Basis<dim>, dim>, dim> surface_conditions(const Vec<dim> &n) const {
    const Vec<dim> q = 0.5 * cloud_.spacing / cloud_.radius * n;
    std::array<Basis<dim>, dim> d;
    for (int b = 0; b < dim; ++b)
      d[b] = normal_derivative<dim>(q, Vec<dim>::Unit(b));
    std::array<std::array<Basis<dim>, dim>, dim> condition; // [condition][component]
    const auto tangents = tangents_of(n);
    for (int r = 0; r + 1 < dim; ++r)
      for (int a = 0; a < dim; ++a) {
        const Vec<dim> &t = tangents[r];
        condition[r][a] = Basis<dim>::Zero();
        for (int b = 0; b < dim; ++b)
          condition[r][a] += (t[a] * n[b] + t[b] * n[a]) * d[b];
      }
    condition[dim - 1] = d;
    return condition;
  }

  /// All components together: the moment matrix is that of one component, `dim` times, plus the
  /// rows of the conditions. These enter through the formula of Sherman, Morrison and Woodbury.
  bool surface_row(const Row &row) const {
    if (row.walls && row.walls->count > 0)
      return false;
    QuadraticFit<dim> fit;
    const auto add = [&](std::size_t, const Vec<dim> &q, double w) { fit.add_neighbour(q, w); };
    for_each(row, add, add);
    if (!fit.factorise())
      return false;
    const auto condition = surface_conditions(cloud_.surface_normal[row.i]);
    auto inverse = condition;
    for (auto &of_condition : inverse)
      for (Basis<dim> &functional : of_condition)
        functional = fit.solve(functional);
    Mat<dim> capacitance = Mat<dim>::Identity();
    for (int r = 0; r < dim; ++r)
      for (int s = 0; s < dim; ++s)
        for (int a = 0; a < dim; ++a)
          capacitance(r, s) += condition[r][a].dot(inverse[s][a]);
    const Mat<dim> solve = capacitance.inverse();
    // The functional of `wanted` of component a on the data of component c.
    const auto constrained = [&](const Basis<dim> &wanted, int a, int c) -> Basis<dim> {
      Vec<dim> defect;
      for (int r = 0; r < dim; ++r)
        defect[r] = condition[r][a].dot(wanted);
      const Vec<dim> answer = solve * defect;
      Basis<dim> change = -answer[0] * inverse[0][c] - answer[1] * inverse[1][c];
      if constexpr (dim == 3)
        change -= answer[2] * inverse[2][c];
      return a == c ? Basis<dim>(wanted + change) : change;
    };
    const Basis<dim> laplacian = fit.solve(laplacian_functional<dim>(cloud_.radius));
    std::array<Basis<dim>, dim> slope;
    for (int d = 0; d < dim; ++d)
      slope[d] = fit.solve(derivative_functional<dim>(d, 1));
    double norm2 = 0;
    std::array<std::array<Basis<dim>, dim>, dim> functional;
    for (int a = 0; a < dim; ++a)
      for (int c = 0; c < dim; ++c) {
        functional[a][c] = constrained(laplacian, a, c);
        for (const Basis<dim> &derivative : slope)
          norm2 += constrained(derivative, a, c).squaredNorm();
      }
    if (norm2 / dim > largest_norm * largest_norm)
      return false;
    double negative = 0, positive = 0;
    for_each(
        row,
        [&](std::size_t k, const Vec<dim> &at, double w) {
          const Basis<dim> basis = w * quadratic_basis(at);
          for (int a = 0; a < dim; ++a)
            for (int c = 0; c < dim; ++c)
              row.block[k](a, c) = functional[a][c].dot(basis);
          const double trace = row.block[k].trace();
          (trace < 0 ? negative : positive) += std::abs(trace);
        },
        [](int, const Vec<dim> &, double) {});
    set_linear_gradient(row);
    return !has_wrong_signs(negative, positive);
  }

  /// Central forces: for a smooth solenoidal field and neighbours all round, the sum of
  /// 2d (d + 2) w (r r^T / r^2) (u_j - u_i) / sum w r^2 is the Laplacian. Source: P. Espanol,
  /// M. Revenga, Phys. Rev. E 67 (2003) 026705, Eq. 24, in this normalisation derived here.
  void pair_row(const Row &row) const {
    static const double moment =
        lattice_second_moment<dim>() * kernel_radius_ratio * kernel_radius_ratio;
    const double scale = 2 * dim * (dim + 2) / (moment * cloud_.spacing * cloud_.spacing);
    for_each(
        row,
        [&](std::size_t k, const Vec<dim> &q, double w) {
          const double q2 = q.squaredNorm();
          row.block[k] =
              q2 > 0 ? Mat<dim>(scale * w / q2 * outer(q, q)) : Mat<dim>(Mat<dim>::Zero());
        },
        [&](int m, const Vec<dim> &, double w) {
          (*row.wall)[m].block = scale * w / (dim + 2) * Mat<dim>::Identity();
        });
    set_linear_gradient(row);
  }

  void set_linear_gradient(const Row &row) const {
    LinearFit<dim> fit;
    const auto add = [&](std::size_t, const Vec<dim> &q, double w) { fit.add(q, w); };
    for_each(row, add, add);
    const Mat<dim> inverse = fit.limited_inverse() / cloud_.radius;
    for_each(
        row,
        [&](std::size_t k, const Vec<dim> &q, double w) { row.gradient[k] = w * (inverse * q); },
        [&](int m, const Vec<dim> &q, double w) { (*row.wall)[m].gradient = w * (inverse * q); });
  }

  const Points<dim> &points_;
  const Cloud<dim> &cloud_;
  const PressureProblem<dim> &pressure_;
  ViscousRows<dim> &rows_;
};

template <int dim, bool with_gradient>
void build_rows(const Points<dim> &points, const Cloud<dim> &cloud,
                const PressureProblem<dim> &pressure, ViscousRows<dim> &rows) {
  const StencilBuilder<dim, with_gradient> builder(points, cloud, pressure, rows);
  const auto counts = block_sums<4>(
      points.size(),
      [&](IndexRange range) {
        std::array<double, 4> count{};
        for (int i = range.begin; i < range.end; ++i)
          count[static_cast<std::size_t>(builder.build(i))] += 1;
        return count;
      },
      Work::heavy);
  rows.count = {static_cast<int>(counts[0]), static_cast<int>(counts[1]),
                static_cast<int>(counts[2]), static_cast<int>(counts[3])};
}

} // namespace

template <int dim>
void build_viscous_rows(const Points<dim> &points, const Cloud<dim> &cloud,
                        const Rheology &rheology, const PressureProblem<dim> &pressure,
                        ViscousRows<dim> &rows) {
  const int n = points.size();
  const bool newtonian = rheology.is_newtonian();
  rows.pressure_matrix = &pressure.matrix;
  rows.pressure_scale = -1 / (cloud.spacing * cloud.spacing);
  rows.start.resize(n + 1);
  rows.start[0] = 0;
  for (int i = 0; i < n; ++i)
    rows.start[i + 1] =
        rows.start[i] +
        (newtonian && is_like_pressures(i, cloud, pressure) ? 0 : cloud.neighbours.count[i]);
  rows.form.resize(n);
  const std::size_t entries = rows.start[n];
  if (rows.laplacian.size() < entries) { // some to spare, as surfaces grow
    rows.laplacian.resize(entries + entries / 4);
    rows.gradient.resize(entries + entries / 4);
    rows.block.resize(entries + entries / 4);
  }
  rows.wall_weights.assign(cloud.point_walls.size(), {});
  if (newtonian)
    build_rows<dim, false>(points, cloud, pressure, rows);
  else
    build_rows<dim, true>(points, cloud, pressure, rows);
}

template void build_viscous_rows(const Points<2> &, const Cloud<2> &, const Rheology &,
                                 const PressureProblem<2> &, ViscousRows<2> &);
template void build_viscous_rows(const Points<3> &, const Cloud<3> &, const Rheology &,
                                 const PressureProblem<3> &, ViscousRows<3> &);

} // namespace sluice::fluid
