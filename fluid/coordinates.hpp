// SPDX-License-Identifier: MIT
// Places and sizes as text, for messages.
#pragma once

#include "bridge/base/vec.hpp"

#include <fmt/format.h>
#include <string>

namespace sluice::fluid {

/// "(0.1, 0.2)" or "(0.1, 0.2, 0.3)".
template <int dim> std::string text_of(const Vec<dim> &x) {
  if constexpr (dim == 2)
    return fmt::format("({:.6g}, {:.6g})", x[0], x[1]);
  else
    return fmt::format("({:.6g}, {:.6g}, {:.6g})", x[0], x[1], x[2]);
}

/// "0.1 x 0.2" or "0.1 x 0.2 x 0.3".
template <int dim> std::string text_of_size(const Vec<dim> &size) {
  if constexpr (dim == 2)
    return fmt::format("{:.3g} x {:.3g}", size[0], size[1]);
  else
    return fmt::format("{:.3g} x {:.3g} x {:.3g}", size[0], size[1], size[2]);
}

} // namespace sluice::fluid
