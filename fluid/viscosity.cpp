// SPDX-License-Identifier: MIT
#include "fluid/viscosity.hpp"

#include "bridge/base/check.hpp"
#include "fluid/least_squares.hpp"
#include "fluid/parallel.hpp"
#include "fluid/weights.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

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
// dt nu / spacing^2 up to which one explicit pass stands for the implicit solve: the two differ by
// the square of it, and four times that is stable.
constexpr double explicit_limit = 0.02;
// dt nu / spacing^2 from which the solve is preconditioned by multigrid.
constexpr double multigrid_limit = 2;

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

template <int dim> Mat<dim> outer(const Vec<dim> &a, const Vec<dim> &b) {
  return a * b.transpose();
}

// Unit vectors along the surface with the normal n.
std::array<Vec<2>, 1> tangents_of(const Vec<2> &n) { return {rotated_left(n)}; }
std::array<Vec<3>, 2> tangents_of(const Vec<3> &n) {
  int least = 0; // the axis farthest from n
  n.cwiseAbs().minCoeff(&least);
  const Vec<3> t = cross(n, Vec<3>(Vec<3>::Unit(least))).normalized();
  return {t, cross(n, t)};
}

// --- stencils ---------------------------------------------------------------------------------

enum class Kind { quadratic, linear, surface, pairs };

/// Builds the rows of one point, with or without those of the gradient.
template <int dim, bool with_gradient> class StencilBuilder {
public:
  StencilBuilder(const Points<dim> &points, const Cloud<dim> &cloud,
                 const PressureProblem<dim> &pressure, ViscousProblem<dim> &problem)
      : points_(points), cloud_(cloud), pressure_(pressure), problem_(problem) {}

  Kind build(int i) const {
    const Row row = gather(i);
    if (cloud_.kind[i] == PointKind::surface && surface_row(row))
      return Kind::surface;
    if (cloud_.kind[i] != PointKind::interior) {
      pair_row(row);
      return Kind::pairs;
    }
    if (!row.walls && pressure_.row_kind[i] == RowKind::quadratic) {
      pressures_row(row);
      return Kind::quadratic;
    }
    if (slides(row) ? quadratic_row<WallRows::slip>(row) : quadratic_row<WallRows::none>(row))
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
    const int start = problem_.start[i];
    return {i,
            cloud_.neighbours.of(i),
            problem_.laplacian.data() + start,
            problem_.gradient.data() + start,
            problem_.block.data() + start,
            cloud_.walls_of(i),
            cloud_.walls_of(i) ? &problem_.wall_weights[cloud_.wall_slot[i]] : nullptr};
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

  enum class WallRows { none, slip };
  bool slides(const Row &row) const {
    return row.walls && std::any_of(row.walls->begin(), row.walls->end(),
                                    [](const Projection<dim> &p) { return p.slips; });
  }

  // A wall that slips holds no velocity; its row says that none changes across it.
  void add_slip_rows(const Row &row, QuadraticFit<dim> &fit) const {
    for (const Projection<dim> &p : *row.walls)
      if (const Vec<dim> q = scaled(row.i, p.point); p.slips && !p.at_edge)
        fit.add_row(normal_derivative(q, p.normal), weight_at(q));
  }

  void pressures_row(const Row &row) const {
    const double *weights = &pressure_.matrix.value[pressure_.matrix.row_start[row.i] + 1];
    const double scale = -1 / (cloud_.spacing * cloud_.spacing);
    for (std::size_t k = 0; k < row.neighbours.size(); ++k)
      row.laplacian[k] = scale * weights[k];
    if constexpr (with_gradient) {
      const auto &functional = pressure_.gradient[row.i];
      for (std::size_t k = 0; k < row.neighbours.size(); ++k) {
        const Vec<dim> q = scaled(row.i, points_.position[row.neighbours[k]]);
        row.gradient[k] = weight_at(q) * (functional.transpose() * quadratic_basis(q));
      }
    }
  }

  template <WallRows wall_rows> bool quadratic_row(const Row &row) const {
    QuadraticFit<dim> fit;
    const auto add = [&](std::size_t, const Vec<dim> &q, double w) { fit.add_neighbour(q, w); };
    for_each(row, add, add);
    if constexpr (wall_rows == WallRows::slip)
      add_slip_rows(row, fit);
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
          (*row.wall)[m].laplacian = scale * w / (dim + 2);
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
  ViscousProblem<dim> &problem_;
};

// --- viscosity ----------------------------------------------------------------------------------

/// What the rows of a step act on.
template <int dim> struct Flow {
  const Walls<dim> &walls;
  const Cloud<dim> &cloud;
  VecView<dim> velocity;
};

template <int dim, class Visit> void for_each_wall(int i, const Cloud<dim> &cloud, Visit &&visit) {
  if (const PointWalls<dim> *walls = cloud.walls_of(i))
    for (int m = 0; m < walls->count; ++m)
      visit(m, walls->projection[m]);
}

// At the free surface the conditions of no traction and no divergence hold for the gradient too:
// the strain rate is that along the surface, and against it along the normal; in the plane e (t t -
// n n).
Mat<2> without_traction(const Mat<2> &gradient, const Vec<2> &n) {
  const Vec<2> t = rotated_left(n);
  const double stretch = t.dot(gradient * t);
  const double spin = 0.5 * (gradient(1, 0) - gradient(0, 1));
  Mat<2> result = stretch * (outer(t, t) - outer(n, n));
  result(1, 0) += spin;
  result(0, 1) -= spin;
  return result;
}
Mat<3> without_traction(const Mat<3> &gradient, const Vec<3> &n) {
  const Mat<3> along = Mat<3>::Identity() - outer(n, n);
  const Mat<3> strain = 0.5 * along * (gradient + gradient.transpose()) * along;
  return strain - strain.trace() * outer(n, n) + 0.5 * (gradient - gradient.transpose());
}

template <int dim>
void update_velocity_gradient(const Flow<dim> &flow, ViscousProblem<dim> &problem) {
  const int n = static_cast<int>(flow.velocity.size());
  problem.velocity_gradient.resize(n);
  for_each_point(n, [&](int i) {
    const Vec<dim> u = flow.velocity[i];
    Mat<dim> gradient = Mat<dim>::Zero();
    const auto neighbours = flow.cloud.neighbours.of(i);
    for (std::size_t k = 0; k < neighbours.size(); ++k)
      gradient +=
          outer<dim>(flow.velocity[neighbours[k]] - u, problem.gradient[problem.start[i] + k]);
    for_each_wall(i, flow.cloud, [&](int m, const Projection<dim> &p) {
      gradient += outer<dim>(wall_velocity(flow.walls, p) - u,
                             problem.wall_weights[flow.cloud.wall_slot[i]][m].gradient);
    });
    problem.velocity_gradient[i] = flow.cloud.kind[i] == PointKind::surface
                                       ? without_traction(gradient, flow.cloud.surface_normal[i])
                                       : gradient;
  });
}

// Weight of the new viscosity, on a logarithmic scale, where passes do not settle by themselves: 1
// / n damps the overshoot of thickening fluids. Source: fixed point of mu(gamma(mu)) with d ln mu /
// d ln gamma = n - 1 at given stress, derived here.
double relaxation_of(const Rheology &rheology) { return std::min(1.0, 1 / rheology.exponent()); }

template <int dim>
void set_uniform_viscosity(const Rheology &rheology, int n, ViscousProblem<dim> &problem) {
  rheology.with_law([&](const auto &law) { problem.viscosity.assign(n, law(0)); });
  for (auto &walls : problem.wall_weights)
    for (ViscousWallWeight<dim> &wall : walls)
      wall.viscosity = problem.viscosity.front();
}

template <int dim>
void set_viscosity(const Rheology &rheology, double relaxation, ViscousProblem<dim> &problem) {
  const int n = static_cast<int>(problem.velocity_gradient.size());
  problem.viscosity.resize(n);
  rheology.with_law([&](const auto &law) {
    for_each_point(n, [&](int i) {
      const double now = law(shear_rate(problem.velocity_gradient[i]));
      double &mu = problem.viscosity[i];
      mu = relaxation == 1 || mu == now ? now : mu * std::pow(now / mu, relaxation);
    });
  });
}

// Viscosity half-way to the wall, by the fluid's own slope; never beyond a factor of two.
template <int dim>
void set_wall_viscosity(const Points<dim> &points, const Cloud<dim> &cloud,
                        ViscousProblem<dim> &problem) {
  for_each_index(static_cast<int>(cloud.wall_points.size()), [&](int slot) {
    const int i = cloud.wall_points[slot];
    const double mu = problem.viscosity[i];
    LinearFit<dim> fit;
    Vec<dim> slope = Vec<dim>::Zero();
    for (const int j : cloud.neighbours.of(i)) {
      const Vec<dim> q = (points.position[j] - points.position[i]) / cloud.radius;
      const double w = weight(std::min(q.norm(), 1.0));
      fit.add(q, w);
      slope += w * (problem.viscosity[j] - mu) * q;
    }
    slope = fit.inverse() * slope / cloud.radius;
    for_each_wall(i, cloud, [&](int m, const Projection<dim> &p) {
      const double at_wall =
          std::clamp(mu + slope.dot(p.point - points.position[i]), 0.5 * mu, 2 * mu);
      problem.wall_weights[slot][m].viscosity = 0.5 * (mu + at_wall);
    });
  });
}

// --- rows -----------------------------------------------------------------------------------

/// The force per volume on one point, as a sum of blocks times velocity differences.
template <int dim> class ViscousForce {
public:
  ViscousForce(const Walls<dim> &walls, const Cloud<dim> &cloud, const ViscousProblem<dim> &problem,
               bool is_uniform)
      : walls_(walls), cloud_(cloud), problem_(problem), is_uniform_(is_uniform) {}

  /// visit(j, block) for neighbours, wall_visit(velocity, block) for walls; blocks [Pa s / m^2].
  template <class Visit, class WallVisit>
  void for_each_block(int i, Visit &&visit, WallVisit &&wall_visit) const {
    const auto neighbours = cloud_.neighbours.of(i);
    const int start = problem_.start[i];
    const double mu = problem_.viscosity[i];
    const bool is_open = cloud_.kind[i] != PointKind::interior;
    const Vec<dim> slope = is_open || is_uniform_ ? Vec<dim>(Vec<dim>::Zero()) : viscosity_slope(i);
    for (std::size_t k = 0; k < neighbours.size(); ++k) {
      const int j = neighbours[k];
      const double mean = 0.5 * (mu + problem_.viscosity[j]);
      if (is_open)
        visit(j, Mat<dim>(mean * problem_.block[start + k]));
      else if (is_uniform_) // no gradients were made
        visit(j, Mat<dim>(mean * problem_.laplacian[start + k] * Mat<dim>::Identity()));
      else
        visit(j, Mat<dim>(mean * problem_.laplacian[start + k] * Mat<dim>::Identity() +
                          outer(problem_.gradient[start + k], slope)));
    }
    for_each_wall(i, cloud_, [&](int m, const Projection<dim> &p) {
      const ViscousWallWeight<dim> &w = problem_.wall_weights[cloud_.wall_slot[i]][m];
      wall_visit(
          wall_velocity(walls_, p),
          Mat<dim>(w.viscosity * w.laplacian * Mat<dim>::Identity() + outer(w.gradient, slope)));
    });
  }

private:
  Vec<dim> viscosity_slope(int i) const {
    const auto neighbours = cloud_.neighbours.of(i);
    const int start = problem_.start[i];
    Vec<dim> slope = Vec<dim>::Zero();
    for (std::size_t k = 0; k < neighbours.size(); ++k)
      slope += (problem_.viscosity[neighbours[k]] - problem_.viscosity[i]) *
               problem_.gradient[start + k];
    for_each_wall(i, cloud_, [&](int m, const Projection<dim> &) {
      const ViscousWallWeight<dim> &w = problem_.wall_weights[cloud_.wall_slot[i]][m];
      slope += 2 * (w.viscosity - problem_.viscosity[i]) * w.gradient;
    });
    return slope;
  }

  const Walls<dim> &walls_;
  const Cloud<dim> &cloud_;
  const ViscousProblem<dim> &problem_;
  bool is_uniform_;
};

template <int dim>
void apply_explicitly(const ViscousForce<dim> &force, double factor, VecSpan<dim> velocity,
                      std::vector<double> &change) {
  const int n = static_cast<int>(velocity.size());
  change.resize(dim * n);
  for_each_point(n, [&](int i) {
    Vec<dim> total = Vec<dim>::Zero();
    force.for_each_block(
        i, [&](int j, const Mat<dim> &block) { total += block * (velocity[j] - velocity[i]); },
        [&](const Vec<dim> &u, const Mat<dim> &block) { total += block * (u - velocity[i]); });
    for (int a = 0; a < dim; ++a)
      change[dim * i + a] = factor * total[a];
  });
  for_each_point(n, [&](int i) { velocity[i] += Vec<dim>(&change[dim * i]); });
}

template <int dim> void lay_out(const Cloud<dim> &cloud, ViscousProblem<dim> &problem) {
  const int n = static_cast<int>(cloud.kind.size());
  SparseMatrix &matrix = problem.matrix;
  matrix.row_start.resize(dim * n + 1);
  matrix.row_start[0] = 0;
  for (int i = 0; i < n; ++i)
    for (int a = 0; a < dim; ++a)
      matrix.row_start[dim * i + a + 1] =
          matrix.row_start[dim * i + a] + dim * (1 + cloud.neighbours.count[i]);
  matrix.column.resize(matrix.row_start.back());
  matrix.value.resize(matrix.row_start.back());
  for_each_point(n, [&](int i) {
    for (int a = 0; a < dim; ++a) {
      int *column = &matrix.column[matrix.row_start[dim * i + a]];
      const auto add = [&](int j) { // the component itself first
        for (int b = 0; b < dim; ++b)
          *column++ = dim * j + (a + b) % dim;
      };
      add(i);
      for (const int j : cloud.neighbours.of(i))
        add(j);
    }
  });
}

template <int dim>
void fill(const ViscousForce<dim> &force, const Cloud<dim> &cloud, double factor,
          VecView<dim> velocity, ViscousProblem<dim> &problem) {
  const int n = static_cast<int>(cloud.kind.size());
  SparseMatrix &matrix = problem.matrix;
  for_each_point(n, [&](int i) {
    Mat<dim> diagonal = Mat<dim>::Identity();
    Vec<dim> source = velocity[i];
    std::array<double *, dim> row;
    for (int a = 0; a < dim; ++a)
      row[a] = &matrix.value[matrix.row_start[dim * i + a]];
    int k = 1;
    force.for_each_block(
        i,
        [&](int, const Mat<dim> &block) {
          for (int a = 0; a < dim; ++a)
            for (int b = 0; b < dim; ++b)
              row[a][dim * k + b] = -factor * block(a, (a + b) % dim);
          diagonal += factor * block;
          ++k;
        },
        [&](const Vec<dim> &u, const Mat<dim> &block) {
          source += factor * (block * u);
          diagonal += factor * block;
        });
    for (int a = 0; a < dim; ++a) {
      for (int b = 0; b < dim; ++b)
        row[a][b] = diagonal(a, (a + b) % dim);
      problem.source[dim * i + a] = source[a];
    }
  });
}

// --- solve ----------------------------------------------------------------------------------

/// The scaled matrix has a unit diagonal already and is diagonally dominant: nothing to do.
class NoPreconditioner : public Preconditioner {
public:
  void apply(std::span<const double> r, std::span<float> z) override {
    for_each_index(static_cast<int>(r.size()), [&](int i) { z[i] = static_cast<float>(r[i]); });
  }
};

/// Multigrid for each component by itself: what couples them is small or rare.
template <int dim> class ComponentMultigrid : public Preconditioner {
public:
  explicit ComponentMultigrid(Multigrid &multigrid) : multigrid_(multigrid) {}
  void apply(std::span<const double> r, std::span<float> z) override {
    const int n = static_cast<int>(r.size()) / dim;
    r_.resize(n);
    z_.resize(n);
    for (int a = 0; a < dim; ++a) {
      for_each_index(n, [&](int i) { r_[i] = r[dim * i + a]; });
      multigrid_.apply(r_, z_);
      for_each_index(n, [&](int i) { z[dim * i + a] = z_[i]; });
    }
  }

private:
  Multigrid &multigrid_;
  std::vector<double> r_;
  std::vector<float> z_;
};

// The mean of the components' diagonal blocks.
template <int dim>
void build_multigrid(const Points<dim> &points, const Cloud<dim> &cloud,
                     ViscousProblem<dim> &problem) {
  lay_out_rows(cloud.neighbours, problem.scalar_matrix);
  const SparseMatrix &all = problem.matrix;
  SparseMatrix &one = problem.scalar_matrix;
  std::vector<Cell> cells(points.size());
  for_each_point(points.size(), [&](int i) {
    for (int k = 0; k < one.row_start[i + 1] - one.row_start[i]; ++k) {
      double total = 0;
      for (int a = 0; a < dim; ++a)
        total += all.value[all.row_start[dim * i + a] + dim * k];
      one.value[one.row_start[i] + k] = total / dim;
    }
    const Vec<dim> c = (points.position[i] - cloud.grid.origin) / (2 * cloud.spacing);
    cells[i] = {};
    for (int d = 0; d < dim; ++d)
      cells[i][d] = static_cast<int>(c[d]);
  });
  problem.scalar_scaled.build(one);
  problem.multigrid.build(problem.scalar_scaled, cells);
}

double root_mean_square(const std::vector<double> &values) {
  const int n = static_cast<int>(values.size());
  return std::sqrt(sum(n, [&](int i) { return values[i] * values[i]; }) / std::max(n, 1));
}

template <int dim>
int solve(const Points<dim> &points, const Cloud<dim> &cloud, double stiffness,
          ViscousProblem<dim> &problem) {
  problem.scaled.build(problem.matrix);
  SolveOptions options;
  options.max_iterations = 500;
  options.relative_tolerance = problem.relative_tolerance;
  // Differences of velocities are not known better than to round-off.
  options.absolute_tolerance = 2e-15 * root_mean_square(problem.solution);
  const auto run = [&](Preconditioner &preconditioner) {
    const SolveResult result = bicgstab(problem.scaled, problem.source, problem.solution,
                                        preconditioner, options, problem.memory);
    check(result.converged,
          "the viscous solve did not converge in {} iterations (residual {:.2e} m/s); "
          "reduce the time step",
          result.iterations, result.residual);
    return result.iterations;
  };
  if (stiffness < multigrid_limit) {
    NoPreconditioner none;
    return run(none);
  }
  build_multigrid(points, cloud, problem);
  ComponentMultigrid<dim> multigrid(problem.multigrid);
  return run(multigrid);
}

double largest(const std::vector<double> &values) {
  return values.empty() ? 0.0 : *std::max_element(values.begin(), values.end());
}

double relative_change(const std::vector<double> &now, const std::vector<double> &before) {
  const auto sums = block_sums<2>(static_cast<int>(now.size()), [&](IndexRange range) {
    std::array<double, 2> part{};
    for (int i = range.begin; i < range.end; ++i) {
      part[0] += (now[i] - before[i]) * (now[i] - before[i]);
      part[1] += now[i] * now[i];
    }
    return part;
  });
  return sums[1] > 0 ? std::sqrt(sums[0] / sums[1]) : 0.0;
}

} // namespace

template <int dim> double shear_rate(const Mat<dim> &gradient) {
  return (gradient + gradient.transpose()).norm() / std::sqrt(2.0);
}

namespace {

template <int dim, bool with_gradient>
void build_rows(const Points<dim> &points, const Cloud<dim> &cloud,
                const PressureProblem<dim> &pressure, ViscousProblem<dim> &problem) {
  const StencilBuilder<dim, with_gradient> builder(points, cloud, pressure, problem);
  const auto counts = block_sums<4>(
      points.size(),
      [&](IndexRange range) {
        std::array<double, 4> count{};
        for (int i = range.begin; i < range.end; ++i)
          count[static_cast<std::size_t>(builder.build(i))] += 1;
        return count;
      },
      Work::heavy);
  problem.rows = {static_cast<int>(counts[0]), static_cast<int>(counts[1]),
                  static_cast<int>(counts[2]), static_cast<int>(counts[3])};
}

} // namespace

template <int dim>
void build_viscous_rows(const Points<dim> &points, const Cloud<dim> &cloud,
                        const Rheology &rheology, const PressureProblem<dim> &pressure,
                        ViscousProblem<dim> &problem) {
  const int n = points.size();
  problem.start.resize(n + 1);
  problem.start[0] = 0;
  for (int i = 0; i < n; ++i)
    problem.start[i + 1] = problem.start[i] + cloud.neighbours.count[i];
  problem.laplacian.resize(problem.start[n]);
  problem.gradient.resize(problem.start[n]);
  problem.block.resize(problem.start[n]);
  problem.wall_weights.assign(cloud.point_walls.size(), {});
  if (rheology.is_newtonian())
    build_rows<dim, false>(points, cloud, pressure, problem);
  else
    build_rows<dim, true>(points, cloud, pressure, problem);
}

template <int dim>
ViscousResult diffuse_velocity(const Points<dim> &points, const Walls<dim> &walls,
                               const Cloud<dim> &cloud, const Rheology &rheology, double density,
                               double dt, VecSpan<dim> velocity, ViscousProblem<dim> &problem) {
  const int n = points.size();
  const double factor = dt / density, spacing2 = cloud.spacing * cloud.spacing;
  const ViscousForce<dim> force(walls, cloud, problem, rheology.is_newtonian());
  const auto update_viscosity = [&](VecView<dim> u, double relaxation) {
    if (rheology.is_newtonian()) {
      set_uniform_viscosity(rheology, n, problem);
    } else {
      update_velocity_gradient(Flow<dim>{walls, cloud, u}, problem);
      set_viscosity(rheology, relaxation, problem);
      set_wall_viscosity(points, cloud, problem);
    }
    return factor * largest(problem.viscosity) / spacing2;
  };
  double stiffness = update_viscosity(velocity, 1);
  ViscousResult result;
  if (stiffness < explicit_limit) {
    apply_explicitly(force, factor, velocity, problem.source);
    return result;
  }
  lay_out(cloud, problem);
  problem.source.resize(dim * n);
  problem.solution.resize(dim * n);
  for (int i = 0; i < n; ++i)
    for (int a = 0; a < dim; ++a)
      problem.solution[dim * i + a] = velocity[i][a];
  std::vector<Vec<dim>> latest(velocity.begin(), velocity.end());
  const RheologyParams &law = rheology.params();
  double relaxation = 1, last_change = std::numeric_limits<double>::infinity();
  for (;;) {
    problem.previous = problem.solution;
    fill(force, cloud, factor, velocity, problem);
    result.iterations += solve(points, cloud, stiffness, problem);
    ++result.passes;
    for_each_point(n, [&](int i) { latest[i] = Vec<dim>(&problem.solution[dim * i]); });
    if (rheology.is_newtonian() || result.passes == law.picard_passes)
      break;
    const double change = relative_change(problem.solution, problem.previous);
    if (result.passes > 1) {
      if (change < law.picard_tolerance)
        break;
      if (change > 0.5 * last_change)
        relaxation = relaxation_of(rheology);
      last_change = change;
    }
    stiffness = update_viscosity(latest, relaxation);
  }
  std::copy(latest.begin(), latest.end(), velocity.begin());
  return result;
}

template double shear_rate(const Mat<2> &);
template void build_viscous_rows(const Points<2> &, const Cloud<2> &, const Rheology &,
                                 const PressureProblem<2> &, ViscousProblem<2> &);
template ViscousResult diffuse_velocity(const Points<2> &, const Walls<2> &, const Cloud<2> &,
                                        const Rheology &, double, double, VecSpan<2>,
                                        ViscousProblem<2> &);
template double shear_rate(const Mat<3> &);
template void build_viscous_rows(const Points<3> &, const Cloud<3> &, const Rheology &,
                                 const PressureProblem<3> &, ViscousProblem<3> &);
template ViscousResult diffuse_velocity(const Points<3> &, const Walls<3> &, const Cloud<3> &,
                                        const Rheology &, double, double, VecSpan<3>,
                                        ViscousProblem<3> &);

} // namespace sluice::fluid
