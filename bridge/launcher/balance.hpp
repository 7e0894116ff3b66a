// SPDX-License-Identifier: MIT
// Interface balance of a run from its two independent ends: the fluid's own traction integral
// (fluid_loads.csv) against the solid's assembled load vector (solid_loads.csv), window by window.
#pragma once

#include <filesystem>
#include <optional>

namespace sluice::launcher {

/// The largest difference over all windows, each relative to the window's sum of magnitudes.
struct Balance {
  double force = 0;  ///< |F_fluid - F_solid| / sum |f_i|
  double moment = 0; ///< |M_fluid - M_solid| / sum |r_i x f_i|
  double work = 0;   ///< |W_fluid - W_solid| / sum |f_i . u_i|
  int windows = 0;   ///< windows that both ends have logged
};

/// Nothing when one of the two files is not there (a case with one participant). A value that is
/// not finite makes its balance infinite. Throws UserError for a column that is missing.
std::optional<Balance> interface_balance(const std::filesystem::path &folder);

} // namespace sluice::launcher
