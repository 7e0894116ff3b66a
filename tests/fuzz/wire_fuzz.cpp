// SPDX-License-Identifier: MIT
// libFuzzer's entry: no input crashes a participant, hangs it or makes it take more memory than
// the protocol allows. README.md of this folder has the commands.
#include "tests/fuzz/wire_input.hpp"
#include "tests/support/temporary_folder.hpp"

#include <cstdio>
#include <cstdlib>

// libFuzzer's own memory comes from the sanitizer's operator new and goes through ours.
extern "C" const char *__asan_default_options() { return "alloc_dealloc_mismatch=0"; }

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t *bytes, std::size_t size) {
  using namespace sluice::bridge;
  static const sluice::TemporaryFolder folder;
  const auto reception = receive(std::as_bytes(std::span(bytes, size)), folder.path());
  if (reception.memory > memory_limit(reception.received)) {
    std::fprintf(stderr, "%zu bytes of memory for %zu that came\n", reception.memory,
                 reception.received);
    std::abort();
  }
  return 0;
}
