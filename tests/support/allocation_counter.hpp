// SPDX-License-Identifier: MIT
// Counts the allocations of a program that is linked with allocation_counter.cpp.
#pragma once

namespace sluice::testing {

/// Calls of operator new since the program began.
long allocations();

} // namespace sluice::testing
