// SPDX-License-Identifier: MIT
// The matrices that the linear solver is made for: quadratic weighted-least-squares Laplacians on a
// jittered cloud in a box, walls with zero normal derivative, pressure given at the top. The rows
// are those of the pressure equation, -laplacian(p), in one length unit = the spacing.
#pragma once

#include "fluid/aggregates.hpp"
#include "fluid/sparse_matrix.hpp"

#include <Eigen/Dense>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <random>
#include <vector>

namespace sluice::fluid::testing {

/// How the top of the box closes the equations.
enum class Top {
  dirichlet, ///< p = 0 on the top plane, as one more neighbour of the points near it
  identity,  ///< rows p_i = 0 for the topmost points
  algebraic, ///< rows p_i - sum c_j p_j = 0, sum c_j < 1, for the topmost points
  wall       ///< zero normal derivative as elsewhere: a singular matrix
};

template <int dim> struct CloudParams {
  std::array<int, dim> points; ///< per direction; the last direction is up
  double jitter = 0.25;        ///< largest displacement from the lattice, in spacings
  double radius = 2.1;         ///< of the stencils, in spacings
  Top top = Top::dirichlet;
  unsigned seed = 1;
};

template <int dim> struct Cloud {
  using Point = Eigen::Matrix<double, dim, 1>;
  std::vector<Point> position; ///< in spacings, sorted by cells of one radius
  std::vector<Cell> cell;      ///< of `cell_size`
  SparseMatrix matrix;
};

/// Grid cells of edge `size` that hold the points.
template <int dim>
std::vector<Cell> cells_of(const std::vector<Eigen::Matrix<double, dim, 1>> &position,
                           double size) {
  std::vector<Cell> cell(position.size(), Cell{});
  for (std::size_t i = 0; i < position.size(); ++i)
    for (int d = 0; d < dim; ++d)
      cell[i][d] = static_cast<int>(std::floor(position[i][d] / size));
  return cell;
}

template <int dim> class CloudBuilder {
public:
  using Point = Eigen::Matrix<double, dim, 1>;
  static constexpr int terms = dim + dim * (dim + 1) / 2;
  using Terms = Eigen::Matrix<double, terms, 1>;

  explicit CloudBuilder(const CloudParams<dim> &params) : params_(params) {}

  Cloud<dim> build() {
    scatter();
    sort_by_cell();
    cloud_.cell = cells_of<dim>(cloud_.position, 2.0 * params_.radius / 2.1);
    assemble();
    return std::move(cloud_);
  }

private:
  void scatter() {
    std::mt19937 engine(params_.seed);
    std::uniform_real_distribution<double> jitter(-params_.jitter, params_.jitter);
    const auto count =
        std::accumulate(params_.points.begin(), params_.points.end(), 1, std::multiplies<>());
    for (int n = 0; n < count; ++n) {
      Point x;
      for (int d = 0, rest = n; d < dim; rest /= params_.points[d++])
        x[d] = rest % params_.points[d] + 0.5 + jitter(engine);
      cloud_.position.push_back(x);
    }
  }

  void sort_by_cell() {
    for (int d = 0; d < dim; ++d)
      grid_[d] = static_cast<int>(params_.points[d] / params_.radius) + 1;
    std::stable_sort(cloud_.position.begin(), cloud_.position.end(),
                     [&](const Point &a, const Point &b) { return key(a) < key(b); });
    const int cells = std::accumulate(grid_.begin(), grid_.end(), 1, std::multiplies<>());
    start_.assign(cells + 1, 0);
    for (const auto &x : cloud_.position)
      ++start_[key(x) + 1];
    std::partial_sum(start_.begin(), start_.end(), start_.begin());
  }

  int key(const Point &x) const {
    int k = 0;
    for (int d = dim - 1; d >= 0; --d)
      k = k * grid_[d] + coordinate(x, d);
    return k;
  }
  int coordinate(const Point &x, int d) const {
    return std::clamp(static_cast<int>(x[d] / params_.radius), 0, grid_[d] - 1);
  }

  template <class Body> void for_each_neighbour(int i, Body &&body) const {
    const Point &x = cloud_.position[i];
    const int dz = dim == 3 ? 1 : 0;
    for (int z = -dz; z <= dz; ++z)
      for (int y = -1; y <= 1; ++y)
        for (int s = -1; s <= 1; ++s)
          visit_cell(x, {s, y, z}, [&](int j) {
            const Point r = (cloud_.position[j] - x) / params_.radius;
            if (j != i && r.norm() < 1)
              body(j, r);
          });
  }

  template <class Body>
  void visit_cell(const Point &x, std::array<int, 3> shift, Body &&body) const {
    int k = 0;
    for (int d = dim - 1; d >= 0; --d) {
      const int c = coordinate(x, d) + shift[d];
      if (c < 0 || c >= grid_[d])
        return;
      k = k * grid_[d] + c;
    }
    for (int j = start_[k]; j < start_[k + 1]; ++j)
      body(j);
  }

  static Terms basis(const Point &q) {
    Terms p;
    int t = 0;
    for (int a = 0; a < dim; ++a)
      p[t++] = q[a];
    for (int a = 0; a < dim; ++a)
      for (int b = a; b < dim; ++b)
        p[t++] = q[a] * q[b];
    return p;
  }

  static Terms normal_derivative(const Point &q, int axis, double sign) {
    Terms p = Terms::Zero();
    p[axis] = sign;
    int t = dim;
    for (int a = 0; a < dim; ++a)
      for (int b = a; b < dim; ++b, ++t)
        p[t] = sign * ((a == axis ? q[b] : 0) + (b == axis ? q[a] : 0));
    return p;
  }

  static Terms laplacian() {
    Terms c = Terms::Zero();
    int t = dim;
    for (int a = 0; a < dim; ++a)
      for (int b = a; b < dim; ++b, ++t)
        c[t] = a == b ? 2 : 0;
    return c;
  }

  static double weight(const Point &q) { return (1 - q.norm()) * (1 - q.norm()); }

  void assemble() {
    auto &m = cloud_.matrix;
    m.row_start = {0};
    for (int i = 0; i < static_cast<int>(cloud_.position.size()); ++i) {
      if (is_surface(i))
        add_surface_row(i);
      else
        add_laplacian_row(i);
      m.row_start.push_back(static_cast<int>(m.column.size()));
    }
  }

  double distance_to_top(int i) const {
    return params_.points[dim - 1] - cloud_.position[i][dim - 1];
  }
  bool is_surface(int i) const {
    return (params_.top == Top::identity || params_.top == Top::algebraic) &&
           distance_to_top(i) < 1;
  }

  // Linear extrapolation to the surface half a spacing above, weighted by distance.
  void add_surface_row(int i) {
    auto &m = cloud_.matrix;
    double total = 0;
    const auto first = m.column.size();
    m.column.push_back(i);
    m.value.push_back(1);
    if (params_.top == Top::identity)
      return;
    for_each_neighbour(i, [&](int j, const Point &q) {
      m.column.push_back(j);
      m.value.push_back(-weight(q));
      total += weight(q);
    });
    for (auto k = first + 1; k < m.value.size(); ++k)
      m.value[k] *= 0.75 / total;
  }

  void add_laplacian_row(int i) {
    auto &m = cloud_.matrix;
    const Point &x = cloud_.position[i];
    Eigen::Matrix<double, terms, terms> moments = Eigen::Matrix<double, terms, terms>::Zero();
    for_each_neighbour(
        i, [&](int, const Point &q) { moments += weight(q) * basis(q) * basis(q).transpose(); });
    for (int d = 0; d < dim; ++d)
      for (const double sign : {-1.0, 1.0})
        add_wall(moments, x, d, sign);
    const bool near_top =
        params_.top == Top::dirichlet && distance_to_top(i) < 0.5 * params_.radius;
    Point to_top = Point::Zero();
    to_top[dim - 1] = distance_to_top(i) / params_.radius;
    if (near_top)
      moments += basis(to_top) * basis(to_top).transpose();
    const Terms s = moments.llt().solve(laplacian()) / (params_.radius * params_.radius);
    const auto diagonal = m.column.size();
    m.column.push_back(i);
    m.value.push_back(near_top ? basis(to_top).dot(s) : 0);
    for_each_neighbour(i, [&](int j, const Point &q) {
      const double a = weight(q) * basis(q).dot(s);
      m.column.push_back(j);
      m.value.push_back(-a);
      m.value[diagonal] += a;
    });
  }

  void add_wall(Eigen::Matrix<double, terms, terms> &moments, const Point &x, int axis,
                double sign) {
    const bool is_top = axis == dim - 1 && sign > 0;
    const double distance = sign < 0 ? x[axis] : params_.points[axis] - x[axis];
    if (distance > 0.5 * params_.radius || (is_top && params_.top != Top::wall))
      return;
    Point q = Point::Zero();
    q[axis] = sign * distance / params_.radius;
    const Terms e = normal_derivative(q, axis, sign);
    moments += e * e.transpose();
  }

  CloudParams<dim> params_;
  Cloud<dim> cloud_;
  std::array<int, dim> grid_{};
  std::vector<int> start_;
};

template <int dim> Cloud<dim> make_cloud(const CloudParams<dim> &params) {
  return CloudBuilder<dim>(params).build();
}

} // namespace sluice::fluid::testing
