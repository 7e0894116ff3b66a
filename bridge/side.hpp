// SPDX-License-Identifier: MIT
// What the fluid's and the solid's end of the bridge do differently: which fields they read and
// write, and what they exchange at connect and at the end of an iteration.
#pragma once

#include "bridge/balance_log.hpp"
#include "bridge/connection.hpp"
#include "bridge/interface_mesh.hpp"
#include "bridge/link.hpp"
#include "bridge/mapping.hpp"
#include "bridge/scheme.hpp"
#include "bridge/state_archive.hpp"
#include "bridge/window_clock.hpp"

#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>

namespace sluice::bridge {

/// A field that is read inside a window.
struct WindowField {
  std::vector<double> start, end; ///< at the start of the window; the current iterate at its end
  std::vector<double> before;     ///< at the start of the window before; empty in the first
  /// The window is accepted: `start` becomes what was before it, and is to be filled anew.
  void move_on() {
    before.swap(start);
    start.resize(before.size());
  }
  template <class Archive> void archive(Archive &a) { a(start, end, before); }
};

/// What both sides know of the run at an exchange.
struct Exchange {
  Link &link;
  const WindowClock &clock;
  Statistics &statistics;
  int iteration;                             ///< of this window, from 1
  const std::optional<WindowTotals> &totals; ///< own report of the window before
  const std::string &failure; ///< why this side could not do the window; "" if it did
  bool wants_to_stop = false; ///< this side, at the end of the window
};

class Side {
public:
  virtual ~Side() = default;
  /// Exchanges meshes (returned: the partner's) and initial data.
  virtual InterfaceMesh initialize(Link &link, const InterfaceMesh &own) = 0;
  /// Called once after initialize, and in every later window before its data are read or it is
  /// advanced: the solid waits here for the fluid's forces.
  virtual void await_window(const Exchange &) {}
  /// At the end of an iteration; throws UserError for a window that fails for good.
  virtual Verdict advance(const Exchange &exchange) = 0;
  virtual void finalize(const Exchange &exchange) = 0;
  /// Between two windows: all that the next ones depend on; back again after initialize. Throws
  /// UserError for the state of another mesh.
  virtual void save(StateWriter &state) = 0;
  virtual void restore(StateReader &state) = 0;
  virtual void add_totals(const WindowTotals &, Statistics &) {}
  virtual const MapReport &map_report() const = 0;

  std::map<std::string, WindowField, std::less<>> readable;
  std::map<std::string, std::vector<double>, std::less<>> writable;
  bool stops_here = false; ///< agreed by both at the end of a window
  std::uint64_t run = 0;   ///< number of this run, drawn by the fluid; after initialize
};

std::unique_ptr<Side> make_fluid_side(const BridgeSettings &settings);
/// Logs its iterations in `out_dir`/coupling.csv, from initialize on.
std::unique_ptr<Side> make_solid_side(const BridgeSettings &settings,
                                      const std::filesystem::path &out_dir);

// ---- records that both sides know ---------------------------------------------------------------

void write_mesh(PayloadWriter &write, const InterfaceMesh &mesh);
InterfaceMesh read_mesh(PayloadReader &read);
void send_mesh(Link &link, const InterfaceMesh &mesh);
/// Throws UserError when the partner's mesh is not usable.
InterfaceMesh receive_mesh(Link &link);

/// Window and iteration lead every record of the loop; throws MalformedMessage when the two
/// programs are not at the same one.
void write_position(PayloadWriter &write, const Exchange &exchange);
void check_position(PayloadReader &read, long window, int iteration);
/// Throws UserError where a restored field has another size than the mesh at hand.
void check_restored(const WindowField &field, std::size_t n_needed);
/// As the report is sent: the fluid builds the map, the solid learns what it looks like.
void write_report(PayloadWriter &write, const MapReport &report);
MapReport read_report(PayloadReader &read);
/// Upper bound [bytes] of a record with `n_values` numbers.
std::size_t record_limit(std::size_t n_values);
inline constexpr std::size_t longest_text = 1 << 16; ///< [bytes] of an explanation

} // namespace sluice::bridge
