// SPDX-License-Identifier: MIT
#include "tests/support/allocation_counter.hpp"

#include <atomic>
#include <cstdlib>
#include <malloc.h>
#include <new>

namespace {
std::atomic<long> count{0}, asked{0}; // calls, [bytes]
std::atomic<long> live{0}, peak{0};   // [bytes]
long live_at_begin = 0;

void *counted(void *memory) {
  ++count;
  const long now = live += static_cast<long>(::malloc_usable_size(memory));
  for (long most = peak; now > most && !peak.compare_exchange_weak(most, now);) {
  }
  return memory;
}
void give_back(void *memory) {
  if (memory)
    live -= static_cast<long>(::malloc_usable_size(memory));
  std::free(memory);
}
} // namespace

long sluice::testing::allocations() { return count; }
long sluice::testing::allocated_bytes() { return asked; }
void sluice::testing::begin_peak_memory() {
  live_at_begin = live;
  peak = live.load();
}
std::size_t sluice::testing::peak_memory() {
  return static_cast<std::size_t>(peak - live_at_begin);
}

void *operator new(std::size_t size) {
  asked += static_cast<long>(size);
  if (void *memory = std::malloc(size == 0 ? 1 : size))
    return counted(memory);
  throw std::bad_alloc();
}
void operator delete(void *memory) noexcept { give_back(memory); }
void operator delete(void *memory, std::size_t) noexcept { give_back(memory); }
