// SPDX-License-Identifier: MIT
// The tables [case] and [bridge] of a case file. Both participants read the same ones.
#pragma once

#include "bridge/base/config.hpp"

#include <algorithm>
#include <cmath>
#include <string>

namespace sluice::bridge {

/// Table [case]: what every participant needs to know of the run.
struct CaseSettings {
  std::string name;
  double end_time = 0;        ///< [s]
  double time_step = 0;       ///< [s], one coupling window
  double output_interval = 0; ///< [s], 0: no fields

  template <class Reader> void describe(Reader &read) {
    read("name", name, "name of the case");
    read.required("end_time_s", end_time, "time at which the run ends").positive();
    read.required("time_step_s", time_step, "length of one coupling window")
        .positive()
        .check(windows() >= 1 && windows() <= most_windows,
               fmt::format("makes {:.3g} windows until end_time_s = {}; 1 to {:.0e} are possible",
                           windows(), end_time, most_windows));
    read("output_interval_s", output_interval, "time between written fields").at_least(0);
  }
  /// Number of windows; the last one is shorter when end_time is no multiple of time_step.
  long n_windows() const { return std::lround(windows()); }

private:
  static constexpr double most_windows = 1e9; // months of computing; far from what a long holds
  double windows() const { return std::max(0.0, std::ceil(end_time / time_step - 1e-6)); }
};

/// Table [bridge]: how the participants talk, and how a window is iterated.
struct BridgeSettings {
  std::string transport = "unix";         ///< "unix" (one host) or "tcp"
  std::string address;                    ///< unix: path; tcp: "host:port"; "" derives one
  std::string token;                      ///< shared secret; SLUICE_TOKEN overrides
  std::string scheme = "serial-implicit"; ///< or "serial-explicit"
  std::string acceleration = "iqn-ils";   ///< or "aitken", "constant"
  std::string iterate = "pressure";       ///< what the fluid repeats: "pressure" or "full"
  double connect_deadline = 30;           ///< [s]
  double silence_deadline = 20;           ///< [s] without a heartbeat from the partner
  double displacement_tolerance = 1e-4;   ///< relative to the window's increment
  double force_tolerance = 1e-3;          ///< relative to the force
  int max_iterations = 40;                ///< per window
  int windows_reused = 8;                 ///< by iqn-ils
  double initial_relaxation = 0.05;       ///< of the first iteration without history

  template <class Reader> void describe(Reader &read) {
    read("transport", transport, "unix (one host) or tcp").one_of({"unix", "tcp"});
    read("address", address,
         "unix: path of the socket; tcp: host:port, 127.0.0.1:port on one host");
    read("token", token, "shared text that the partner must show; SLUICE_TOKEN overrides it");
    read("scheme", scheme, "how a window is coupled")
        .one_of({"serial-implicit", "serial-explicit"});
    read("acceleration", acceleration, "how the next iterate is found")
        .one_of({"iqn-ils", "aitken", "constant"});
    read("iterate", iterate, "what the fluid repeats in an iteration").one_of({"pressure", "full"});
    read("connect_deadline_s", connect_deadline, "longest wait for the partner to start")
        .positive();
    read("silence_deadline_s", silence_deadline, "longest silence of the partner").positive();
    read("displacement_tolerance", displacement_tolerance, "relative to the window's increment")
        .positive()
        .at_most(1);
    read("force_tolerance", force_tolerance, "change of the force relative to the force")
        .positive();
    read("max_iterations", max_iterations, "iterations per window before the run is given up")
        .at_least(2);
    read("windows_reused", windows_reused, "earlier windows whose history iqn-ils keeps")
        .at_least(0);
    read("initial_relaxation", initial_relaxation, "step of an iteration without history")
        .positive()
        .at_most(1);
  }
  bool is_implicit() const { return scheme == "serial-implicit"; }
};

} // namespace sluice::bridge
