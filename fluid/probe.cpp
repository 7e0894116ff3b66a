// SPDX-License-Identifier: MIT
#include "fluid/probe.hpp"

#include "fluid/least_squares.hpp"
#include "fluid/weights.hpp"

#include <Eigen/Cholesky>
#include <limits>

namespace sluice::fluid {

namespace {

template <int dim> constexpr int n_unknowns = 1 + n_terms<dim>;
template <int dim> using Terms = Eigen::Matrix<double, n_unknowns<dim>, 1>;

template <int dim> Terms<dim> terms_at(const Vec<dim> &q) {
  Terms<dim> terms;
  terms << 1, quadratic_basis(q);
  return terms;
}

/// Normal equations of a fit with value, slopes and curvatures free, for several fields at once.
template <int dim, int fields> class ValueFit {
public:
  void add(const Vec<dim> &q, const Eigen::Matrix<double, 1, fields> &values) {
    const Terms<dim> terms = terms_at(q);
    const double w = weight(std::min(q.norm(), 1.0));
    moment_ += w * terms * terms.transpose();
    right_ += w * terms * values;
    ++rows_;
  }
  /// The fields at q = 0; not numbers if the rows don't determine them.
  Eigen::Matrix<double, 1, fields> value() const {
    const Eigen::LDLT<Eigen::Matrix<double, n, n>> factor(moment_);
    if (rows_ < n || !(factor.rcond() > 1e-12))
      return Eigen::Matrix<double, 1, fields>::Constant(std::numeric_limits<double>::quiet_NaN());
    return factor.solve(right_).row(0);
  }

private:
  static constexpr int n = n_unknowns<dim>;
  int rows_ = 0;
  Eigen::Matrix<double, n, n> moment_ = Eigen::Matrix<double, n, n>::Zero();
  Eigen::Matrix<double, n, fields> right_ = Eigen::Matrix<double, n, fields>::Zero();
};

template <int dim, class Visit>
void for_each_point_near(const Cloud<dim> &cloud, const Vec<dim> &x, Visit &&visit) {
  auto low = cloud.grid.place(x), high = low;
  for (int d = 0; d < dim; ++d) {
    low[d] = std::max(low[d] - 1, 0);
    high[d] = std::min(high[d] + 1, cloud.grid.size[d] - 1);
  }
  cloud.grid.for_each_run(low, high, [&](int first, int last) {
    for (int i = cloud.ranges.start[first]; i < cloud.ranges.start[last + 1]; ++i)
      visit(i);
  });
}

// A place on a wall is moved into the fluid by a millionth of a spacing: from the wall itself
// nothing is in sight.
template <int dim>
Vec<dim> off_the_wall(const Walls<dim> &walls, const Vec<dim> &place, const Cloud<dim> &cloud) {
  const double least = 1e-6 * cloud.spacing;
  Vec<dim> moved = place;
  for (const Projection<dim> &p : project_on_walls(walls, cloud.face_tree, place, cloud.radius))
    if (std::abs(p.distance) < least)
      moved -= least * p.normal;
  return moved;
}

} // namespace

template <int dim> Reading<dim> read_at(const FluidSolver<dim> &solver, const Vec<dim> &wanted) {
  const Cloud<dim> &cloud = solver.cloud();
  const Points<dim> &points = solver.state.points;
  const Vec<dim> place = off_the_wall(solver.walls, wanted, cloud);
  ValueFit<dim, dim> velocity;
  ValueFit<dim, 1> pressure;
  for_each_point_near(cloud, place, [&](int i) {
    const Vec<dim> q = (points.position[i] - place) / cloud.radius;
    if (q.squaredNorm() >= 1 || is_hidden(solver.walls, cloud.face_tree, place, points.position[i]))
      return;
    velocity.add(q, points.velocity[i].transpose());
    pressure.add(q, Eigen::Matrix<double, 1, 1>(points.pressure[i]));
  });
  for (const Projection<dim> &p :
       project_on_walls(solver.walls, cloud.face_tree, place, cloud.radius))
    velocity.add((p.point - place) / cloud.radius, wall_velocity(solver.walls, p).transpose());
  return {velocity.value().transpose(), pressure.value()[0]};
}

template <int dim>
ProbeOutput<dim>::ProbeOutput(const ProbeParams<dim> &params, const std::filesystem::path &folder)
    : params_(params), csv_(folder / ("probe_" + params.name + ".csv"),
                            dim == 2 ? "time_s,x_m,y_m,u_m_s,v_m_s,pressure_pa"
                                     : "time_s,x_m,y_m,z_m,u_m_s,v_m_s,w_m_s,pressure_pa") {}

template <int dim> void ProbeOutput<dim>::write(const FluidSolver<dim> &solver, double time) {
  for (int k = 0; k < params_.samples; ++k) {
    const double t = params_.samples > 1 ? static_cast<double>(k) / (params_.samples - 1) : 0;
    const Vec<dim> x = (1 - t) * params_.from + t * params_.to;
    const Reading<dim> r = read_at(solver, x);
    std::vector<double> row{time};
    for (const double coordinate : x)
      row.push_back(coordinate);
    for (const double component : r.velocity)
      row.push_back(component);
    row.push_back(r.pressure);
    csv_.row(row);
  }
}

template Reading<2> read_at(const FluidSolver<2> &, const Vec<2> &);
template class ProbeOutput<2>;
template Reading<3> read_at(const FluidSolver<3> &, const Vec<3> &);
template class ProbeOutput<3>;

} // namespace sluice::fluid
