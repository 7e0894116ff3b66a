// SPDX-License-Identifier: MIT
// The tube of the implicit benchmark, coupled by the scheme: relative tolerance 1e-6 of the
// displacement, at most 100 iterations, no predictor.
#pragma once

#include "bridge/scheme.hpp"
#include "tests/support/tube.hpp"

#include <algorithm>
#include <string>

namespace sluice::bridge {

inline BridgeSettings tube_settings(const std::string &acceleration, double relaxation,
                                    int windows_reused, double filter = BridgeSettings().filter) {
  BridgeSettings settings;
  settings.acceleration = acceleration;
  settings.initial_relaxation = relaxation;
  settings.windows_reused = windows_reused;
  settings.filter = filter;
  settings.displacement_measure = "value";
  settings.displacement_tolerance = 1e-6;
  settings.force_measure = "none";
  settings.predictor = "none";
  settings.max_iterations = 100;
  return settings;
}

struct TubeResult {
  double mean = 0; ///< iterations per window
  int most = 0;
  double sum_y = 0;
  std::string error; ///< of the window that failed
};

inline TubeResult run_tube(double ratio, const BridgeSettings &settings) {
  Tube tube(ratio);
  const Eigen::VectorXd rest = Eigen::VectorXd::Zero(Tube::n);
  Scheme scheme(settings, {rest, Eigen::VectorXd()}, 1, Tube::n,
                settings.is_parallel() ? rest : Eigen::VectorXd());
  TubeResult result;
  for (int window = 1; window <= Tube::windows; ++window) {
    IterationRecord record;
    int iterations = 0;
    Eigen::VectorXd received;
    do {
      received = scheme.iterate().displacement;
      const Eigen::VectorXd pressure = tube.fluid(received, window);
      const Eigen::VectorXd y = tube.solid(settings.is_parallel() ? scheme.force() : pressure);
      record = scheme.advance({y, Eigen::VectorXd()}, pressure, Tube::dt, Tube::dt);
      ++iterations;
    } while (record.verdict == Verdict::iterate);
    if (record.verdict == Verdict::failed) {
      result.error = fmt::format("window {} {}", window, scheme.explanation(record));
      return result;
    }
    tube.accept(received, scheme.accepted().displacement);
    result.mean += static_cast<double>(iterations) / Tube::windows;
    result.most = std::max(result.most, iterations);
  }
  result.sum_y = scheme.accepted().displacement.sum();
  return result;
}

} // namespace sluice::bridge
