// SPDX-License-Identifier: MIT
// The solid without a partner, under the pressure of still water on its front side: what it is
// verified with, and how fast it is.
#pragma once

#include "bridge/base/config.hpp"
#include "solid-dealii/loads.hpp"

#include <filesystem>
#include <string>

namespace sluice::solid {

/// "static": equilibrium under follower and under dead pressure; "modes": natural frequencies;
/// "release": the dead pressure acts at once at t = 0, [case] gives step and end time, and the
/// series of a coupled run are written into `folder`. Results are printed.
void run_alone(const std::string &task, const Config &config, const Hydrostatic &water,
               const std::filesystem::path &folder);

} // namespace sluice::solid
