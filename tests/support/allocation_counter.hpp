// SPDX-License-Identifier: MIT
// Counts and measures the allocations of a program that is linked with allocation_counter.cpp.
#pragma once

#include <cstddef>

namespace sluice::testing {

/// Calls of operator new since the program began.
long allocations();
/// [bytes] that they asked for.
long allocated_bytes();

/// What operator new has given out and not taken back: measured from the call of
/// `begin_peak_memory` on, the most of it at any moment.
void begin_peak_memory();
std::size_t peak_memory(); ///< [bytes]

} // namespace sluice::testing
