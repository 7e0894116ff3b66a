// SPDX-License-Identifier: MIT
#include "tests/support/mapping_case.hpp"

#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <tuple>

namespace sluice::bridge::benchmark {

namespace {

using std::numbers::pi;

// Vertices that several patches share are made once.
class Welded {
public:
  InterfaceMesh mesh{3, 3, {}, {}};
  int add(const Vec<3> &x) {
    const auto key =
        std::tuple(std::lround(x[0] * 1e9), std::lround(x[1] * 1e9), std::lround(x[2] * 1e9));
    const auto [entry, is_new] = numbers_.try_emplace(key, static_cast<int>(mesh.n_nodes()));
    if (is_new)
      mesh.positions.insert(mesh.positions.end(), {x[0], x[1], x[2]});
    return entry->second;
  }
  void triangle(int a, int b, int c) { mesh.faces.insert(mesh.faces.end(), {a, b, c}); }

private:
  std::map<std::tuple<long, long, long>, int> numbers_;
};

constexpr double golden = 1.618033988749894848;
constexpr std::array<std::array<double, 3>, 12> icosahedron{{{-1, golden, 0},
                                                             {1, golden, 0},
                                                             {-1, -golden, 0},
                                                             {1, -golden, 0},
                                                             {0, -1, golden},
                                                             {0, 1, golden},
                                                             {0, -1, -golden},
                                                             {0, 1, -golden},
                                                             {golden, 0, -1},
                                                             {golden, 0, 1},
                                                             {-golden, 0, -1},
                                                             {-golden, 0, 1}}};
constexpr std::array<std::array<int, 3>, 20> icosahedron_faces{
    {{0, 11, 5},  {0, 5, 1},  {0, 1, 7},  {0, 7, 10}, {0, 10, 11}, {1, 5, 9}, {5, 11, 4},
     {11, 10, 2}, {10, 7, 6}, {7, 1, 8},  {3, 9, 4},  {3, 4, 2},   {3, 2, 6}, {3, 6, 8},
     {3, 8, 9},   {4, 9, 5},  {2, 4, 11}, {6, 2, 10}, {8, 6, 7},   {9, 8, 1}}};

void add_geodesic_face(Welded &welded, const std::array<int, 3> &face, int n) {
  std::vector<std::vector<int>> vertex(static_cast<std::size_t>(n) + 1);
  for (int i = 0; i <= n; ++i)
    for (int j = 0; i + j <= n; ++j) {
      Vec<3> x = Vec<3>::Zero();
      const std::array<double, 3> parts{static_cast<double>(n - i - j) / n,
                                        static_cast<double>(i) / n, static_cast<double>(j) / n};
      for (std::size_t k = 0; k < 3; ++k)
        x += parts[k] *
             Eigen::Map<const Vec<3>>(icosahedron[static_cast<std::size_t>(face[k])].data());
      vertex[static_cast<std::size_t>(i)].push_back(welded.add(x.normalized()));
    }
  const auto at = [&](int i, int j) {
    return vertex[static_cast<std::size_t>(i)][static_cast<std::size_t>(j)];
  };
  for (int i = 0; i < n; ++i)
    for (int j = 0; i + j < n; ++j) {
      welded.triangle(at(i, j), at(i + 1, j), at(i, j + 1));
      if (i + j + 1 < n)
        welded.triangle(at(i + 1, j), at(i + 1, j + 1), at(i, j + 1));
    }
}

double height(double x, double y) { return 0.2 * std::sin(2 * pi * x) * std::cos(pi * y); }

// xorshift64, uniform in [-1/2, 1/2).
double random(std::uint64_t &state) {
  state ^= state << 13;
  state ^= state >> 7;
  state ^= state << 17;
  return static_cast<double>(state >> 11) / 9007199254740992.0 - 0.5;
}

Vec<3> normal(Surface surface, const Vec<3> &x) {
  if (surface == Surface::sphere)
    return x.normalized();
  const double along_x = 0.4 * pi * std::cos(2 * pi * x[0]) * std::cos(pi * x[1]);
  const double along_y = -0.2 * pi * std::sin(2 * pi * x[0]) * std::sin(pi * x[1]);
  return Vec<3>(-along_x, -along_y, 1).normalized();
}

double franke_plane(double u, double v) {
  return 0.75 * std::exp(-((u - 2) * (u - 2) + (v - 2) * (v - 2)) / 4) +
         0.75 * std::exp(-(u + 1) * (u + 1) / 49 - (v + 1) / 10) +
         0.5 * std::exp(-((u - 7) * (u - 7) + (v - 3) * (v - 3)) / 4) -
         0.2 * std::exp(-(u - 4) * (u - 4) - (v - 7) * (v - 7));
}

double franke_space(double u, double v, double w) {
  return 0.75 * std::exp(-((u - 2) * (u - 2) + (v - 2) * (v - 2) + (w - 2) * (w - 2)) / 4) +
         0.75 * std::exp(-(u + 1) * (u + 1) / 49 - (v + 1) / 10 - (w + 1) / 10) +
         0.5 * std::exp(-((u - 7) * (u - 7) + (v - 3) * (v - 3) + (w - 5) * (w - 5)) / 4) -
         0.2 * std::exp(-(u - 4) * (u - 4) - (v - 7) * (v - 7) - (w - 5) * (w - 5));
}

template <class Field> std::vector<double> at_nodes(const InterfaceMesh &mesh, Field &&field) {
  std::vector<double> values;
  for (std::size_t a = 0; a < mesh.n_nodes(); ++a) {
    const Vec<3> v = field(mesh.point(a));
    values.insert(values.end(), {v[0], v[1], v[2]});
  }
  return values;
}

Eigen::Map<const Vec<3>> node_value(const std::vector<double> &values, std::size_t a) {
  return Eigen::Map<const Vec<3>>(values.data() + 3 * a);
}

} // namespace

InterfaceMesh geodesic_sphere(int n) {
  Welded welded;
  for (const auto &face : icosahedron_faces)
    add_geodesic_face(welded, face, n);
  const Eigen::Matrix3d turn =
      (Eigen::AngleAxisd(-0.7, Vec<3>::UnitZ()).inverse() * Eigen::AngleAxisd(0.3, Vec<3>::UnitX()))
          .toRotationMatrix();
  for (std::size_t a = 0; a < welded.mesh.n_nodes(); ++a) {
    Eigen::Map<Vec<3>> x(welded.mesh.positions.data() + 3 * a);
    x = (turn * x).normalized();
  }
  return std::move(welded.mesh);
}

InterfaceMesh cubed_sphere(int n) {
  Welded welded;
  for (int face = 0; face < 6; ++face) {
    std::vector<int> vertex;
    for (int i = 0; i <= n; ++i)
      for (int j = 0; j <= n; ++j) {
        const double side = face % 2 ? -1 : 1, a = std::tan(pi / 4 * (2.0 * i / n - 1)),
                     b = std::tan(pi / 4 * (2.0 * j / n - 1));
        Vec<3> x;
        x[face / 2] = side;
        x[(face / 2 + 1) % 3] = side * a;
        x[(face / 2 + 2) % 3] = b;
        vertex.push_back(welded.add(x.normalized()));
      }
    const auto at = [&](int i, int j) { return vertex[static_cast<std::size_t>(i * (n + 1) + j)]; };
    for (int i = 0; i < n; ++i)
      for (int j = 0; j < n; ++j) {
        welded.triangle(at(i, j), at(i + 1, j), at(i + 1, j + 1));
        welded.triangle(at(i, j), at(i + 1, j + 1), at(i, j + 1));
      }
  }
  return std::move(welded.mesh);
}

namespace {

// `place` gives the vertex (i, j) in units of h; `is_turned` the diagonal of its cell.
template <class Place, class Turned> InterfaceMesh plate(int n, Place &&place, Turned &&is_turned) {
  InterfaceMesh mesh{3, 3, {}, {}};
  for (int i = 0; i < n; ++i)
    for (int j = 0; j < n; ++j) {
      const Vec<2> x = place(i, j) / (n - 1);
      mesh.positions.insert(mesh.positions.end(), {x[0], x[1], height(x[0], x[1])});
    }
  for (int i = 0; i + 1 < n; ++i)
    for (int j = 0; j + 1 < n; ++j) {
      const int a = i * n + j, b = a + n, c = b + 1, d = a + 1;
      if (is_turned(i, j))
        mesh.faces.insert(mesh.faces.end(), {a, b, d, b, c, d});
      else
        mesh.faces.insert(mesh.faces.end(), {a, b, c, a, c, d});
    }
  return mesh;
}

} // namespace

InterfaceMesh regular_plate(int n) {
  return plate(
      n,
      [](int i, int j) -> Vec<2> {
        return {i, j};
      },
      [](int, int) { return false; });
}

InterfaceMesh jittered_plate(int n, std::uint64_t &state) {
  const auto place = [&](int i, int j) -> Vec<2> {
    const double dx = 0.5 * random(state), dy = 0.5 * random(state);
    return {i > 0 && i < n - 1 ? i + dx : i, j > 0 && j < n - 1 ? j + dy : j};
  };
  return plate(n, place, [](int i, int j) { return (i + j) % 2 == 1; });
}

double scalar(Surface surface, const Vec<3> &x) {
  if (surface == Surface::plate)
    return franke_plane(9 * x[0], 9 * x[1]);
  return franke_space(4.5 * (x[0] + 1), 4.5 * (x[1] + 1), 4.5 * (x[2] + 1));
}

Vec<3> displacement(const Vec<3> &x) {
  return {0.1 * std::sin(pi * x[1]), 0.1 * std::cos(pi * x[2]), 0.1 * std::sin(pi * x[0] + 0.3)};
}

Vec<3> traction(Surface surface, const Vec<3> &x) {
  return -(1 + scalar(surface, x)) * normal(surface, x) + 0.1 * Vec<3>(-x[1], x[0], 0);
}

std::vector<double> displacements(const InterfaceMesh &mesh) {
  return at_nodes(mesh, displacement);
}

std::vector<double> scalars(Surface surface, const InterfaceMesh &mesh) {
  return at_nodes(mesh,
                  [&](const Vec<3> &x) -> Vec<3> { return Vec<3>::Constant(scalar(surface, x)); });
}

std::vector<double> nodal_forces(Surface surface, const InterfaceMesh &mesh) {
  std::vector<double> forces =
      at_nodes(mesh, [&](const Vec<3> &x) { return traction(surface, x); });
  const std::vector<double> areas = node_areas(mesh);
  for (std::size_t k = 0; k < forces.size(); ++k)
    forces[k] *= areas[k / 3];
  return forces;
}

FieldError error(const std::vector<double> &got, const std::vector<double> &exact) {
  double square = 0, difference = 0, size = 0, largest = 0;
  for (std::size_t k = 0; k < exact.size(); ++k) {
    const double d = got[k] - exact[k];
    difference += d * d;
    square += exact[k] * exact[k];
    largest = std::max(largest, std::abs(d));
    size = std::max(size, std::abs(exact[k]));
  }
  return {std::sqrt(difference / square), largest / size};
}

ForceError force_error(Surface surface, const InterfaceMesh &from, const std::vector<double> &given,
                       const InterfaceMesh &to, const std::vector<double> &got) {
  Vec<3> force = Vec<3>::Zero(), moment = Vec<3>::Zero();
  double force_size = 0, moment_size = 0;
  for (std::size_t a = 0; a < from.n_nodes(); ++a) {
    const Vec<3> f = node_value(given, a), m = from.point(a).cross(f);
    force -= f;
    moment -= m;
    force_size += f.norm();
    moment_size += m.norm();
  }
  ForceError result;
  const std::vector<double> areas = node_areas(to);
  double difference = 0, square = 0, largest = 0, size = 0;
  for (std::size_t a = 0; a < to.n_nodes(); ++a) {
    const Vec<3> f = node_value(got, a), t = traction(surface, to.point(a));
    force += f;
    moment += to.point(a).cross(f);
    const double d = (f / areas[a] - t).norm();
    difference += areas[a] * d * d;
    square += areas[a] * t.squaredNorm();
    largest = std::max(largest, d);
    size = std::max(size, t.norm());
    result.empty += (f.norm() == 0 ? 1.0 : 0.0) / static_cast<double>(to.n_nodes());
  }
  result.force = force.norm() / force_size;
  result.moment = moment.norm() / moment_size;
  result.traction_l2 = std::sqrt(difference / square);
  result.traction_max = largest / size;
  return result;
}

double work(const std::vector<double> &force, const std::vector<double> &displacement) {
  double sum = 0;
  for (std::size_t k = 0; k < force.size(); ++k)
    sum += force[k] * displacement[k];
  return sum;
}

} // namespace sluice::bridge::benchmark
