// SPDX-License-Identifier: MIT
// SIGTERM as a wish: while this object lives it is noted, and the program goes on to a place where
// it can stop. A second one is the same wish: what ends a job often tells every process of it
// twice.
#pragma once

#include <csignal>

namespace sluice {

class StopSignal {
public:
  StopSignal() {
    has_come_ = 0;
    struct sigaction action {};
    action.sa_handler = [](int) { has_come_ = 1; };
    action.sa_flags = SA_RESTART;
    sigaction(SIGTERM, &action, &before_);
  }
  ~StopSignal() { sigaction(SIGTERM, &before_, nullptr); }
  StopSignal(const StopSignal &) = delete;
  StopSignal &operator=(const StopSignal &) = delete;
  bool has_come() const { return has_come_ != 0; }

private:
  static inline volatile std::sig_atomic_t has_come_ = 0; // a signal is the process's
  struct sigaction before_ {};
};

} // namespace sluice
