// SPDX-License-Identifier: MIT
// The bridge's only public entry: couples this solver with its partner in another process. The
// verbs and their meaning are those of preCICE v3, so that an adapter written for one reads like
// the other.
//
//   Participant bridge("fluid", config, out_dir);          //   solid: the same, with
//   bridge.set_mesh(interface_mesh);                       //   read "force",
//   bridge.initialize();                                   //   write "displacement", "velocity"
//   while (bridge.is_coupling_ongoing()) {
//     if (bridge.requires_writing_checkpoint()) saved = state;
//     const double dt = bridge.max_time_step_size();
//     bridge.read_data("displacement", dt, displacement);  // the iterate at the end of the step
//     bridge.read_data("velocity", dt, velocity);
//     step(state, dt);
//     bridge.write_data("force", nodal_forces);
//     bridge.advance(dt);
//     if (bridge.requires_reading_checkpoint()) state = saved;
//     else if (bridge.is_time_window_complete()) output(state);
//   }
//   bridge.finalize();
//
// Fields: "displacement" [m] and "velocity" [m/s], solid -> fluid, mapped consistently (H x);
// "force", nodal forces [N] (2-D: per metre of depth), fluid -> solid, conservatively (H^T F).
// All arrays hold dim components per node, node by node, in the order of the mesh of set_mesh.
//
// Scheme: serial (fluid first) or parallel. Every failure (partner absent, dead, silent, with
// another case file; data not finite; a window that does not converge) throws UserError and tells
// the partner.
#pragma once

#include "bridge/base/config.hpp"
#include "bridge/interface_mesh.hpp"
#include "bridge/map_report.hpp"
#include "bridge/settings.hpp"
#include "bridge/statistics.hpp"

#include <exception>
#include <filesystem>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace sluice::bridge {

class Transport;

class Participant {
public:
  /// `name` is "fluid" or "solid". Reads [bridge] and [case] of the case file; connects nothing
  /// yet. The solid writes `out_dir`/coupling.csv (and balance.csv when totals are reported).
  Participant(std::string name, const Config &config, const std::filesystem::path &out_dir);
  /// Speaks over `transport`, already connected, instead of a socket: between two threads
  /// (transport_local.hpp) or in one mpirun (transport_mpi.hpp). Nothing: as above.
  Participant(std::string name, const Config &config, const std::filesystem::path &out_dir,
              std::unique_ptr<Transport> transport);
  /// Without finalize (a throw passes through) the partner is sent an abort, best effort.
  ~Participant();
  Participant(const Participant &) = delete;
  Participant &operator=(const Participant &) = delete;

  /// The coupled surface in the reference configuration. Once, before initialize. Throws UserError
  /// on an unusable mesh.
  void set_mesh(InterfaceMesh mesh);
  /// Before initialize: this side goes on from `saved`, which `saved_state` gave in an earlier run;
  /// the solver's own state is the caller's. Throws UserError for the state of another role, of
  /// other coupling settings, or damaged; initialize throws where the partner goes on from another
  /// window.
  void restore(std::span<const std::byte> saved);
  /// Connects (either program may start first), compares the case files, exchanges the meshes,
  /// builds the map, exchanges initial data: write_data before this call sets it, else it is zero.
  /// The solid's call returns when the fluid's first forces are there.
  void initialize();

  bool is_coupling_ongoing() const;
  /// True after an advance that completed the window: the state is accepted.
  bool is_time_window_complete() const;
  /// What is left of the current window [s]; the whole window at its start.
  double max_time_step_size() const;
  /// True at the first iteration of a window until the next advance; only in an implicit scheme or
  /// where windows may be halved.
  bool requires_writing_checkpoint() const;
  /// True after an advance whose iteration did not converge, or whose window is tried again at half
  /// its length (then iteration() is 1): go back to the window's start.
  bool requires_reading_checkpoint() const;

  /// True after an advance that completed a window at whose end both sides write a restart file:
  /// every bridge.restart_every_windows windows and at the end of such a run, and where one side
  /// was told to stop. After report_totals.
  bool requires_writing_restart() const;
  /// All that this side's next bits depend on, at the end of a window; for the restart file.
  std::vector<std::byte> saved_state() const;
  /// Both sides write a restart file and stop at the end of this window or the next.
  void request_stop();
  /// True once they have: the coupling is over before the end time.
  bool is_stopped() const;

  /// Own field at the end of this step. Throws UserError for a wrong size, a field that this side
  /// does not write, or a value that is not finite (naming node and value; where
  /// windows are halved the window fails, and the field is zero until it is written again).
  void write_data(std::string_view field, std::span<const double> values);
  /// The partner's field at `relative_time` [s] after the current time: in a window of length dt
  /// 0 gives the value at its start, dt the current iterate at its end, linear in between, or on
  /// the parabola that also passes through the start of the window before (bridge.interpolation).
  /// The force at the start of the first window is the initial one (zero unless written). The
  /// solid's first call in a window waits for the fluid's forces.
  void read_data(std::string_view field, double relative_time, std::span<double> values) const;

  /// This side cannot do the window (its solver did not converge, say), in place of write_data;
  /// then advance(max_time_step_size()). Both sides go back to the window's start and try half of
  /// it, up to bridge.max_halvings times; with none left, the run ends on both sides with `reason`.
  void report_failure(std::string_view reason);

  /// Ends a step of length dt <= max_time_step_size() [s]. At the end of the window exchanges data
  /// with the partner and waits for it; before that (sub-steps) only moves the time on. A window
  /// that converged is complete when this returns, whatever becomes of the partner afterwards.
  void advance(double dt);
  /// Says goodbye. The partner's early end is an error until then.
  void finalize();
  /// Tells the partner why this side gives up. The caller then ends.
  void abort(std::string_view message) noexcept;

  /// Optional, after an advance that completed a window: this side's own sums over the interface
  /// in that window. When both sides report, the solid compares them (balance.csv, statistics).
  void report_totals(const InterfaceTotals &totals);

  const InterfaceMesh &mesh() const;
  const InterfaceMesh &partner_mesh() const; ///< valid after initialize
  const MapReport &map_report() const;       ///< valid after initialize
  const BridgeSettings &settings() const;
  const CaseSettings &case_settings() const;
  const Statistics &statistics() const;
  long time_window() const; ///< current window, counted from 1
  int iteration() const;    ///< current iteration in the window, counted from 1
  double time() const;      ///< [s] current time: window start plus completed sub-steps

private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

/// Runs `loop`, the coupled loop of a program; whatever it throws is told to the partner first.
template <class Loop> void run_coupled(Participant &bridge, Loop &&loop) {
  try {
    loop();
  } catch (const std::exception &error) {
    bridge.abort(error.what());
    throw;
  }
}

/// Sums over the interface for report_totals. `positions` are those of the reference configuration
/// [m], `forces` the nodal forces [N], `start` and `end` the displacements at both ends of the
/// window [m].
InterfaceTotals interface_totals(int dim, std::span<const double> positions,
                                 std::span<const double> forces, std::span<const double> start,
                                 std::span<const double> end);

} // namespace sluice::bridge
