// SPDX-License-Identifier: MIT
#include "fluid/viscosity.hpp"

#include "bridge/base/check.hpp"
#include "fluid/least_squares.hpp"
#include "fluid/parallel.hpp"
#include "fluid/weights.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace sluice::fluid {

namespace {

// Largest share of negative weights in a row; as in the pressure's rows.
constexpr double row_guard = 0.1;
// Weight of a wall's velocity in the fits, in that of a neighbour at its place: it stands for all the
// fluid beyond. With 1 rows half a spacing from the wall have 7 % of negative weights, a quarter of a
// spacing from it 31 %; from 10 on none.
constexpr double wall_weight = 20;
// Norm of the gradient's functional, times the kernel radius, beyond which it amplifies the noise of
// single points. On a lattice it is 14 next to a wall and 24 to 40 at the surface, where the cloud is
// one-sided.
constexpr double largest_norm = 45;
// dt nu / spacing^2 up to which one explicit pass stands for the implicit solve: the two differ by
// the square of it, and four times that is stable.
constexpr double explicit_limit = 0.02;
// dt nu / spacing^2 from which the solve is preconditioned by multigrid.
constexpr double multigrid_limit = 2;

// Sum of w r^2 / radius^2 over the neighbours on a square lattice: what a pair's weight is measured
// against.
double lattice_second_moment() {
  double sum = 0;
  const int reach = static_cast<int>(std::ceil(kernel_radius_ratio));
  for (int j = -reach; j <= reach; ++j)
    for (int i = -reach; i <= reach; ++i) {
      const double q = std::hypot(i, j) / kernel_radius_ratio;
      if (q > 0 && q < 1)
        sum += weight(q) * q * q;
    }
  return sum;
}

bool has_wrong_signs(double negative, double positive) {
  return negative > row_guard * positive || !(positive > 0);
}

Mat<2> outer(const Vec<2> &a, const Vec<2> &b) { return a * b.transpose(); }

// --- stencils ---------------------------------------------------------------------------------

enum class Kind { quadratic, linear, surface, pairs };

/// Builds the rows of one point, with or without those of the gradient.
template <bool with_gradient> class StencilBuilder {
public:
  StencilBuilder(const Points &points, const Cloud &cloud, const PressureProblem &pressure,
                 ViscousProblem &problem)
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
    if (quadratic_row(row))
      return Kind::quadratic;
    linear_row(row);
    return Kind::linear;
  }

private:
  struct Row {
    int i;
    std::span<const int> neighbours;
    double *laplacian;
    Vec<2> *gradient;
    Mat<2> *block;
    const PointWalls *walls;                 // or nullptr
    std::array<ViscousWallWeight, 3> *wall;  // with them
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
  Vec<2> scaled(int i, const Vec<2> &x) const { return (x - points_.position[i]) / cloud_.radius; }
  static double weight_at(const Vec<2> &q) { return weight(std::min(q.norm(), 1.0)); }

  /// visit(k, q, w) for neighbours, wall_visit(m, q, w) for walls.
  template <class Visit, class WallVisit>
  void for_each(const Row &row, Visit &&visit, WallVisit &&wall_visit) const {
    for (std::size_t k = 0; k < row.neighbours.size(); ++k) {
      const Vec<2> q = scaled(row.i, points_.position[row.neighbours[k]]);
      visit(k, q, weight_at(q));
    }
    if (row.walls)
      for (int m = 0; m < row.walls->count; ++m) {
        const Vec<2> q = scaled(row.i, row.walls->projection[m].point);
        wall_visit(m, q, wall_weight * weight_at(q));
      }
  }

  void pressures_row(const Row &row) const {
    const double *weights = &pressure_.matrix.value[pressure_.matrix.row_start[row.i] + 1];
    const double scale = -1 / (cloud_.spacing * cloud_.spacing);
    for (std::size_t k = 0; k < row.neighbours.size(); ++k)
      row.laplacian[k] = scale * weights[k];
    if constexpr (with_gradient) {
      const auto &functional = pressure_.gradient[row.i];
      for (std::size_t k = 0; k < row.neighbours.size(); ++k) {
        const Vec<2> q = scaled(row.i, points_.position[row.neighbours[k]]);
        row.gradient[k] = weight_at(q) * (functional.transpose() * quadratic_basis(q));
      }
    }
  }

  bool quadratic_row(const Row &row) const {
    QuadraticFit fit;
    const auto add = [&](std::size_t, const Vec<2> &q, double w) { fit.add_neighbour(q, w); };
    for_each(row, add, add);
    if (!fit.factorise())
      return false;
    const double h = cloud_.radius;
    const Basis lap = fit.solve({0, 0, 2 / (h * h), 0, 2 / (h * h)});
    const Basis dx = fit.solve({1 / h, 0, 0, 0, 0}), dy = fit.solve({0, 1 / h, 0, 0, 0});
    if (std::hypot(dx.norm(), dy.norm()) * h > largest_norm)
      return false;
    double negative = 0, positive = 0;
    const auto set = [&](double &laplacian, Vec<2> &gradient, const Vec<2> &q, double w) {
      const Basis basis = w * quadratic_basis(q);
      laplacian = lap.dot(basis);
      gradient = {dx.dot(basis), dy.dot(basis)};
      (laplacian < 0 ? negative : positive) += std::abs(laplacian);
    };
    for_each(
        row,
        [&](std::size_t k, const Vec<2> &q, double w) {
          set(row.laplacian[k], row.gradient[k], q, w);
        },
        [&](int m, const Vec<2> &q, double w) {
          set((*row.wall)[m].laplacian, (*row.wall)[m].gradient, q, w);
        });
    return !has_wrong_signs(negative, positive);
  }

  /// Renormalised Laplacian (see pressure.cpp) with the skewness limited so that no weight is
  /// negative, and the linear gradient.
  void linear_row(const Row &row) const {
    LinearFit fit;
    Vec<2> offset = Vec<2>::Zero();
    const auto add = [&](std::size_t, const Vec<2> &q, double w) {
      fit.add(q, w);
      offset += w * q;
    };
    for_each(row, add, add);
    const Mat<2> inverse = fit.inverse();
    const Vec<2> skew = inverse * offset;
    double denominator = 0;
    const auto set = [&](double &laplacian, Vec<2> &gradient, const Vec<2> &q, double w) {
      laplacian = w * std::max(1 - q.dot(skew), 0.0);
      denominator += laplacian * q.squaredNorm();
      gradient = w / cloud_.radius * (inverse * q);
    };
    for_each(
        row,
        [&](std::size_t k, const Vec<2> &q, double w) {
          set(row.laplacian[k], row.gradient[k], q, w);
        },
        [&](int m, const Vec<2> &q, double w) {
          set((*row.wall)[m].laplacian, (*row.wall)[m].gradient, q, w);
        });
    const double scale =
        denominator > 0 ? 4 / (denominator * cloud_.radius * cloud_.radius) : 0.0;
    for (std::size_t k = 0; k < row.neighbours.size(); ++k)
      row.laplacian[k] *= scale;
    if (row.walls)
      for (int m = 0; m < row.walls->count; ++m)
        (*row.wall)[m].laplacian *= scale;
  }

  // Scaled derivative d/dx_b of the quadratic at q, as a functional of its coefficients.
  static Basis derivative(int b, const Vec<2> &q) {
    return b == 0 ? Basis{1, 0, 2 * q.x(), q.y(), 0} : Basis{0, 1, 0, q.x(), 2 * q.y()};
  }

  /// Both components together: the moment matrix is that of one component, twice, plus the rows of
  /// the two conditions. These enter through the formula of Sherman, Morrison and Woodbury.
  bool surface_row(const Row &row) const {
    if (row.walls && row.walls->count > 0)
      return false;
    QuadraticFit fit;
    const auto add = [&](std::size_t, const Vec<2> &q, double w) { fit.add_neighbour(q, w); };
    for_each(row, add, add);
    if (!fit.factorise())
      return false;
    const Vec<2> n = cloud_.surface_normal[row.i], t = rotated_left(n);
    const Vec<2> q = 0.5 * cloud_.spacing / cloud_.radius * n;
    const Basis d[2] = {derivative(0, q), derivative(1, q)};
    // condition[r][a]: functional on the coefficients of component a
    Basis condition[2][2], inverse[2][2];
    for (int a = 0; a < 2; ++a) {
      condition[0][a] = Basis::Zero();
      for (int b = 0; b < 2; ++b)
        condition[0][a] += (t[a] * n[b] + t[b] * n[a]) * d[b];
      condition[1][a] = d[a];
      for (int r = 0; r < 2; ++r)
        inverse[r][a] = fit.solve(condition[r][a]);
    }
    Mat<2> capacitance = Mat<2>::Identity();
    for (int r = 0; r < 2; ++r)
      for (int s = 0; s < 2; ++s)
        for (int a = 0; a < 2; ++a)
          capacitance(r, s) += condition[r][a].dot(inverse[s][a]);
    const Mat<2> solve = capacitance.inverse();
    // The functional of `wanted` of component a on the data of component c.
    const auto constrained = [&](const Basis &wanted, int a, int c) -> Basis {
      const Vec<2> answer =
          solve * Vec<2>(condition[0][a].dot(wanted), condition[1][a].dot(wanted));
      const Basis change = -answer[0] * inverse[0][c] - answer[1] * inverse[1][c];
      return a == c ? Basis(wanted + change) : change;
    };
    const double h2 = cloud_.radius * cloud_.radius;
    const Basis laplacian = fit.solve({0, 0, 2 / h2, 0, 2 / h2});
    const Basis slope[2] = {fit.solve({1, 0, 0, 0, 0}), fit.solve({0, 1, 0, 0, 0})};
    double norm2 = 0;
    Basis functional[2][2];
    for (int a = 0; a < 2; ++a)
      for (int c = 0; c < 2; ++c) {
        functional[a][c] = constrained(laplacian, a, c);
        for (const Basis &derivative : slope)
          norm2 += constrained(derivative, a, c).squaredNorm();
      }
    if (0.5 * norm2 > largest_norm * largest_norm)
      return false;
    double negative = 0, positive = 0;
    for_each(
        row,
        [&](std::size_t k, const Vec<2> &at, double w) {
          const Basis basis = w * quadratic_basis(at);
          for (int a = 0; a < 2; ++a)
            for (int c = 0; c < 2; ++c)
              row.block[k](a, c) = functional[a][c].dot(basis);
          const double trace = row.block[k].trace();
          (trace < 0 ? negative : positive) += std::abs(trace);
        },
        [](int, const Vec<2> &, double) {});
    set_linear_gradient(row);
    return !has_wrong_signs(negative, positive);
  }

  /// Central forces: for a smooth solenoidal field and neighbours all round, the sum of
  /// 2d (d + 2) w (r r^T / r^2) (u_j - u_i) / sum w r^2 is the Laplacian. Source: P. Espanol,
  /// M. Revenga, Phys. Rev. E 67 (2003) 026705, Eq. 24, in this normalisation derived here.
  void pair_row(const Row &row) const {
    static const double moment = lattice_second_moment() * kernel_radius_ratio *
                                 kernel_radius_ratio;
    const double scale = 16 / (moment * cloud_.spacing * cloud_.spacing);
    for_each(
        row,
        [&](std::size_t k, const Vec<2> &q, double w) {
          const double q2 = q.squaredNorm();
          row.block[k] = q2 > 0 ? Mat<2>(scale * w / q2 * outer(q, q)) : Mat<2>(Mat<2>::Zero());
        },
        [&](int m, const Vec<2> &, double w) { (*row.wall)[m].laplacian = 0.25 * scale * w; });
    set_linear_gradient(row);
  }

  void set_linear_gradient(const Row &row) const {
    LinearFit fit;
    const auto add = [&](std::size_t, const Vec<2> &q, double w) { fit.add(q, w); };
    for_each(row, add, add);
    const Mat<2> inverse = fit.limited_inverse() / cloud_.radius;
    for_each(
        row,
        [&](std::size_t k, const Vec<2> &q, double w) { row.gradient[k] = w * (inverse * q); },
        [&](int m, const Vec<2> &q, double w) {
          (*row.wall)[m].gradient = w * (inverse * q);
        });
  }

  const Points &points_;
  const Cloud &cloud_;
  const PressureProblem &pressure_;
  ViscousProblem &problem_;
};

// --- viscosity ----------------------------------------------------------------------------------

/// What the rows of a step act on.
struct Flow {
  const Walls &walls;
  const Cloud &cloud;
  std::span<const Vec<2>> velocity;
};

template <class Visit> void for_each_wall(int i, const Cloud &cloud, Visit &&visit) {
  if (const PointWalls *walls = cloud.walls_of(i))
    for (int m = 0; m < walls->count; ++m)
      visit(m, walls->projection[m]);
}

// At the free surface the conditions of no traction and no divergence hold for the gradient too:
// E = e (t t - n n).
Mat<2> without_traction(const Mat<2> &gradient, const Vec<2> &n) {
  const Vec<2> t = rotated_left(n);
  const double stretch = t.dot(gradient * t);
  const double spin = 0.5 * (gradient(1, 0) - gradient(0, 1));
  Mat<2> result = stretch * (outer(t, t) - outer(n, n));
  result(1, 0) += spin;
  result(0, 1) -= spin;
  return result;
}

void update_velocity_gradient(const Flow &flow, ViscousProblem &problem) {
  const int n = static_cast<int>(flow.velocity.size());
  problem.velocity_gradient.resize(n);
  for_each_point(n, [&](int i) {
    const Vec<2> u = flow.velocity[i];
    Mat<2> gradient = Mat<2>::Zero();
    const auto neighbours = flow.cloud.neighbours.of(i);
    for (std::size_t k = 0; k < neighbours.size(); ++k)
      gradient += outer(flow.velocity[neighbours[k]] - u, problem.gradient[problem.start[i] + k]);
    for_each_wall(i, flow.cloud, [&](int m, const Projection &p) {
      gradient += outer(wall_velocity(flow.walls, p) - u,
                        problem.wall_weights[flow.cloud.wall_slot[i]][m].gradient);
    });
    problem.velocity_gradient[i] = flow.cloud.kind[i] == PointKind::surface
                                       ? without_traction(gradient, flow.cloud.surface_normal[i])
                                       : gradient;
  });
}

// Weight of the new viscosity, on a logarithmic scale, where passes do not settle by themselves: 1 / n
// damps the overshoot of thickening fluids. Source: fixed point of mu(gamma(mu)) with
// d ln mu / d ln gamma = n - 1 at given stress, derived here.
double relaxation_of(const Rheology &rheology) { return std::min(1.0, 1 / rheology.exponent()); }

void set_uniform_viscosity(const Rheology &rheology, int n, ViscousProblem &problem) {
  rheology.with_law([&](const auto &law) { problem.viscosity.assign(n, law(0)); });
  for (auto &walls : problem.wall_weights)
    for (ViscousWallWeight &wall : walls)
      wall.viscosity = problem.viscosity.front();
}

void set_viscosity(const Rheology &rheology, double relaxation, ViscousProblem &problem) {
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
void set_wall_viscosity(const Points &points, const Cloud &cloud, ViscousProblem &problem) {
  for_each_index(static_cast<int>(cloud.wall_points.size()), [&](int slot) {
    const int i = cloud.wall_points[slot];
    const double mu = problem.viscosity[i];
    LinearFit fit;
    Vec<2> slope = Vec<2>::Zero();
    for (const int j : cloud.neighbours.of(i)) {
      const Vec<2> q = (points.position[j] - points.position[i]) / cloud.radius;
      const double w = weight(std::min(q.norm(), 1.0));
      fit.add(q, w);
      slope += w * (problem.viscosity[j] - mu) * q;
    }
    slope = fit.inverse() * slope / cloud.radius;
    for_each_wall(i, cloud, [&](int m, const Projection &p) {
      const double at_wall =
          std::clamp(mu + slope.dot(p.point - points.position[i]), 0.5 * mu, 2 * mu);
      problem.wall_weights[slot][m].viscosity = 0.5 * (mu + at_wall);
    });
  });
}

// --- rows -----------------------------------------------------------------------------------

/// The force per volume on one point, as a sum of blocks times velocity differences.
class ViscousForce {
public:
  ViscousForce(const Walls &walls, const Cloud &cloud, const ViscousProblem &problem,
               bool is_uniform)
      : walls_(walls), cloud_(cloud), problem_(problem), is_uniform_(is_uniform) {}

  /// visit(j, block) for neighbours, wall_visit(velocity, block) for walls; blocks [Pa s / m^2].
  template <class Visit, class WallVisit>
  void for_each_block(int i, Visit &&visit, WallVisit &&wall_visit) const {
    const auto neighbours = cloud_.neighbours.of(i);
    const int start = problem_.start[i];
    const double mu = problem_.viscosity[i];
    const bool is_open = cloud_.kind[i] != PointKind::interior;
    const Vec<2> slope = is_open || is_uniform_ ? Vec<2>(0, 0) : viscosity_slope(i);
    for (std::size_t k = 0; k < neighbours.size(); ++k) {
      const int j = neighbours[k];
      const double mean = 0.5 * (mu + problem_.viscosity[j]);
      if (is_open)
        visit(j, Mat<2>(mean * problem_.block[start + k]));
      else if (is_uniform_) // no gradients were made
        visit(j, Mat<2>(mean * problem_.laplacian[start + k] * Mat<2>::Identity()));
      else
        visit(j, Mat<2>(mean * problem_.laplacian[start + k] * Mat<2>::Identity() +
                        outer(problem_.gradient[start + k], slope)));
    }
    for_each_wall(i, cloud_, [&](int m, const Projection &p) {
      const ViscousWallWeight &w = problem_.wall_weights[cloud_.wall_slot[i]][m];
      wall_visit(wall_velocity(walls_, p),
                 Mat<2>(w.viscosity * w.laplacian * Mat<2>::Identity() +
                        outer(w.gradient, slope)));
    });
  }

private:
  Vec<2> viscosity_slope(int i) const {
    const auto neighbours = cloud_.neighbours.of(i);
    const int start = problem_.start[i];
    Vec<2> slope = Vec<2>::Zero();
    for (std::size_t k = 0; k < neighbours.size(); ++k)
      slope += (problem_.viscosity[neighbours[k]] - problem_.viscosity[i]) *
               problem_.gradient[start + k];
    for_each_wall(i, cloud_, [&](int m, const Projection &) {
      const ViscousWallWeight &w = problem_.wall_weights[cloud_.wall_slot[i]][m];
      slope += 2 * (w.viscosity - problem_.viscosity[i]) * w.gradient;
    });
    return slope;
  }

  const Walls &walls_;
  const Cloud &cloud_;
  const ViscousProblem &problem_;
  bool is_uniform_;
};

void apply_explicitly(const ViscousForce &force, double factor, std::span<Vec<2>> velocity,
                      std::vector<double> &change) {
  const int n = static_cast<int>(velocity.size());
  change.resize(2 * n);
  for_each_point(n, [&](int i) {
    Vec<2> total = Vec<2>::Zero();
    force.for_each_block(
        i, [&](int j, const Mat<2> &block) { total += block * (velocity[j] - velocity[i]); },
        [&](const Vec<2> &u, const Mat<2> &block) { total += block * (u - velocity[i]); });
    change[2 * i] = factor * total.x();
    change[2 * i + 1] = factor * total.y();
  });
  for_each_point(n, [&](int i) { velocity[i] += Vec<2>(change[2 * i], change[2 * i + 1]); });
}

void lay_out(const Cloud &cloud, ViscousProblem &problem) {
  const int n = static_cast<int>(cloud.kind.size());
  SparseMatrix &matrix = problem.matrix;
  matrix.row_start.resize(2 * n + 1);
  matrix.row_start[0] = 0;
  for (int i = 0; i < n; ++i)
    for (int a = 0; a < 2; ++a)
      matrix.row_start[2 * i + a + 1] =
          matrix.row_start[2 * i + a] + 2 * (1 + cloud.neighbours.count[i]);
  matrix.column.resize(matrix.row_start.back());
  matrix.value.resize(matrix.row_start.back());
  for_each_point(n, [&](int i) {
    for (int a = 0; a < 2; ++a) {
      int *column = &matrix.column[matrix.row_start[2 * i + a]];
      const auto add = [&](int j) {
        *column++ = 2 * j + a;
        *column++ = 2 * j + 1 - a;
      };
      add(i);
      for (const int j : cloud.neighbours.of(i))
        add(j);
    }
  });
}

void fill(const ViscousForce &force, const Cloud &cloud, double factor,
          std::span<const Vec<2>> velocity, ViscousProblem &problem) {
  const int n = static_cast<int>(cloud.kind.size());
  SparseMatrix &matrix = problem.matrix;
  for_each_point(n, [&](int i) {
    Mat<2> diagonal = Mat<2>::Identity();
    Vec<2> source = velocity[i];
    double *row[2] = {&matrix.value[matrix.row_start[2 * i]],
                      &matrix.value[matrix.row_start[2 * i + 1]]};
    int k = 1;
    force.for_each_block(
        i,
        [&](int, const Mat<2> &block) {
          for (int a = 0; a < 2; ++a) {
            row[a][2 * k] = -factor * block(a, a);
            row[a][2 * k + 1] = -factor * block(a, 1 - a);
          }
          diagonal += factor * block;
          ++k;
        },
        [&](const Vec<2> &u, const Mat<2> &block) {
          source += factor * (block * u);
          diagonal += factor * block;
        });
    for (int a = 0; a < 2; ++a) {
      row[a][0] = diagonal(a, a);
      row[a][1] = diagonal(a, 1 - a);
      problem.source[2 * i + a] = source[a];
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
class ComponentMultigrid : public Preconditioner {
public:
  explicit ComponentMultigrid(Multigrid &multigrid) : multigrid_(multigrid) {}
  void apply(std::span<const double> r, std::span<float> z) override {
    const int n = static_cast<int>(r.size()) / 2;
    r_.resize(n);
    z_.resize(n);
    for (int a = 0; a < 2; ++a) {
      for_each_index(n, [&](int i) { r_[i] = r[2 * i + a]; });
      multigrid_.apply(r_, z_);
      for_each_index(n, [&](int i) { z[2 * i + a] = z_[i]; });
    }
  }

private:
  Multigrid &multigrid_;
  std::vector<double> r_;
  std::vector<float> z_;
};

// The mean of both components' diagonal blocks.
void build_multigrid(const Points &points, const Cloud &cloud, ViscousProblem &problem) {
  lay_out_rows(cloud.neighbours, problem.scalar_matrix);
  const SparseMatrix &both = problem.matrix;
  SparseMatrix &one = problem.scalar_matrix;
  std::vector<Cell> cells(points.size());
  for_each_point(points.size(), [&](int i) {
    const int x = both.row_start[2 * i], y = both.row_start[2 * i + 1];
    for (int k = 0; k < one.row_start[i + 1] - one.row_start[i]; ++k)
      one.value[one.row_start[i] + k] = 0.5 * (both.value[x + 2 * k] + both.value[y + 2 * k]);
    const Vec<2> c = (points.position[i] - cloud.grid.origin) / (2 * cloud.spacing);
    cells[i] = {static_cast<int>(c.x()), static_cast<int>(c.y())};
  });
  problem.scalar_scaled.build(one);
  problem.multigrid.build(problem.scalar_scaled, cells);
}

double root_mean_square(const std::vector<double> &values) {
  const int n = static_cast<int>(values.size());
  return std::sqrt(sum(n, [&](int i) { return values[i] * values[i]; }) / std::max(n, 1));
}

int solve(const Points &points, const Cloud &cloud, double stiffness, ViscousProblem &problem) {
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
  ComponentMultigrid multigrid(problem.multigrid);
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

double shear_rate(const Mat<2> &gradient) {
  return (gradient + gradient.transpose()).norm() / std::sqrt(2.0);
}

namespace {

template <bool with_gradient>
void build_rows(const Points &points, const Cloud &cloud, const PressureProblem &pressure,
                ViscousProblem &problem) {
  const StencilBuilder<with_gradient> builder(points, cloud, pressure, problem);
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

void build_viscous_rows(const Points &points, const Cloud &cloud, const Rheology &rheology,
                        const PressureProblem &pressure, ViscousProblem &problem) {
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
    build_rows<false>(points, cloud, pressure, problem);
  else
    build_rows<true>(points, cloud, pressure, problem);
}

ViscousResult diffuse_velocity(const Points &points, const Walls &walls, const Cloud &cloud,
                               const Rheology &rheology, double density, double dt,
                               std::span<Vec<2>> velocity, ViscousProblem &problem) {
  const int n = points.size();
  const double factor = dt / density, spacing2 = cloud.spacing * cloud.spacing;
  const ViscousForce force(walls, cloud, problem, rheology.is_newtonian());
  const auto update_viscosity = [&](std::span<const Vec<2>> u, double relaxation) {
    if (rheology.is_newtonian()) {
      set_uniform_viscosity(rheology, n, problem);
    } else {
      update_velocity_gradient({walls, cloud, u}, problem);
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
  problem.source.resize(2 * n);
  problem.solution.resize(2 * n);
  for (int i = 0; i < n; ++i)
    for (int a = 0; a < 2; ++a)
      problem.solution[2 * i + a] = velocity[i][a];
  std::vector<Vec<2>> latest(velocity.begin(), velocity.end());
  const RheologyParams &law = rheology.params();
  double relaxation = 1, last_change = std::numeric_limits<double>::infinity();
  for (;;) {
    problem.previous = problem.solution;
    fill(force, cloud, factor, velocity, problem);
    result.iterations += solve(points, cloud, stiffness, problem);
    ++result.passes;
    for_each_point(n, [&](int i) {
      latest[i] = {problem.solution[2 * i], problem.solution[2 * i + 1]};
    });
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

} // namespace sluice::fluid
