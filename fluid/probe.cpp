// SPDX-License-Identifier: MIT
#include "fluid/probe.hpp"

#include "fluid/least_squares.hpp"
#include "fluid/weights.hpp"

#include <Eigen/Cholesky>
#include <limits>

namespace sluice::fluid {

namespace {

using Terms = Eigen::Matrix<double, 6, 1>;

Terms terms_at(const Vec<2> &q) {
  Terms terms;
  terms << 1, quadratic_basis(q);
  return terms;
}

/// Normal equations of a fit with value, slopes and curvatures free, for several fields at once.
template <int fields> class ValueFit {
public:
  void add(const Vec<2> &q, const Eigen::Matrix<double, 1, fields> &values) {
    const Terms terms = terms_at(q);
    const double w = weight(std::min(q.norm(), 1.0));
    moment_ += w * terms * terms.transpose();
    right_ += w * terms * values;
    ++rows_;
  }
  /// The fields at q = 0; not numbers if the rows don't determine them.
  Eigen::Matrix<double, 1, fields> value() const {
    const Eigen::LDLT<Eigen::Matrix<double, 6, 6>> factor(moment_);
    if (rows_ < 6 || !(factor.rcond() > 1e-12))
      return Eigen::Matrix<double, 1, fields>::Constant(
          std::numeric_limits<double>::quiet_NaN());
    return factor.solve(right_).row(0);
  }

private:
  int rows_ = 0;
  Eigen::Matrix<double, 6, 6> moment_ = Eigen::Matrix<double, 6, 6>::Zero();
  Eigen::Matrix<double, 6, fields> right_ = Eigen::Matrix<double, 6, fields>::Zero();
};

template <class Visit> void for_each_point_near(const Cloud &cloud, const Vec<2> &x, Visit &&visit) {
  const Grid &grid = cloud.grid;
  const int column = grid.column(x.x()), row = grid.row(x.y());
  for (int r = std::max(row - 1, 0); r <= std::min(row + 1, grid.ny - 1); ++r)
    for (int c = std::max(column - 1, 0); c <= std::min(column + 1, grid.nx - 1); ++c)
      for (int i = cloud.ranges.start[r * grid.nx + c]; i < cloud.ranges.start[r * grid.nx + c + 1];
           ++i)
        visit(i);
}

// A place on a wall is moved into the fluid by a millionth of a spacing: from the wall itself nothing
// is in sight.
Vec<2> off_the_wall(const Walls &walls, std::span<const int> near_walls, const Vec<2> &place,
                    const Cloud &cloud) {
  const double least = 1e-6 * cloud.spacing;
  Vec<2> moved = place;
  for (const Projection &p : project_on_walls(walls, near_walls, place, cloud.radius))
    if (std::abs(p.distance) < least)
      moved -= least * p.normal;
  return moved;
}

} // namespace

Reading read_at(const FluidSolver &solver, const Vec<2> &wanted) {
  const Cloud &cloud = solver.cloud();
  const Points &points = solver.state.points;
  const auto near_walls = cloud.near_segments.near(cloud.grid.cell(wanted));
  const Vec<2> place = off_the_wall(solver.walls, near_walls, wanted, cloud);
  ValueFit<2> velocity;
  ValueFit<1> pressure;
  for_each_point_near(cloud, place, [&](int i) {
    const Vec<2> q = (points.position[i] - place) / cloud.radius;
    if (q.squaredNorm() >= 1 || is_hidden(solver.walls, near_walls, place, points.position[i]))
      return;
    velocity.add(q, points.velocity[i].transpose());
    pressure.add(q, Eigen::Matrix<double, 1, 1>(points.pressure[i]));
  });
  for (const Projection &p : project_on_walls(solver.walls, near_walls, place, cloud.radius))
    velocity.add((p.point - place) / cloud.radius, wall_velocity(solver.walls, p).transpose());
  return {velocity.value().transpose(), pressure.value()[0]};
}

ProbeOutput::ProbeOutput(const ProbeParams &params, const std::filesystem::path &folder)
    : params_(params), csv_(folder / ("probe_" + params.name + ".csv"),
                            "time_s,x_m,y_m,u_m_s,v_m_s,pressure_pa") {}

void ProbeOutput::write(const FluidSolver &solver, double time) {
  for (int k = 0; k < params_.samples; ++k) {
    const double t = params_.samples > 1 ? static_cast<double>(k) / (params_.samples - 1) : 0;
    const Vec<2> x = (1 - t) * params_.from + t * params_.to;
    const Reading r = read_at(solver, x);
    csv_.row({time, x.x(), x.y(), r.velocity.x(), r.velocity.y(), r.pressure});
  }
}

} // namespace sluice::fluid
