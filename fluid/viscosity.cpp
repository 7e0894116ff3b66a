// SPDX-License-Identifier: MIT
#include "fluid/viscosity.hpp"

#include "bridge/base/check.hpp"
#include "fluid/least_squares.hpp"
#include "fluid/packed_stencil.hpp"
#include "fluid/parallel.hpp"
#include "fluid/weights.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace sluice::fluid {

namespace {

// dt nu / spacing^2 up to which one explicit pass stands for the implicit solve: the two differ by
// the square of it, and four times that is stable.
constexpr double explicit_limit = 0.02;
// dt nu / spacing^2 from which the solve is preconditioned by multigrid.
constexpr double multigrid_limit = 20;

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
      gradient += outer<dim>(flow.velocity[neighbours[k]] - u,
                             problem.rows.gradient[problem.rows.start[i] + k]);
    for_each_wall(i, flow.cloud, [&](int m, const Projection<dim> &p) {
      gradient += outer<dim>(wall_velocity(flow.walls, p) - u,
                             problem.rows.wall_weights[flow.cloud.wall_slot[i]][m].gradient);
    });
    problem.velocity_gradient[i] = flow.cloud.kind[i] == PointKind::surface
                                       ? without_traction(gradient, flow.cloud.surface_normal[i])
                                       : gradient;
  });
}

// Weight of the new viscosity, on a logarithmic scale. With d ln mu / d ln gamma = n - 1 a pass
// multiplies the error of a mode by (1 - n) theta, theta in [0, 1] being the share of viscosity in
// its balance: w = 2 / (1 + n) makes the factors of both ends (1 - n) / (1 + n) and its opposite,
// the smallest possible. Derived here.
double relaxation_of(const Rheology &rheology) { return 2 / (1 + rheology.exponent()); }

// The same where passes do not settle by themselves: 1 / n overshoots nowhere at given stress.
double cautious_relaxation_of(const Rheology &rheology) {
  return std::min(1.0, 1 / rheology.exponent());
}

template <int dim>
void set_uniform_viscosity(const Rheology &rheology, int n, ViscousProblem<dim> &problem) {
  rheology.with_law([&](const auto &law) { problem.viscosity.assign(n, law(0)); });
  for (auto &walls : problem.rows.wall_weights)
    for (ViscousWallWeight<dim> &wall : walls)
      wall.viscosity = problem.viscosity.front();
}

template <int dim>
void set_viscosity(const Rheology &rheology, double relaxation, ViscousProblem<dim> &problem) {
  const int n = static_cast<int>(problem.velocity_gradient.size());
  problem.viscosity.resize(n);
  const RheologyParams &bounds = rheology.params();
  rheology.with_law([&](const auto &law) {
    for_each_point(n, [&](int i) {
      const double now = law(shear_rate(problem.velocity_gradient[i]));
      double &mu = problem.viscosity[i];
      mu = relaxation == 1 || mu == now
               ? now
               : std::clamp(mu * std::pow(now / mu, relaxation), bounds.lowest, bounds.highest);
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
      problem.rows.wall_weights[slot][m].viscosity = 0.5 * (mu + at_wall);
    });
  });
}

// --- rows -----------------------------------------------------------------------------------

/// Viscosity between two points, that of the law at their mean shear rate: exactly so for a yield
/// stress, where 1 / mu is proportional to the shear rate, and for a power law of exponent 2, where
/// mu is. The arithmetic mean would stiffen what lies next to a plug. Derived here.
struct HarmonicMean {
  double operator()(double a, double b) const { return a + b > 0 ? 2 * a * b / (a + b) : 0.0; }
};
struct ArithmeticMean {
  double operator()(double a, double b) const { return 0.5 * (a + b); }
};

/// The force per volume on one point, as a sum of blocks times velocity differences.
template <int dim, class Mean> class ViscousForce {
public:
  ViscousForce(const Walls<dim> &walls, const Cloud<dim> &cloud, const ViscousProblem<dim> &problem,
               bool is_uniform)
      : walls_(walls), cloud_(cloud), problem_(problem), is_uniform_(is_uniform) {}

  /// visit(j, block) for neighbours, wall_visit(velocity, block) for walls; blocks [Pa s / m^2].
  template <class Visit, class WallVisit>
  void for_each_block(int i, Visit &&visit, WallVisit &&wall_visit) const {
    const auto neighbours = cloud_.neighbours.of(i);
    const int start = problem_.rows.start[i];
    const double mu = problem_.viscosity[i];
    const ViscousRowForm form = problem_.rows.form[i];
    if (form == ViscousRowForm::pressures) {
      const SlicedMatrix &matrix = *problem_.rows.pressure_matrix;
      for (std::size_t k = 0; k < neighbours.size(); ++k) {
        const double entry = matrix.off_diagonal[matrix.pattern.place(i, static_cast<int>(k))];
        visit(neighbours[k],
              Mat<dim>(mu * problem_.rows.pressure_scale * entry * Mat<dim>::Identity()));
      }
      return;
    }
    const bool is_open = cloud_.kind[i] != PointKind::interior;
    const Vec<dim> slope = is_open || is_uniform_ ? Vec<dim>(Vec<dim>::Zero()) : viscosity_slope(i);
    for (std::size_t k = 0; k < neighbours.size(); ++k) {
      const int j = neighbours[k];
      const double mean = Mean{}(mu, problem_.viscosity[j]);
      if (form == ViscousRowForm::blocks)
        visit(j, Mat<dim>(mean * problem_.rows.block[start + k] +
                          outer(problem_.rows.gradient[start + k], slope)));
      else if (is_uniform_) // no gradients were made
        visit(j, Mat<dim>(mean * problem_.rows.laplacian[start + k] * Mat<dim>::Identity()));
      else
        visit(j, Mat<dim>(mean * problem_.rows.laplacian[start + k] * Mat<dim>::Identity() +
                          outer(problem_.rows.gradient[start + k], slope)));
    }
    for_each_wall(i, cloud_, [&](int m, const Projection<dim> &p) {
      const ViscousWallWeight<dim> &w = problem_.rows.wall_weights[cloud_.wall_slot[i]][m];
      const Mat<dim> laplacian =
          form == ViscousRowForm::blocks ? w.block : Mat<dim>(w.laplacian * Mat<dim>::Identity());
      wall_visit(wall_velocity(walls_, p),
                 Mat<dim>(w.viscosity * laplacian + outer(w.gradient, slope)));
    });
  }

private:
  Vec<dim> viscosity_slope(int i) const {
    const auto neighbours = cloud_.neighbours.of(i);
    const int start = problem_.rows.start[i];
    const double mu = problem_.viscosity[i];
    double least = mu;
    Vec<dim> slope = Vec<dim>::Zero();
    for (std::size_t k = 0; k < neighbours.size(); ++k) {
      const double mu_j = problem_.viscosity[neighbours[k]];
      slope += (mu_j - mu) * problem_.rows.gradient[start + k];
      least = std::min(least, Mean{}(mu, mu_j));
    }
    for_each_wall(i, cloud_, [&](int m, const Projection<dim> &) {
      const ViscousWallWeight<dim> &w = problem_.rows.wall_weights[cloud_.wall_slot[i]][m];
      slope += 2 * (w.viscosity - problem_.viscosity[i]) * w.gradient;
    });
    // What changes faster the points do not resolve, and the rows would lose their signs.
    const double steepest = 0.5 * least / cloud_.spacing, length = slope.norm();
    return length > steepest ? Vec<dim>(steepest / length * slope) : slope;
  }

  const Walls<dim> &walls_;
  const Cloud<dim> &cloud_;
  const ViscousProblem<dim> &problem_;
  bool is_uniform_;
};

/// Sum over the neighbours of entries of the pressure's matrix times differences of velocity.
template <int dim>
PackVec<dim> pressures_sums(const PackedStencil<dim> &s, const SlicedMatrix &matrix,
                            VecView<dim> velocity) {
  const PackVec<dim> u = gathered(s.self(), velocity.data());
  const double *entry = &matrix.off_diagonal[matrix.pattern.place(s.first(), 0)];
  PackVec<dim> total{};
  for (int k = 0; k < s.width(); ++k, entry += SlicedPattern::lanes) {
    const PackVec<dim> u_j = gathered(s.neighbours(k), velocity.data());
    for (int a = 0; a < dim; ++a)
      total[a] += load(entry) * (u_j[a] - u[a]);
  }
  return total;
}

// Rows of the pressure's matrix eight at a time, the others one by one.
template <int dim, class Mean>
void apply_explicitly(const ViscousForce<dim, Mean> &force, const Points<dim> &points,
                      const Cloud<dim> &cloud, double factor, VecSpan<dim> velocity,
                      ViscousProblem<dim> &problem) {
  const ViscousRows<dim> &rows = problem.rows;
  std::vector<double> &change = problem.source;
  change.resize(dim * velocity.size());
  const auto force_on = [&](int i) {
    Vec<dim> total = Vec<dim>::Zero();
    force.for_each_block(
        i, [&](int j, const Mat<dim> &block) { total += block * (velocity[j] - velocity[i]); },
        [&](const Vec<dim> &u, const Mat<dim> &block) { total += block * (u - velocity[i]); });
    return total;
  };
  for_each_pack(points.size(), [&](int first) {
    const PackedStencil<dim> s(first, points, cloud);
    const auto like_pressures = [&](int i) { return rows.form[i] == ViscousRowForm::pressures; };
    PackVec<dim> sums{};
    bool any = false;
    for (int i = first; i < first + s.count(); ++i)
      any = any || like_pressures(i);
    if (any)
      sums = pressures_sums(s, *rows.pressure_matrix, velocity);
    for (int l = 0; l < s.count(); ++l) {
      const int i = first + l;
      const bool is_regular = like_pressures(i);
      const Vec<dim> other = is_regular ? Vec<dim>(Vec<dim>::Zero()) : force_on(i);
      const double scale = problem.viscosity[i] * rows.pressure_scale;
      for (int a = 0; a < dim; ++a)
        change[dim * i + a] = factor * (is_regular ? scale * sums[a][l] : other[a]);
    }
  });
  for_each_point(points.size(), [&](int i) { velocity[i] += Vec<dim>(&change[dim * i]); });
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

template <int dim, class Mean>
void fill(const ViscousForce<dim, Mean> &force, const Cloud<dim> &cloud, double factor,
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

double viscous_number(const Rheology &rheology, double density, double dt, double spacing) {
  if (!rheology.is_newtonian())
    return std::numeric_limits<double>::infinity();
  double viscosity = 0;
  rheology.with_law([&](const auto &law) { viscosity = law(0); });
  return dt * viscosity / density / (spacing * spacing);
}

bool is_explicit(const Rheology &rheology, double density, double dt, double spacing) {
  return viscous_number(rheology, density, dt, spacing) < explicit_limit;
}

template <int dim> double shear_rate(const Mat<dim> &gradient) {
  return (gradient + gradient.transpose()).norm() / std::sqrt(2.0);
}

namespace {

template <class Mean, int dim>
ViscousResult diffuse_with(const Points<dim> &points, const Walls<dim> &walls,
                           const Cloud<dim> &cloud, const Rheology &rheology, double density,
                           double dt, VecView<dim> expected, VecSpan<dim> velocity,
                           ViscousProblem<dim> &problem) {
  const int n = points.size();
  const double factor = dt / density, spacing2 = cloud.spacing * cloud.spacing;
  const ViscousForce<dim, Mean> force(walls, cloud, problem, rheology.is_newtonian());
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
  double stiffness = update_viscosity(expected, 1);
  ViscousResult result;
  if (stiffness < explicit_limit) {
    apply_explicitly(force, points, cloud, factor, velocity, problem);
    return result;
  }
  lay_out(cloud, problem);
  problem.source.resize(dim * n);
  problem.solution.resize(dim * n);
  for (int i = 0; i < n; ++i)
    for (int a = 0; a < dim; ++a)
      problem.solution[dim * i + a] = expected[i][a];
  std::vector<Vec<dim>> latest(velocity.size());
  const RheologyParams &law = rheology.params();
  const double cautious = cautious_relaxation_of(rheology);
  double relaxation = relaxation_of(rheology),
         last_change = std::numeric_limits<double>::infinity();
  for (;;) {
    problem.previous = problem.solution;
    fill(force, cloud, factor, velocity, problem);
    result.iterations += solve(points, cloud, stiffness, problem);
    ++result.passes;
    for_each_point(n, [&](int i) { latest[i] = Vec<dim>(&problem.solution[dim * i]); });
    if (rheology.is_newtonian() || result.passes == law.picard_passes)
      break;
    const double change = relative_change(problem.solution, problem.previous);
    // a smaller step towards the law's viscosity stands for as much more of the way
    if (change < law.picard_tolerance * std::min(1.0, relaxation / cautious))
      break;
    if (change > 0.9 * last_change && relaxation <= cautious)
      relaxation = std::max(0.5 * relaxation, 0.25 * cautious);
    else if (change > 0.5 * last_change)
      relaxation = std::min(relaxation, cautious);
    last_change = change;
    stiffness = update_viscosity(latest, relaxation);
  }
  std::copy(latest.begin(), latest.end(), velocity.begin());
  return result;
}

} // namespace

template <int dim>
ViscousResult diffuse_velocity(const Points<dim> &points, const Walls<dim> &walls,
                               const Cloud<dim> &cloud, const Rheology &rheology, double density,
                               double dt, VecView<dim> expected, VecSpan<dim> velocity,
                               ViscousProblem<dim> &problem) {
  const auto diffuse =
      rheology.thins() ? diffuse_with<HarmonicMean, dim> : diffuse_with<ArithmeticMean, dim>;
  return diffuse(points, walls, cloud, rheology, density, dt, expected, velocity, problem);
}

template double shear_rate(const Mat<2> &);
template ViscousResult diffuse_velocity(const Points<2> &, const Walls<2> &, const Cloud<2> &,
                                        const Rheology &, double, double, VecView<2>, VecSpan<2>,
                                        ViscousProblem<2> &);
template double shear_rate(const Mat<3> &);
template ViscousResult diffuse_velocity(const Points<3> &, const Walls<3> &, const Cloud<3> &,
                                        const Rheology &, double, double, VecView<3>, VecSpan<3>,
                                        ViscousProblem<3> &);

} // namespace sluice::fluid
