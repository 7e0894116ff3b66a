// SPDX-License-Identifier: MIT
#include "fluid/viscosity.hpp"

#include "bridge/base/check.hpp"
#include "fluid/least_squares.hpp"
#include "fluid/parallel.hpp"
#include "fluid/weights.hpp"

#include <algorithm>

namespace sluice::fluid {

namespace {

/// The scaled matrix has a unit diagonal already and is diagonally dominant: nothing to do.
class NoPreconditioner : public Preconditioner {
public:
  void apply(std::span<const double> r, std::span<float> z) override {
    for_each_index(static_cast<int>(r.size()), [&](int i) { z[i] = static_cast<float>(r[i]); });
  }
};

template <int dim> class ViscousAssembler {
public:
  ViscousAssembler(const Points<dim> &points, const Walls<dim> &walls, const Cloud<dim> &cloud,
                   double factor, VecView<dim> velocity, ViscousProblem<dim> &problem)
      : points_(points), walls_(walls), cloud_(cloud), factor_(factor), velocity_(velocity),
        problem_(problem) {}

  void row(int i) const {
    const auto neighbours = cloud_.neighbours.of(i);
    const int start = problem_.matrix.row_start[i];
    double *entry = problem_.matrix.value.data() + start;
    std::fill(entry, entry + neighbours.size() + 1, 0.0);
    entry[0] = 1;
    Vec<dim> source = velocity_[i];
    if (cloud_.kind[i] == PointKind::interior)
      source += diffuse(i, neighbours, entry);
    for (int d = 0; d < dim; ++d)
      problem_.source[d][i] = source[d];
  }

private:
  // Fills the row of an interior point; returns what the walls add to its source.
  Vec<dim> diffuse(int i, std::span<const int> neighbours, double *entry) const {
    const Vec<dim> skew = skew_of(i, neighbours);
    Vec<dim> from_walls = Vec<dim>::Zero();
    double denominator = 0, sum = 0;
    for (std::size_t k = 0; k < neighbours.size(); ++k) {
      const double a =
          weight_of(points_.position[neighbours[k]] - points_.position[i], skew, denominator);
      entry[k + 1] = -a;
      sum += a;
    }
    for_each_projection(i, [&](const Projection<dim> &p) {
      const double a = weight_of(p.point - points_.position[i], skew, denominator);
      if (walls_.slips(p.face))
        return;
      from_walls += a * wall_velocity(walls_, p);
      sum += a;
    });
    const double scale = 2 * dim * factor_ / denominator;
    for (std::size_t k = 0; k < neighbours.size(); ++k)
      entry[k + 1] *= scale;
    entry[0] = 1 + scale * sum;
    return scale * from_walls;
  }

  template <class Visit> void for_each_projection(int i, Visit &&visit) const {
    if (const PointWalls<dim> *walls = cloud_.walls_of(i))
      for (const Projection<dim> &p : *walls)
        visit(p);
  }

  // Positive weight: the correction is limited so that the row stays an M-matrix row.
  double weight_of(const Vec<dim> &r, const Vec<dim> &skew, double &denominator) const {
    const Vec<dim> q = r / cloud_.radius;
    const double a = weight(std::min(q.norm(), 1.0)) * std::max(1 - q.dot(skew), 0.0);
    denominator += a * r.squaredNorm();
    return a;
  }

  Vec<dim> skew_of(int i, std::span<const int> neighbours) const {
    LinearFit<dim> fit;
    Vec<dim> offset = Vec<dim>::Zero();
    const auto add = [&](const Vec<dim> &r) {
      const Vec<dim> q = r / cloud_.radius;
      const double w = weight(std::min(q.norm(), 1.0));
      fit.add(q, w);
      offset += w * q;
    };
    for (const int j : neighbours)
      add(points_.position[j] - points_.position[i]);
    for_each_projection(i, [&](const Projection<dim> &p) { add(p.point - points_.position[i]); });
    return fit.inverse() * offset;
  }

  const Points<dim> &points_;
  const Walls<dim> &walls_;
  const Cloud<dim> &cloud_;
  double factor_;
  VecView<dim> velocity_;
  ViscousProblem<dim> &problem_;
};

template <int dim> void lay_out(const Cloud<dim> &cloud, ViscousProblem<dim> &problem) {
  lay_out_rows(cloud.neighbours, problem.matrix);
  for (int d = 0; d < dim; ++d) {
    problem.source[d].resize(cloud.kind.size());
    problem.solution[d].resize(cloud.kind.size());
  }
}

template <int dim>
int solve(const ViscousProblem<dim> &problem, std::span<const double> source, std::span<double> x,
          KrylovMemory &memory) {
  NoPreconditioner preconditioner;
  SolveOptions options;
  options.relative_tolerance = 1e-8;
  const SolveResult result = bicgstab(problem.scaled, source, x, preconditioner, options, memory);
  check(result.converged,
        "the viscous solve did not converge in {} iterations (residual {:.2e} m/s); "
        "reduce the time step",
        result.iterations, result.residual);
  return result.iterations;
}

} // namespace

template <int dim>
int diffuse_velocity(const Points<dim> &points, const Walls<dim> &walls, const Cloud<dim> &cloud,
                     double nu, double dt, VecSpan<dim> velocity, ViscousProblem<dim> &problem,
                     KrylovMemory &memory) {
  lay_out(cloud, problem);
  const ViscousAssembler<dim> assemble(points, walls, cloud, dt * nu, velocity, problem);
  for_each_point(points.size(), [&](int i) {
    assemble.row(i);
    for (int d = 0; d < dim; ++d)
      problem.solution[d][i] = velocity[i][d];
  });
  problem.scaled.build(problem.matrix);
  int iterations = 0;
  for (int d = 0; d < dim; ++d)
    iterations += solve(problem, problem.source[d], problem.solution[d], memory);
  for_each_point(points.size(), [&](int i) {
    for (int d = 0; d < dim; ++d)
      velocity[i][d] = problem.solution[d][i];
  });
  return iterations;
}

template int diffuse_velocity(const Points<2> &, const Walls<2> &, const Cloud<2> &, double, double,
                              VecSpan<2>, ViscousProblem<2> &, KrylovMemory &);
template int diffuse_velocity(const Points<3> &, const Walls<3> &, const Cloud<3> &, double, double,
                              VecSpan<3>, ViscousProblem<3> &, KrylovMemory &);

} // namespace sluice::fluid
