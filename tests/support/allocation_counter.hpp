// SPDX-License-Identifier: MIT
// Counts the allocations of a program that is linked with allocation_counter.cpp.
#pragma once

namespace sluice::testing {

/// Calls of operator new since the program began.
long allocations();
/// [bytes] that they asked for.
long allocated_bytes();

} // namespace sluice::testing
