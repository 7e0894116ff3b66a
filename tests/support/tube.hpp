// SPDX-License-Identifier: MIT
// The added-mass model problem "linear tube" of the implicit benchmark (after Causin, Gerbeau and
// Nobile, Comput. Methods Appl. Mech. Eng. 194 (2005) 4506-4527), the same that preCICE 3.4.1 was
// measured with:
//   wall   m y_tt - T y_xx = p,        y = 0 at both ends
//   fluid  -p_xx = -rho y_tt,          p = p_in(t) at x = 0, p = 0 at x = L
// 100 inner nodes, second differences, y_tt = (y_1 - 2 y_0 + y_m)/dt^2, all else at the new time.
// rho is chosen so that a plain iteration multiplies the error of the longest wave by -ratio. The
// answer after 40 windows, sum_y, is the monolithic one.
#pragma once

#include <Eigen/Core>

#include <cmath>
#include <numbers>
#include <utility>
#include <vector>

namespace sluice::bridge {

class Tube {
public:
  static constexpr int n = 100, windows = 40;
  static constexpr double dt = 0.05;

  explicit Tube(double ratio) {
    const double s = std::sin(std::numbers::pi * h / 2);
    const double longest = h * h / (4 * s * s); // eigenvalue of (-d_xx)^-1
    density_ = ratio * (1 + dt * dt / longest) / longest;
  }
  /// Monolithic sum of y after the last window, for each ratio of the benchmark.
  static std::vector<std::pair<double, double>> references() {
    return {{0.1, -1.62562405422}, {0.5, -1.90727812722}, {1, -1.31014180242},
            {2, -0.133786155005},  {5, 0.923863602725},   {10, 0.91253813131}};
  }

  /// Pressure for a displacement of the wall at the end of the window.
  Eigen::VectorXd fluid(const Eigen::VectorXd &y, int window) const {
    Eigen::VectorXd right = -density_ * (y - 2 * fluid_.last + fluid_.before) / (dt * dt);
    right[0] += inflow(window * dt) / (h * h);
    return tridiagonal(1 / (h * h), 2 / (h * h), right);
  }
  /// Displacement for a pressure.
  Eigen::VectorXd solid(const Eigen::VectorXd &p) const {
    return tridiagonal(1 / (h * h), 1 / (dt * dt) + 2 / (h * h),
                       p + (2 * solid_.last - solid_.before) / (dt * dt));
  }
  /// Each side keeps its own: the fluid what it last computed with, the solid what it answered.
  void accept(const Eigen::VectorXd &received, const Eigen::VectorXd &answered) {
    fluid_.before = std::exchange(fluid_.last, received);
    solid_.before = std::exchange(solid_.last, answered);
  }

private:
  static constexpr double h = 1.0 / (n + 1);
  static double inflow(double t) {
    return t < 0.5 ? 0.5 * (1 - std::cos(4 * std::numbers::pi * t)) : 0;
  }
  // -d u_(i-1) + e u_i - d u_(i+1) = r_i
  static Eigen::VectorXd tridiagonal(double d, double e, Eigen::VectorXd r) {
    Eigen::VectorXd c(n);
    c[0] = -d / e;
    r[0] /= e;
    for (int i = 1; i < n; ++i) {
      const double pivot = e + d * c[i - 1];
      c[i] = -d / pivot;
      r[i] = (r[i] + d * r[i - 1]) / pivot;
    }
    for (int i = n - 2; i >= 0; --i)
      r[i] -= c[i] * r[i + 1];
    return r;
  }

  struct History {
    Eigen::VectorXd last = Eigen::VectorXd::Zero(n), before = last;
  };
  double density_ = 1;
  History fluid_, solid_;
};

} // namespace sluice::bridge
