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
  /// Number of windows from `start` [s] on; the last one is shorter when what is left is no
  /// multiple of time_step.
  long n_windows(double start = 0) const { return std::lround(windows(start)); }

private:
  static constexpr double most_windows = 1e9; // months of computing; far from what a long holds
  double windows(double start = 0) const {
    return std::max(0.0, std::ceil((end_time - start) / time_step - 1e-6));
  }
};

/// Table [bridge]: how the participants talk, and how a window is iterated.
struct BridgeSettings {
  std::string transport = "unix";               ///< "unix", "shared" (one host), "tcp", "mpi"
  std::string address;                          ///< unix: path; tcp: "host:port"; "" derives one
  std::string token;                            ///< shared secret; SLUICE_TOKEN overrides
  std::string scheme = "serial-implicit";       ///< or "serial-explicit", "parallel-implicit", ...
  std::string acceleration = "iqn-ils";         ///< or "iqn-imvj", "aitken", "constant"
  std::string motion = "displacement-velocity"; ///< what the solid writes, or "displacement"
  std::string mapping = "projection";           ///< or "nearest", "mortar", "rbf"
  std::string iterate = "pressure";             ///< what the fluid repeats: "pressure" or "full"
  double connect_deadline = 30;                 ///< [s]
  double silence_deadline = 20;                 ///< [s] without a heartbeat from the partner
  double displacement_tolerance = 1e-4;         ///< relative to displacement_measure
  double force_tolerance = 1e-3;                ///< relative to force_measure
  std::string displacement_measure = "increment"; ///< or "value", "residual"
  std::string force_measure = "value";            ///< or "residual", "none"
  double displacement_floor = 0; ///< [m] root mean square over the nodes, converged in any case
  double force_floor = 0;        ///< [N] norm over all nodes, converged in any case
  std::string predictor = "velocity";   ///< of a window's first iterate, or "none"
  std::string interpolation = "linear"; ///< inside a window, or "quadratic"
  int max_iterations = 40;              ///< per window
  int max_halvings = 0;                 ///< of a window that fails; 0: the run ends
  int windows_to_grow = 4;              ///< accepted before a halved length doubles
  int windows_reused = 8;               ///< by the quasi-Newton methods
  double filter = 1e-4;                 ///< of quasi-Newton columns that repeat newer ones
  int restart_every = 0;                ///< windows between restart files; 0: none
  double initial_relaxation = 0.05;     ///< of the first iteration without history

  template <class Reader> void describe(Reader &read) {
    read("transport", transport, "unix or shared (memory) on one host, tcp, mpi (one mpirun)")
        .one_of({"unix", "shared", "tcp", "mpi"});
    read("address", address,
         "unix, shared: path of the socket; tcp: host:port, 127.0.0.1:port on one host");
    read("token", token, "shared text that the partner must show; SLUICE_TOKEN overrides it");
    read("scheme", scheme, "how a window is coupled")
        .one_of({"serial-implicit", "serial-explicit", "parallel-implicit", "parallel-explicit"});
    read("acceleration", acceleration, "how the next iterate is found")
        .one_of({"iqn-ils", "iqn-imvj", "aitken", "constant"});
    read("motion", motion, "what the solid writes")
        .one_of({"displacement-velocity", "displacement"});
    read("mapping", mapping, "how values pass between the two interface meshes")
        .one_of({"projection", "mortar", "rbf", "nearest"});
    read("iterate", iterate, "what the fluid repeats in an iteration").one_of({"pressure", "full"});
    read("connect_deadline_s", connect_deadline, "longest wait for the partner to start")
        .positive();
    read("silence_deadline_s", silence_deadline, "longest silence of the partner").positive();
    read("displacement_tolerance", displacement_tolerance, "relative to displacement_measure")
        .positive()
        .at_most(1);
    read("force_tolerance", force_tolerance, "change of the force relative to force_measure")
        .positive();
    read("displacement_measure", displacement_measure,
         "the window's increment, the value itself, or the window's first residual")
        .one_of({"increment", "value", "residual"});
    read("force_measure", force_measure,
         "the force itself, its first change in the window, or none: not asked")
        .one_of({"value", "residual", "none"});
    read("displacement_floor_m", displacement_floor,
         "residual that is small in any case, root mean square over the nodes")
        .at_least(0);
    read("force_floor_n", force_floor, "change of the force that is small in any case").at_least(0);
    read("predictor", predictor, "first iterate of a window: moved on, or as it was")
        .one_of({"velocity", "none"});
    read("interpolation", interpolation, "of data between the ends of a window")
        .one_of({"linear", "quadratic"});
    read("max_iterations", max_iterations, "iterations per window before the run is given up")
        .at_least(2);
    read("max_halvings", max_halvings,
         "how often a window that fails is halved and tried again; 0: the run ends")
        .at_least(0)
        .at_most(20);
    read("restart_every_windows", restart_every,
         "windows between restart files; 0: only when the run is told to stop")
        .at_least(0);
    read("windows_to_grow", windows_to_grow, "windows accepted before a halved length doubles")
        .at_least(1);
    read("windows_reused", windows_reused, "earlier windows whose history quasi-Newton keeps")
        .at_least(0);
    read("filter", filter,
         "part of a quasi-Newton column that must be new, that is not said by newer ones")
        .positive()
        .at_most(1);
    read("initial_relaxation", initial_relaxation, "step of an iteration without history")
        .positive()
        .at_most(1);
  }
  bool is_implicit() const { return scheme.ends_with("implicit"); }
  bool has_velocity() const { return motion == "displacement-velocity"; }
  bool is_parallel() const { return scheme.starts_with("parallel"); }
};

} // namespace sluice::bridge
