// SPDX-License-Identifier: MIT
// The solid without a partner, under its own load (gravity, tractions) or, when it has none, under
// the pressure of still water on the front side of its box: what it is verified with, and how fast
// it is.
#pragma once

#include "bridge/base/config.hpp"
#include "solid-dealii/loads.hpp"
#include "solid-dealii/ranks.hpp"

#include <filesystem>
#include <string>

namespace sluice::solid {

/// "static": equilibrium (under water: of follower and of dead pressure); "modes": natural
/// frequencies; "release": the load acts at once at t = 0, [case] gives step and end time, and the
/// series of a coupled run are written into `folder`. Results are printed. `restart`: a
/// solid_state.h5 that the release goes on from. On several ranks all of them call it.
void run_alone(const std::string &task, const Config &config, const Hydrostatic &water,
               const std::filesystem::path &folder, const std::filesystem::path &restart = {},
               const Ranks &ranks = {});

} // namespace sluice::solid
