// SPDX-License-Identifier: MIT
// A piston on a spring with water behind it: the coupled problem that has a closed form. The
// water's force is -m_a (v_1 - v_0)/dt, the structure moves by the trapezoidal rule; both together
// are the trapezoidal rule for m_s + m_a, whose motion from d_0 at rest is d_0 cos(n theta) with
// tan(theta/2) = (dt/2) sqrt(k/(m_s + m_a)), to the last digit.
#pragma once

#include "bridge/participant.hpp"
#include "bridge/transport_local.hpp"

#include "support.hpp"

#include <cmath>
#include <functional>
#include <thread>

namespace sluice::bridge {

struct Piston {
  double structure_mass = 1; // [kg]
  double added_mass = 80;    // [kg]
  double stiffness = 4e4;    // [N/m]
  double start = 0.01;       // [m]
  double time_step = 1e-3;   // [s]
  int windows = 100;
  double end_time = 0; // [s]; 0: that of all windows
  double connect_deadline = 5; // [s]
  double silence_deadline = 5; // [s]
  std::string bridge_keys;     // lines of the table [bridge]

  std::string case_text() const {
    return fmt::format("[case]\nname = \"piston\"\nend_time_s = {:.17g}\ntime_step_s = {}\n"
                       "[bridge]\nconnect_deadline_s = {}\nsilence_deadline_s = {}\n{}\n",
                       end_time > 0 ? end_time : windows * time_step, time_step, connect_deadline, silence_deadline,
                       bridge_keys);
  }
  Config config() const { return Config::parse(case_text(), "piston.toml"); }
  double exact(int window) const {
    const double half = 0.5 * time_step * std::sqrt(stiffness / (structure_mass + added_mass));
    return start * std::cos(window * 2 * std::atan(half));
  }
};

// Non-matching meshes of the line x = 0, 0 <= y <= 1.
inline InterfaceMesh solid_line() { return polyline(uneven_line({0, 0}, {0, 1}, 3, 0)); }
inline InterfaceMesh fluid_line() { return polyline(uneven_line({0, 0}, {0, 1}, 7, 0.3)); }

/// Called by either program before it ends a step; may throw, end the process, change data.
using Event = std::function<void(Participant &, std::vector<double> &)>;

/// The fluid's program: uniform pressure from the mean acceleration of its wall.
inline void run_fluid(Participant &bridge, const Piston &piston, const Event &before_advance = {}) {
  const InterfaceMesh mesh = fluid_line();
  const std::size_t n = mesh.positions.size();
  std::vector<double> lengths(mesh.n_nodes(), 0.0);
  for (std::size_t f = 0; f < mesh.n_faces(); ++f) {
    const double length = mesh.position(f + 1)[1] - mesh.position(f)[1];
    lengths[f] += length / 2;
    lengths[f + 1] += length / 2;
  }
  bridge.set_mesh(mesh);
  bridge.initialize();
  std::vector<double> before(n), after(n), force(n), displacement(n), moved(n);
  while (bridge.is_coupling_ongoing()) {
    const double dt = bridge.max_time_step_size();
    bridge.read_data("velocity", 0, before);
    bridge.read_data("velocity", dt, after);
    bridge.read_data("displacement", 0, displacement);
    for (std::size_t k = 0; k < n; k += 2)
      force[k] = -piston.added_mass * lengths[k / 2] * (after[k] - before[k]) / dt;
    if (before_advance)
      before_advance(bridge, force);
    bridge.write_data("force", force);
    bridge.advance(dt);
    if (!bridge.is_time_window_complete())
      continue;
    bridge.read_data("displacement", 0, moved);
    bridge.report_totals(interface_totals(2, mesh.positions, force, displacement, moved));
  }
  bridge.finalize();
}

/// The solid's program; returns the displacement after each window.
inline std::vector<double> run_solid(Participant &bridge, const Piston &piston,
                                     const Event &before_advance = {}) {
  const InterfaceMesh mesh = solid_line();
  const std::size_t n = mesh.positions.size();
  const auto along_x = [&](double value) {
    std::vector<double> values(n, 0.0);
    for (std::size_t k = 0; k < n; k += 2)
      values[k] = value;
    return values;
  };
  double d = piston.start, v = 0, saved_d = d, saved_v = v;
  bridge.set_mesh(mesh);
  bridge.write_data("displacement", along_x(d));
  bridge.initialize();
  std::vector<double> force(n), history;
  while (bridge.is_coupling_ongoing()) {
    if (bridge.requires_writing_checkpoint()) {
      saved_d = d;
      saved_v = v;
    }
    const double dt = bridge.max_time_step_size(), d_old = d;
    bridge.read_data("force", dt, force);
    double sum = 0;
    for (std::size_t k = 0; k < n; k += 2)
      sum += force[k];
    const double m = piston.structure_mass, k = piston.stiffness;
    const double v_new =
        (m * v + dt * sum - dt * k * (d + 0.25 * dt * v)) / (m + 0.25 * dt * dt * k);
    d += 0.5 * dt * (v + v_new);
    v = v_new;
    auto displacement = along_x(d);
    if (before_advance)
      before_advance(bridge, displacement);
    bridge.write_data("displacement", displacement);
    bridge.write_data("velocity", along_x(v));
    bridge.advance(dt);
    if (bridge.requires_reading_checkpoint()) {
      d = saved_d;
      v = saved_v;
      continue;
    }
    history.push_back(d);
    bridge.report_totals(interface_totals(2, mesh.positions, force, along_x(d_old), along_x(d)));
  }
  bridge.finalize();
  return history;
}

struct Outcome {
  std::vector<double> history;
  Statistics fluid, solid;
  MapReport map;
  std::string fluid_error, solid_error;
};

// Runs both programs; `local` connects them in the process, otherwise by the case's transport.
inline Outcome run_both(const Piston &piston, const std::filesystem::path &folder, bool local,
                        const Event &in_fluid = {}, const Event &in_solid = {}) {
  Outcome outcome;
  std::pair<std::unique_ptr<Transport>, std::unique_ptr<Transport>> ends;
  if (local)
    ends = local_transports();
  std::thread fluid([&] {
    outcome.fluid_error = error_of([&] {
      Participant bridge("fluid", piston.config(), folder, std::move(ends.first));
      run_coupled(bridge, [&] { run_fluid(bridge, piston, in_fluid); });
      outcome.fluid = bridge.statistics();
    });
  });
  outcome.solid_error = error_of([&] {
    Participant bridge("solid", piston.config(), folder, std::move(ends.second));
    run_coupled(bridge, [&] { outcome.history = run_solid(bridge, piston, in_solid); });
    outcome.solid = bridge.statistics();
    outcome.map = bridge.map_report();
  });
  fluid.join();
  return outcome;
}

} // namespace sluice::bridge
