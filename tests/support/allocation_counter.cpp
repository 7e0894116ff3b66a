// SPDX-License-Identifier: MIT
#include "tests/support/allocation_counter.hpp"

#include <atomic>
#include <cstdlib>
#include <new>

namespace {
std::atomic<long> count{0}, bytes{0};
} // namespace

long sluice::testing::allocations() { return count; }
long sluice::testing::allocated_bytes() { return bytes; }

void *operator new(std::size_t size) {
  ++count;
  bytes += static_cast<long>(size);
  if (void *memory = std::malloc(size == 0 ? 1 : size))
    return memory;
  throw std::bad_alloc();
}
void operator delete(void *memory) noexcept { std::free(memory); }
void operator delete(void *memory, std::size_t) noexcept { std::free(memory); }
