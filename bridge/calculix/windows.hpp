// SPDX-License-Identifier: MIT
// Steps a model through coupling windows: one run of ccx per iteration, one *STEP per window, each
// from the restart file of the window before.
//
//   calculix/model.inp     the model, includes put in; read in the first window only
//   calculix/window.inp    *INCLUDE of the model, or *RESTART, READ; then the deck's step
//   calculix/window.rin    the accepted state at the window's start; the same for every iteration
//   calculix/window.rout   the state at its end; becomes window.rin when the window is accepted
//
// Of the deck's step the time of *DYNAMIC becomes the window's length, and the forces are put in
// after it, as concentrated loads that replace those of the window before. ccx computes the
// acceleration anew at the start of every step, from the forces of that step.
#pragma once

#include "bridge/calculix/ccx.hpp"
#include "bridge/calculix/restart_file.hpp"

#include <cstddef>
#include <span>
#include <vector>

namespace sluice::calculix {

class Windows {
public:
  /// Writes `folder`/model.inp, from the state that the deck describes. Throws UserError when the
  /// folder cannot be written or there is no ccx.
  Windows(const Deck &deck, const std::string &program, int threads,
          const std::filesystem::path &folder);

  /// The state after `dt` [s] under nodal forces, constant over the window and in direction.
  /// From the last accepted state: a repetition is an iteration of the same window. Throws
  /// UserError for every failure of ccx.
  Motion solve(std::span<const NodalForce> forces, double dt);
  /// The state of the last solve is where the next window starts.
  void accept();

  /// The accepted state as ccx wrote it, after the first window; and back again before the first,
  /// which is the one after `windows` others then, at `time` [s]. Throws UserError for a state that
  /// is damaged or of another time.
  std::vector<std::byte> saved() const;
  Motion restore(std::span<const std::byte> state, double time, long windows);

  const CcxCost &cost() const { return ccx_.cost(); }

private:
  void write_input(std::span<const NodalForce> forces, double dt) const;
  std::string task(double dt) const;

  std::vector<Line> step_;
  Ccx ccx_;
  long accepted_ = 0;
  double time_ = 0, end_time_ = 0; // [s] at the start of the window, after the last solve
};

/// What ccx reads of a force or a time: it takes 20 characters, so 14 significant digits, and sizes
/// from 1e-99 (below: zero) to 1e100.
std::string as_ccx_reads(double value);
double rounded_as_ccx_reads(double value);

} // namespace sluice::calculix
