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

class ViscousAssembler {
public:
  ViscousAssembler(const Points &points, const Walls &walls, const Cloud &cloud, double factor,
                   std::span<const Vec<2>> velocity, ViscousProblem &problem)
      : points_(points), walls_(walls), cloud_(cloud), factor_(factor), velocity_(velocity),
        problem_(problem) {}

  void row(int i) const {
    const auto neighbours = cloud_.neighbours.of(i);
    const int start = problem_.matrix.row_start[i];
    double *entry = problem_.matrix.value.data() + start;
    std::fill(entry, entry + neighbours.size() + 1, 0.0);
    entry[0] = 1;
    Vec<2> source = velocity_[i];
    if (cloud_.kind[i] == PointKind::interior)
      source += diffuse(i, neighbours, entry);
    problem_.source_x[i] = source.x();
    problem_.source_y[i] = source.y();
  }

private:
  // Fills the row of an interior point; returns what the walls add to its source.
  Vec<2> diffuse(int i, std::span<const int> neighbours, double *entry) const {
    const Vec<2> skew = skew_of(i, neighbours);
    Vec<2> from_walls = Vec<2>::Zero();
    double denominator = 0, sum = 0;
    for (std::size_t k = 0; k < neighbours.size(); ++k) {
      const double a = weight_of(points_.position[neighbours[k]] - points_.position[i], skew,
                                 denominator);
      entry[k + 1] = -a;
      sum += a;
    }
    for_each_projection(i, [&](const Projection &p) {
      const double a = weight_of(p.point - points_.position[i], skew, denominator);
      from_walls += a * wall_velocity(walls_, p);
      sum += a;
    });
    const double scale = 4 * factor_ / denominator;
    for (std::size_t k = 0; k < neighbours.size(); ++k)
      entry[k + 1] *= scale;
    entry[0] = 1 + scale * sum;
    return scale * from_walls;
  }

  template <class Visit> void for_each_projection(int i, Visit &&visit) const {
    if (const PointWalls *walls = cloud_.walls_of(i))
      for (const Projection &p : *walls)
        visit(p);
  }

  // Positive weight: the correction is limited so that the row stays an M-matrix row.
  double weight_of(const Vec<2> &r, const Vec<2> &skew, double &denominator) const {
    const Vec<2> q = r / cloud_.radius;
    const double a =
        weight(std::min(q.norm(), 1.0)) * std::max(1 - q.dot(skew), 0.0);
    denominator += a * r.squaredNorm();
    return a;
  }

  Vec<2> skew_of(int i, std::span<const int> neighbours) const {
    LinearFit fit;
    Vec<2> offset = Vec<2>::Zero();
    const auto add = [&](const Vec<2> &r) {
      const Vec<2> q = r / cloud_.radius;
      const double w = weight(std::min(q.norm(), 1.0));
      fit.add(q, w);
      offset += w * q;
    };
    for (const int j : neighbours)
      add(points_.position[j] - points_.position[i]);
    for_each_projection(i, [&](const Projection &p) { add(p.point - points_.position[i]); });
    return fit.inverse() * offset;
  }

  const Points &points_;
  const Walls &walls_;
  const Cloud &cloud_;
  double factor_;
  std::span<const Vec<2>> velocity_;
  ViscousProblem &problem_;
};

void lay_out(const Cloud &cloud, ViscousProblem &problem) {
  lay_out_rows(cloud.neighbours, problem.matrix);
  for (auto *v : {&problem.source_x, &problem.source_y, &problem.x, &problem.y})
    v->resize(cloud.kind.size());
}

int solve(const ViscousProblem &problem, std::span<const double> source, std::span<double> x,
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

int diffuse_velocity(const Points &points, const Walls &walls, const Cloud &cloud, double nu,
                     double dt, std::span<Vec<2>> velocity, ViscousProblem &problem,
                     KrylovMemory &memory) {
  lay_out(cloud, problem);
  const ViscousAssembler assemble(points, walls, cloud, dt * nu, velocity, problem);
  for_each_point(points.size(), [&](int i) {
    assemble.row(i);
    problem.x[i] = velocity[i].x();
    problem.y[i] = velocity[i].y();
  });
  problem.scaled.build(problem.matrix);
  const int iterations = solve(problem, problem.source_x, problem.x, memory) +
                         solve(problem, problem.source_y, problem.y, memory);
  for_each_point(points.size(), [&](int i) { velocity[i] = {problem.x[i], problem.y[i]}; });
  return iterations;
}

} // namespace sluice::fluid
