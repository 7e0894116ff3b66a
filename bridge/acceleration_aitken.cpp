// SPDX-License-Identifier: MIT
#include "bridge/acceleration_aitken.hpp"

#include <algorithm>
#include <cmath>

namespace sluice::bridge {

namespace {

// A factor of zero would stop the iteration for good, one beyond 10 is an accident of two nearly
// equal residuals.
double within_reason(double relaxation) {
  const double size = std::clamp(std::abs(relaxation), 1e-4, 10.0);
  return std::copysign(size, relaxation);
}

} // namespace

AcceleratedIterate Aitken::next(const Eigen::VectorXd &iterate, const Eigen::VectorXd &solved,
                                double) {
  const Eigen::VectorXd residual = solved - iterate;
  if (last_residual_.size() > 0) {
    const Eigen::VectorXd change = residual - last_residual_;
    if (const double square = change.squaredNorm(); square > 0)
      relaxation_ = within_reason(-relaxation_ * last_residual_.dot(change) / square);
  }
  last_residual_ = residual;
  return {iterate + relaxation_ * residual, relaxation_, 0};
}

void Aitken::finish_window(const Eigen::VectorXd &, const Eigen::VectorXd &, double) {
  last_residual_.resize(0);
}

void Aitken::forget_window() {
  relaxation_ = initial_relaxation_;
  last_residual_.resize(0);
}

} // namespace sluice::bridge
