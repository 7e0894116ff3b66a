// SPDX-License-Identifier: MIT
// Walls of many small faces with bays, capes, hills and saddles, their vertices displaced at will.
#pragma once

#include "tests/support/fluid_cases.hpp"

#include <cmath>
#include <numbers>
#include <random>

namespace sluice::fluid::testing {

/// Numbers between -1 and 1, and vectors of them.
class Noise {
public:
  explicit Noise(unsigned seed) : engine_(seed) {}
  double operator()() { return uniform_(engine_); }
  template <int dim> Vec<dim> vector() {
    Vec<dim> v;
    for (double &x : v)
      x = (*this)();
    return v;
  }

private:
  std::mt19937 engine_;
  std::uniform_real_distribution<double> uniform_{-1, 1};
};

/// A closed outline of n segments within [-1, 1]^2, seen from inside; vertices are displaced by up
/// to `jitter` of a segment's length.
inline Walls<2> star(int n, double jitter) {
  Noise noise(1);
  std::vector<Vec<2>> x;
  for (int k = 0; k < n; ++k) {
    const double a = 2 * std::numbers::pi * k / n;
    x.emplace_back((0.6 + 0.2 * std::sin(7 * a)) * Vec<2>(std::cos(a), std::sin(a)) +
                   4.0 / n * jitter * noise.vector<2>());
  }
  x.push_back(x.front());
  return polyline(x);
}

/// Height of the hills.
inline double hill(double height, double x, double y) {
  return height * std::sin(9 * x) * std::cos(7 * y);
}

/// A sheet of 2 n^2 triangles, open all round, whose vertex (i, j) of (n + 1)^2 is at place(i, j).
template <class Place> Walls<3> sheet_of(int n, Place &&place) {
  Walls<3> sheet;
  sheet.names = {"sheet"};
  sheet.slip = {Slip::none};
  for (int j = 0; j <= n; ++j)
    for (int i = 0; i <= n; ++i)
      sheet.position.push_back(place(i, j));
  sheet.velocity.assign(sheet.position.size(), Vec<3>::Zero());
  for (int j = 0; j < n; ++j)
    for (int i = 0; i < n; ++i) {
      const int a = j * (n + 1) + i, b = a + 1, c = b + n + 1, d = a + n + 1;
      for (const std::array<int, 3> &corners : {std::array{a, b, c}, std::array{a, c, d}})
        sheet.faces.push_back({corners, 0, static_cast<int>(sheet.faces.size())});
    }
  link_faces(sheet);
  return sheet;
}

/// A sheet over [-1, 1]^2, seen from above; vertices are displaced by up to `jitter` of a side.
inline Walls<3> hills(int n, double height, double jitter) {
  Noise noise(2);
  return sheet_of(n, [&](int i, int j) -> Vec<3> {
    const double x = 2.0 * i / n - 1, y = 2.0 * j / n - 1;
    return Vec<3>(x, y, hill(height, x, y)) + 2.0 / n * jitter * noise.vector<3>();
  });
}

} // namespace sluice::fluid::testing
