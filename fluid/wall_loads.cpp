// SPDX-License-Identifier: MIT
#include "fluid/wall_loads.hpp"

#include "fluid/parallel.hpp"
#include "fluid/weights.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <unordered_map>

namespace sluice::fluid {

namespace {

// A sample takes its pressure from points within this many spacings.
constexpr double load_radius = 2.0;
// It is wet when a point is nearer than the first, dry beyond the second, in between in part.
constexpr double wet_distance = 1.0, dry_distance = 1.5;

// Faces narrower than this share averages with others in a cube of that edge, in spacings, where
// the cosine of the angle between their normals is not smaller.
constexpr double narrow = 0.25, shared_edge = 0.5, cos_widest_turn = 0.866;

// The smallest height of a triangle.
double width_of(const Corners<2> &c) { return face_measure(c); }
double width_of(const Corners<3> &c) {
  const double longest =
      std::max({(c[1] - c[0]).norm(), (c[2] - c[1]).norm(), (c[0] - c[2]).norm()});
  return 2 * face_measure(c) / longest;
}

double wet_fraction(double nearest, double spacing) {
  return std::clamp((dry_distance - nearest / spacing) / (dry_distance - wet_distance), 0.0, 1.0);
}

template <int dim> class QuadratureBuilder {
public:
  QuadratureBuilder(const Points<dim> &points, const Walls<dim> &walls, const Cloud<dim> &cloud,
                    WallQuadrature<dim> &quadrature)
      : points_(points), walls_(walls), cloud_(cloud), quadrature_(quadrature) {}

  // Pieces no longer than a spacing; exact for linear pressure times shape.
  void add_face(int k) {
    const Corners<dim> corners = walls_.corners(walls_.faces[k]);
    for_each_quadrature_point(
        corners, cloud_.spacing,
        [&](const Shape<dim> &shape, double measure) { add_sample(k, shape, measure); },
        [&](const Corners<dim> &part) { return is_near_points(part); });
  }

  // For sums over all walls; the loads on coupled ones are those that the partner gets.
  void add_every_face() {
    std::vector<char> is_coupled(walls_.names.size(), 0);
    for (const int k : walls_.coupled_faces)
      is_coupled[walls_.faces[k].wall] = 1;
    for (int k = 0; k < static_cast<int>(walls_.faces.size()); ++k) {
      const WallFace<dim> &f = walls_.faces[k];
      if (is_coupled[f.wall] == 0 && width_of(walls_.corners(f)) < narrow * cloud_.spacing)
        add_narrow_face(k);
      else
        add_face(k);
    }
  }

private:
  // One point on each piece, in the middle of the `dim` points that the rule has there.
  void add_narrow_face(int k) {
    Shape<dim> sum{};
    int points = 0;
    for_each_quadrature_point(
        walls_.corners(walls_.faces[k]), cloud_.spacing,
        [&](const Shape<dim> &shape, double measure) {
          for (int c = 0; c < dim; ++c)
            sum[c] += shape[c] / dim;
          if (++points % dim > 0)
            return;
          add_sharing_sample(k, sum, dim * measure);
          sum = {};
        },
        [&](const Corners<dim> &part) { return is_near_points(part); });
  }

  void add_sharing_sample(int k, const Shape<dim> &shape, double measure) {
    const WallFace<dim> &face = walls_.faces[k];
    const Vec<dim> x = value_at<dim>(walls_.position, face, shape);
    const Vec<dim> inward = walls_.normal(face);
    const Average &average = average_around(x, inward, face.wall);
    const auto begin = quadrature_.contributions.begin() + average.first;
    const auto distance2 = [&](const auto &c) {
      return (points_.position[c.feeder] - x).squaredNorm();
    };
    const auto nearest =
        std::min_element(begin, begin + average.count,
                         [&](const auto &a, const auto &b) { return distance2(a) < distance2(b); });
    if (average.count == 0)
      return;
    const double wet = wet_fraction(std::sqrt(distance2(*nearest)), cloud_.spacing);
    if (wet > 0 && is_behind_another_wall(x, inward, nearest->feeder))
      add_sample(k, shape, measure); // a sheet in front of it hides what the others see
    else if (wet > 0)
      quadrature_.samples.push_back(
          {k, shape, x, Vec<dim>(-inward), wet * measure, average.first, average.count});
  }

  /// Contributions that samples share.
  struct Average {
    Vec<dim> inward;
    int wall;
    int first, count; // none: nothing was in sight
    int next;         // of the same cube, -1: the last
  };

  // The average of the cube that holds x, collected there unless it is known.
  const Average &average_around(const Vec<dim> &x, const Vec<dim> &inward, int wall) {
    std::uint64_t cube = 0;
    for (int d = 0; d < dim; ++d) {
      const auto number = std::lround(x[d] / (shared_edge * cloud_.spacing));
      cube = cube << 21 | (static_cast<std::uint64_t>(number) & 0x1fffff);
    }
    int &head = first_average_.try_emplace(cube, -1).first->second;
    int k = head;
    while (k >= 0 &&
           (averages_[k].wall != wall || averages_[k].inward.dot(inward) < cos_widest_turn))
      k = averages_[k].next;
    if (k < 0) {
      averages_.push_back({inward, wall, 0, 0, head});
      k = head = static_cast<int>(averages_.size()) - 1;
    }
    Average &average = averages_[k];
    if (average.count == 0) {
      average.first = static_cast<int>(quadrature_.contributions.size());
      collect(x, inward);
      average.count = static_cast<int>(quadrature_.contributions.size()) - average.first;
      normalise(average.first);
    }
    return average;
  }

  // False where no cell of the grid near a part of a face holds a point: most of a dry channel goes
  // in large parts. Where many cells are near nothing is said yet, the part will be halved.
  bool is_near_points(const Corners<dim> &part) const {
    const double reach = load_radius * cloud_.spacing;
    const Grid<dim> &grid = cloud_.grid;
    Vec<dim> low = part[0], high = part[0];
    for (const Vec<dim> &x : part) {
      low = low.cwiseMin(x);
      high = high.cwiseMax(x);
    }
    low.array() -= reach;
    high.array() += reach;
    if ((high.array() < grid.origin.array()).any() || (low.array() > grid.top().array()).any())
      return false;
    const auto first = grid.place(low), last = grid.place(high);
    int cells = 1;
    for (int d = 0; d < dim; ++d)
      cells *= last[d] - first[d] + 1;
    constexpr int few = dim == 2 ? 25 : 125;
    bool any = cells > few;
    if (!any)
      grid.for_each_run(first, last, [&](int begin, int end) {
        any = any || cloud_.ranges.start[begin] < cloud_.ranges.start[end + 1];
      });
    return any;
  }

  void add_sample(int k, const Shape<dim> &shape, double measure) {
    const WallFace<dim> &face = walls_.faces[k];
    const Vec<dim> x = value_at<dim>(walls_.position, face, shape);
    const Vec<dim> inward = walls_.normal(face);
    const int first = static_cast<int>(quadrature_.contributions.size());
    const double nearest = collect(x, inward);
    const int count = static_cast<int>(quadrature_.contributions.size()) - first;
    const double wet = count > 0 ? wet_fraction(nearest, cloud_.spacing) : 0.0;
    if (wet <= 0) {
      quadrature_.contributions.resize(first);
      return;
    }
    normalise(first);
    quadrature_.samples.push_back({k, shape, x, Vec<dim>(-inward), wet * measure, first, count});
  }

  // Adds the points in front of the face and in sight; returns the distance of the nearest.
  double collect(const Vec<dim> &x, const Vec<dim> &inward) {
    const double radius = load_radius * cloud_.spacing;
    double nearest = 1e300;
    for_each_point_near(x, [&](int i) {
      const Vec<dim> r = points_.position[i] - x;
      const double distance = r.norm();
      if (distance >= radius || r.dot(inward) <= 0 || is_behind_another_wall(x, inward, i))
        return;
      nearest = std::min(nearest, distance);
      quadrature_.contributions.push_back({i, weight(distance / radius)});
    });
    return nearest;
  }

  bool is_behind_another_wall(const Vec<dim> &x, const Vec<dim> &inward, int i) const {
    const PointWalls<dim> *near = cloud_.walls_of(i);
    if (!near || near->count == 0)
      return false;
    const double off_wall = 1e-6 * cloud_.spacing;
    const Vec<dim> from = x + off_wall * inward, &to = points_.position[i];
    // no wall enters the ball around the point up to its nearest one
    const double clear = (1 - 1e-9) * std::abs(near->projection[0].distance) / (to - from).norm();
    const Vec<dim> end = to + std::min(clear, 1.0) * (from - to);
    return cloud_.face_tree.any_along(
        from, end, [&](int f) { return is_crossed(walls_.corners(walls_.faces[f]), from, to); });
  }

  template <class Visit> void for_each_point_near(const Vec<dim> &x, Visit &&visit) const {
    const Grid<dim> &grid = cloud_.grid;
    const double reach = load_radius * cloud_.spacing;
    const Vec<dim> low = x.array() - reach, high = x.array() + reach;
    if ((high.array() < grid.origin.array()).any() || (low.array() > grid.top().array()).any())
      return;
    grid.for_each_run(grid.place(low), grid.place(high), [&](int first, int last) {
      for (int i = cloud_.ranges.start[first]; i < cloud_.ranges.start[last + 1]; ++i)
        visit(i);
    });
  }

  void normalise(int first) {
    auto begin = quadrature_.contributions.begin() + first, end = quadrature_.contributions.end();
    const double total =
        std::accumulate(begin, end, 0.0, [](double s, const auto &c) { return s + c.weight; });
    for (auto c = begin; c != end; ++c)
      c->weight /= total;
  }

  const Points<dim> &points_;
  const Walls<dim> &walls_;
  const Cloud<dim> &cloud_;
  WallQuadrature<dim> &quadrature_;
  std::vector<Average> averages_;
  std::unordered_map<std::uint64_t, int> first_average_; // by cube
};

// From point numbers to feeder numbers.
template <int dim> void number_feeders(int n_points, WallQuadrature<dim> &quadrature) {
  quadrature.feeders.clear();
  quadrature.feeder_of_point.assign(n_points, -1);
  for (typename WallQuadrature<dim>::Contribution &c : quadrature.contributions) {
    int &feeder = quadrature.feeder_of_point[c.feeder];
    if (feeder < 0) {
      feeder = static_cast<int>(quadrature.feeders.size());
      quadrature.feeders.push_back(c.feeder);
    }
    c.feeder = feeder;
  }
}

} // namespace

template <int dim>
void build_wall_quadrature(const Points<dim> &points, const Walls<dim> &walls,
                           const Cloud<dim> &cloud, WallPart part,
                           WallQuadrature<dim> &quadrature) {
  quadrature.samples.clear();
  quadrature.contributions.clear();
  QuadratureBuilder<dim> builder(points, walls, cloud, quadrature);
  if (part == WallPart::coupled)
    for (const int k : walls.coupled_faces)
      builder.add_face(k);
  else
    builder.add_every_face();
  number_feeders(points.size(), quadrature);
}

template <int dim>
void evaluate_tractions(const Points<dim> &points, const Walls<dim> &walls, const Cloud<dim> &cloud,
                        const PressureProblem<dim> &problem, std::span<const double> pressure,
                        std::span<const double> viscosity, WallQuadrature<dim> &quadrature,
                        std::vector<Vec<dim>> &traction) {
  std::vector<Vec<dim>> &gradient = quadrature.gradient;
  gradient.resize(quadrature.feeders.size());
  for_each_index(static_cast<int>(gradient.size()), [&](int f) {
    gradient[f] = pressure_gradient(quadrature.feeders[f], points, cloud, problem, pressure);
  });
  traction.resize(quadrature.samples.size());
  for_each_index(static_cast<int>(traction.size()), [&](int k) {
    const typename WallQuadrature<dim>::Sample &s = quadrature.samples[k];
    const Vec<dim> wall_velocity = value_at<dim>(walls.velocity, walls.faces[s.face], s.shape);
    const bool slips = walls.slips(s.face);
    double p = 0;
    Vec<dim> shear = Vec<dim>::Zero();
    for (int c = s.first; c < s.first + s.count; ++c) {
      const auto &[feeder, w] = quadrature.contributions[c];
      const int i = quadrature.feeders[feeder];
      const Vec<dim> r = s.position - points.position[i];
      p += w * (pressure[i] + gradient[feeder].dot(r));
      if (viscosity.empty() || slips)
        continue;
      const Vec<dim> slip = points.velocity[i] - wall_velocity;
      const double distance = std::max(r.dot(s.normal), 0.25 * cloud.spacing);
      shear += w * viscosity[i] / distance * (slip - slip.dot(s.normal) * s.normal);
    }
    traction[k] = p * s.normal + shear;
  });
}

template <int dim>
void integrate_nodal_forces(const Walls<dim> &walls, const WallQuadrature<dim> &quadrature,
                            VecView<dim> traction, VecSpan<dim> force) {
  std::fill(force.begin(), force.end(), Vec<dim>(Vec<dim>::Zero()));
  for (std::size_t k = 0; k < quadrature.samples.size(); ++k) {
    const typename WallQuadrature<dim>::Sample &s = quadrature.samples[k];
    for (int c = 0; c < dim; ++c)
      force[walls.faces[s.face].vertex[c]] += s.shape[c] * s.measure * traction[k];
  }
}

template <int dim>
Resultant<dim> integrate_resultant(const WallQuadrature<dim> &quadrature, VecView<dim> traction) {
  Resultant<dim> total;
  for (std::size_t k = 0; k < quadrature.samples.size(); ++k) {
    const Vec<dim> force = quadrature.samples[k].measure * traction[k];
    total.force += force;
    total.moment += cross(quadrature.samples[k].position, force);
  }
  return total;
}

template void build_wall_quadrature(const Points<2> &, const Walls<2> &, const Cloud<2> &, WallPart,
                                    WallQuadrature<2> &);
template void evaluate_tractions(const Points<2> &, const Walls<2> &, const Cloud<2> &,
                                 const PressureProblem<2> &, std::span<const double>,
                                 std::span<const double>, WallQuadrature<2> &,
                                 std::vector<Vec<2>> &);
template void integrate_nodal_forces(const Walls<2> &, const WallQuadrature<2> &, VecView<2>,
                                     VecSpan<2>);
template Resultant<2> integrate_resultant(const WallQuadrature<2> &, VecView<2>);
template void build_wall_quadrature(const Points<3> &, const Walls<3> &, const Cloud<3> &, WallPart,
                                    WallQuadrature<3> &);
template void evaluate_tractions(const Points<3> &, const Walls<3> &, const Cloud<3> &,
                                 const PressureProblem<3> &, std::span<const double>,
                                 std::span<const double>, WallQuadrature<3> &,
                                 std::vector<Vec<3>> &);
template void integrate_nodal_forces(const Walls<3> &, const WallQuadrature<3> &, VecView<3>,
                                     VecSpan<3>);
template Resultant<3> integrate_resultant(const WallQuadrature<3> &, VecView<3>);

} // namespace sluice::fluid
