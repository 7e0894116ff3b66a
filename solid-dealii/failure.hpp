// SPDX-License-Identifier: MIT
// A step that has no solution at its present length. Whoever drives the solver may restore the
// state and try a shorter one; nobody may go on with it.
#pragma once

#include "bridge/base/check.hpp"

namespace sluice::solid {

/// Newton's method failed from every start; `what()` has step, length, residual and smallest det F.
class NoSolution : public UserError {
public:
  using UserError::UserError;
};

} // namespace sluice::solid
