// SPDX-License-Identifier: MIT
#include "fluid/pressure.hpp"

#include "fluid/packed_stencil.hpp"
#include "fluid/pressure_stencil.hpp"

#include <cmath>

namespace sluice::fluid {

namespace {

// --- velocity -------------------------------------------------------------------------------

/// Functionals of the derivatives for fields known in the fluid only (velocity): no wall rows.
template <int dim> Mat<dim> fluid_gradient(const Stencil<dim> &s) {
  LinearFit<dim> fit;
  for_each_neighbour(s, [&](const Neighbour<dim> &n) { fit.add(n.q, n.w); });
  return (s.open ? fit.limited_inverse() : fit.inverse()) / s.h;
}

/// Gradient of u* at the point [1/s], g(a, b) = d u_a / d x_b, from the linear fit.
template <int dim> Mat<dim> linear_velocity_gradient(const Stencil<dim> &s, VecView<dim> velocity) {
  const Mat<dim> functional = fluid_gradient(s);
  Mat<dim> g = Mat<dim>::Zero();
  for_each_neighbour(s, [&](const Neighbour<dim> &m) {
    const Vec<dim> coefficient = functional.transpose() * m.q;
    g += (m.w * (velocity[m.j] - velocity[s.i])) * coefficient.transpose();
  });
  return g;
}

/// w times the coefficients of the derivatives at q: what a difference of values is multiplied
/// with.
template <int dim>
PackVec<dim> derivative_weights(const std::array<Pack, n_terms<dim> * dim> &functional,
                                const PackVec<dim> &q, const Pack &w) {
  const auto basis = quadratic_basis(q);
  PackVec<dim> coefficient;
  for (int d = 0; d < dim; ++d) {
    coefficient[d] = functional[d * n_terms<dim>] * basis[0];
    for (int t = 1; t < n_terms<dim>; ++t)
      coefficient[d] += functional[d * n_terms<dim> + t] * basis[t];
    coefficient[d] *= w;
  }
  return coefficient;
}

/// The same of eight points with the functionals of the pressure's gradient.
template <int dim>
std::array<Pack, dim * dim> velocity_gradients(const PackedStencil<dim> &s, VecView<dim> velocity,
                                               const PressureProblem<dim> &problem) {
  const auto functional = gathered(s.self(), problem.gradient.data());
  const PackVec<dim> u = gathered(s.self(), velocity.data());
  std::array<Pack, dim * dim> g{};
  s.for_each_neighbour([&](const int *j, const PackVec<dim> &q, const Pack &w) {
    const PackVec<dim> coefficient = derivative_weights<dim>(functional, q, w);
    const PackVec<dim> u_j = gathered(j, velocity.data());
    for (int b = 0; b < dim; ++b)
      for (int a = 0; a < dim; ++a)
        g[b * dim + a] += (u_j[a] - u[a]) * coefficient[b];
  });
  return g;
}

/// What the predicted velocity adds: its gradient, its approach to the walls, the source.
template <int dim> class SourceAssembler {
public:
  SourceAssembler(const Points<dim> &points, const Cloud<dim> &cloud, const PressureParams &params,
                  VecView<dim> velocity, std::span<const double> target, double dt,
                  PressureProblem<dim> &problem)
      : points_(points), cloud_(cloud), velocity_(velocity), target_(target),
        factor_(params.density / dt), problem_(problem) {}

  /// A point next to air or to a wall.
  void row(int i) const {
    Stencil<dim> s;
    gather(i, points_, cloud_, s);
    problem_.velocity_gradient[i] = linear_velocity_gradient(s, velocity_);
    set_source(i);
  }

  /// The points first .. first + 7.
  void rows(int first) const {
    const PackedStencil<dim> s(first, points_, cloud_);
    scatter(velocity_gradients(s, velocity_, problem_), s.count(),
            &problem_.velocity_gradient[first]);
    for (int i = first; i < first + s.count(); ++i)
      if (has_gradient_of_pressure(i))
        set_source(i);
      else
        row(i);
  }

private:
  // Far from walls the pressure's gradient, which is quadratic, serves the velocity too; next to
  // one its rows do not hold for a velocity.
  bool has_gradient_of_pressure(int i) const {
    return has_quadratic_gradient(problem_.row_kind[i]) && !has_wall_row(i, cloud_);
  }

  void set_source(int i) const {
    const bool is_open = cloud_.kind[i] != PointKind::interior;
    problem_.fluid_source[i] = is_open ? surface_source(i) : -source_of(i);
  }

  // The row acts on the difference to the pressure outside.
  double surface_source(int i) const {
    const double outside = points_.surface_pressure[i];
    if (outside == 0)
      return 0;
    double row_sum = problem_.matrix.diagonal[i];
    problem_.matrix.for_each_entry(i, [&](int, double value) { row_sum += value; });
    return outside * row_sum;
  }

  double source_of(int i) const {
    const double scale = cloud_.spacing * cloud_.spacing;
    const Mat<dim> &gradient = problem_.velocity_gradient[i];
    const double share = 1 - cloud_.openness[i];
    double source = share * factor_ * (gradient.trace() - target_[i]) * scale;
    for_each_wall_row(cloud_.walls_of(i), cloud_, [&](int m, const Projection<dim> &p) {
      const Vec<dim> at_wall = velocity_[i] + gradient * (p.point - points_.position[i]);
      WallRow<dim> &wall = problem_.wall_rows[cloud_.wall_slot[i]][m];
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

/// Water next to air, and what would release it.
template <int dim> class TensionFinder {
public:
  TensionFinder(const Points<dim> &points, const Cloud<dim> &cloud, PressureProblem<dim> &problem)
      : points_(points), cloud_(cloud), problem_(problem) {
    problem.is_air.resize(points.size());
    for_each_point(points.size(), [&](int i) {
      problem.is_air[i] =
          cloud.kind[i] != PointKind::interior || points.at_surface[i] == SurfaceMemory::released;
    });
  }

  /// Points first .. first + 7 that are to be released; most have no air in their lists.
  void find(int first, std::vector<char> &released) const {
    const PackedStencil<dim> s(first, points_, cloud_);
    PackMask sees_air{};
    for (int k = 0; k < s.width(); ++k)
      sees_air |= gathered_equal(s.neighbours(k), problem_.is_air.data(), 1);
    const unsigned lanes = bits_of(sees_air);
    for (int l = 0; l < s.count(); ++l) {
      const int i = first + l;
      released[i] = (lanes >> l & 1) != 0 && cloud_.kind[i] == PointKind::interior &&
                    is_next_to_air(i) && is_in_tension(i);
    }
  }

private:
  bool is_next_to_air(int i) const {
    const double near = 1.5 * cloud_.spacing;
    for (const int j : cloud_.neighbours.of(i))
      if (problem_.is_air[j] != 0 &&
          (points_.position[j] - points_.position[i]).squaredNorm() < near * near)
        return true;
    return false;
  }

  // One Jacobi step from the last pressure: is row i pulled below zero?
  bool is_in_tension(int i) const {
    double pull = problem_.source[i];
    problem_.matrix.for_each_entry(
        i, [&](int j, double value) { pull -= value * points_.pressure[j]; });
    return pull < 0;
  }

  const Points<dim> &points_;
  const Cloud<dim> &cloud_;
  const PressureProblem<dim> &problem_;
};

// --- gradient ---------------------------------------------------------------------------------

/// What walls, and the pressure outside of the surface, add to the gradient of a point;
/// datum(m, projection) is n . grad p at a wall [Pa/m].
template <int dim, class Datum>
Vec<dim> gradient_of_boundary(int i, const Points<dim> &points, const Cloud<dim> &cloud,
                              const PressureProblem<dim> &problem, double pressure, Datum &&datum) {
  Vec<dim> gradient = Vec<dim>::Zero();
  if (cloud.kind[i] != PointKind::interior) {
    const Vec<dim> side = open_side(i, cloud);
    gradient -= weight(side.norm()) * (pressure - points.surface_pressure[i]) *
                (problem.gradient[i].template topRows<dim>().transpose() * side);
  } else {
    for_each_wall_row(cloud.walls_of(i), cloud, [&](int m, const Projection<dim> &p) {
      gradient += datum(m, p) * problem.wall_rows[cloud.wall_slot[i]][m].gradient;
    });
  }
  return gradient;
}

/// The data of the problem at the walls of point i.
template <int dim>
auto datum_of(int i, const Cloud<dim> &cloud, const PressureProblem<dim> &problem) {
  return [&problem, slot = cloud.wall_slot[i]](int m, const Projection<dim> &) {
    return problem.wall_rows[slot][m].datum;
  };
}

/// grad p of every point; datum_of_point(i) makes the data at the walls of a point.
template <int dim, class DatumOfPoint>
void gradients_with(DatumOfPoint &&datum_of_point, const Points<dim> &points,
                    const Cloud<dim> &cloud, const PressureProblem<dim> &problem,
                    std::span<const double> pressure, VecSpan<dim> gradient) {
  for_each_pack(points.size(), [&](int first) {
    const PackedStencil<dim> s(first, points, cloud);
    const auto functional = gathered(s.self(), problem.gradient.data());
    const Pack p = gathered(s.self(), pressure.data());
    PackVec<dim> total{};
    s.for_each_neighbour([&](const int *j, const PackVec<dim> &q, const Pack &w) {
      const PackVec<dim> coefficient = derivative_weights<dim>(functional, q, w);
      const Pack difference = gathered(j, pressure.data()) - p;
      for (int d = 0; d < dim; ++d)
        total[d] += difference * coefficient[d];
    });
    scatter(total, s.count(), &gradient[first]);
    for (int i = first; i < first + s.count(); ++i)
      if (cloud.kind[i] != PointKind::interior || cloud.wall_slot[i] >= 0)
        gradient[i] +=
            gradient_of_boundary(i, points, cloud, problem, pressure[i], datum_of_point(i));
  });
}

// Pressure is zero at the point itself.
template <int dim> void set_open_at_point(int i, Cloud<dim> &cloud) {
  cloud.kind[i] = PointKind::thin;
  cloud.openness[i] = 1;
  cloud.surface_normal[i] = Vec<dim>::Zero();
  cloud.surface_depth[i] = 0;
}

} // namespace

template <int dim>
int release_tension(Points<dim> &points, const Walls<dim> &walls, const PressureParams &params,
                    VecView<dim> predicted_velocity, std::span<const double> target_divergence,
                    double dt, Cloud<dim> &cloud, PressureProblem<dim> &problem) {
  set_wall_velocity(walls, cloud, params, dt, problem);
  std::vector<char> &released = problem.is_released;
  released.resize(points.size());
  const TensionFinder<dim> tension(points, cloud, problem);
  for_each_pack(points.size(), [&](int first) { tension.find(first, released); });
  std::vector<int> &changed = problem.released;
  changed.clear();
  for (int i = 0; i < points.size(); ++i) {
    if (cloud.kind[i] != PointKind::interior)
      continue;
    points.at_surface[i] = released[i] ? SurfaceMemory::released : SurfaceMemory::enclosed;
    if (released[i]) {
      set_open_at_point(i, cloud);
      changed.push_back(i);
    }
  }
  const SourceAssembler<dim> sources(points, cloud, params, predicted_velocity, target_divergence,
                                     dt, problem);
  const auto assemble = [&](int i) {
    assemble_pressure_row(i, points, cloud, params, problem);
    sources.row(i);
  };
  for (const int i : changed) {
    assemble(i);
    for (const int j : cloud.neighbours.of(i))
      if (cloud.kind[j] != PointKind::thin && cloud.openness[j] > 0) // it has lost a donor
        assemble(j);
  }
  problem.has_open_point = problem.has_open_point || !changed.empty();
  return static_cast<int>(changed.size());
}

template <int dim>
void assemble_pressure_source(const Points<dim> &points, const Cloud<dim> &cloud,
                              const PressureParams &params, VecView<dim> predicted_velocity,
                              std::span<const double> target_divergence, double dt,
                              PressureProblem<dim> &problem) {
  const SourceAssembler<dim> assemble(points, cloud, params, predicted_velocity, target_divergence,
                                      dt, problem);
  for_each_pack(points.size(), [&](int first) { assemble.rows(first); });
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
      wall.datum = factor * (wall.approach - wall_speed) + wall.carried;
      problem.source[cloud.wall_points[k]] -= wall.laplacian * factor * wall_speed;
    }
  });
}

template <int dim>
Vec<dim> pressure_gradient(int i, const Points<dim> &points, const Cloud<dim> &cloud,
                           const PressureProblem<dim> &problem, std::span<const double> pressure) {
  Stencil<dim> s;
  gather(i, points, cloud, s);
  const auto &functional = problem.gradient[i];
  Vec<dim> gradient = Vec<dim>::Zero();
  for_each_neighbour(s, [&](const Neighbour<dim> &n) {
    const double scaled = n.w * (pressure[n.j] - pressure[i]);
    gradient += scaled * (functional.transpose() * quadratic_basis(n.q));
  });
  return gradient +
         gradient_of_boundary(i, points, cloud, problem, pressure[i], datum_of(i, cloud, problem));
}

template <int dim>
void pressure_gradients(const Points<dim> &points, const Cloud<dim> &cloud,
                        const PressureProblem<dim> &problem, std::span<const double> pressure,
                        VecSpan<dim> gradient) {
  gradients_with([&](int i) { return datum_of(i, cloud, problem); }, points, cloud, problem,
                 pressure, gradient);
}

template <int dim>
void carried_pressure_gradients(const Points<dim> &points, const Cloud<dim> &cloud,
                                const PressureProblem<dim> &problem, VecSpan<dim> gradient) {
  const auto last = [&](int i) {
    return [&last = points.pressure_gradient[i]](int, const Projection<dim> &p) {
      return p.normal.dot(last);
    };
  };
  gradients_with(last, points, cloud, problem, points.pressure, gradient);
}

template void assemble_pressure_source(const Points<2> &, const Cloud<2> &, const PressureParams &,
                                       VecView<2>, std::span<const double>, double,
                                       PressureProblem<2> &);
template int release_tension(Points<2> &, const Walls<2> &, const PressureParams &, VecView<2>,
                             std::span<const double>, double, Cloud<2> &, PressureProblem<2> &);
template void set_wall_velocity(const Walls<2> &, const Cloud<2> &, const PressureParams &, double,
                                PressureProblem<2> &);
template Vec<2> pressure_gradient(int, const Points<2> &, const Cloud<2> &,
                                  const PressureProblem<2> &, std::span<const double>);
template void carried_pressure_gradients(const Points<2> &, const Cloud<2> &,
                                         const PressureProblem<2> &, VecSpan<2>);
template void pressure_gradients(const Points<2> &, const Cloud<2> &, const PressureProblem<2> &,
                                 std::span<const double>, VecSpan<2>);
template void assemble_pressure_source(const Points<3> &, const Cloud<3> &, const PressureParams &,
                                       VecView<3>, std::span<const double>, double,
                                       PressureProblem<3> &);
template int release_tension(Points<3> &, const Walls<3> &, const PressureParams &, VecView<3>,
                             std::span<const double>, double, Cloud<3> &, PressureProblem<3> &);
template void set_wall_velocity(const Walls<3> &, const Cloud<3> &, const PressureParams &, double,
                                PressureProblem<3> &);
template Vec<3> pressure_gradient(int, const Points<3> &, const Cloud<3> &,
                                  const PressureProblem<3> &, std::span<const double>);
template void carried_pressure_gradients(const Points<3> &, const Cloud<3> &,
                                         const PressureProblem<3> &, VecSpan<3>);
template void pressure_gradients(const Points<3> &, const Cloud<3> &, const PressureProblem<3> &,
                                 std::span<const double>, VecSpan<3>);

} // namespace sluice::fluid
