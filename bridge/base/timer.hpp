// SPDX-License-Identifier: MIT
// Wall time by named phase, for one table at the end of a run.
#pragma once

#include <chrono>
#include <ctime>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace sluice {

/// CPU time of this process, all threads together [s].
inline double process_cpu_time() {
  timespec t{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
  return static_cast<double>(t.tv_sec) + 1e-9 * static_cast<double>(t.tv_nsec);
}

/// Seconds since construction.
class Stopwatch {
public:
  double seconds() const {
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - start_).count();
  }

private:
  std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
};

/// Accumulates wall time by phase, in the order in which phases first appear.
class PhaseTimer {
public:
  /// Times `action` under `phase` and returns what it returns.
  template <class Action> decltype(auto) operator()(std::string_view phase, Action &&action) {
    const Scope scope(*this, phase);
    return std::forward<Action>(action)();
  }
  const std::vector<std::pair<std::string, double>> &seconds() const { return seconds_; }

private:
  struct Scope {
    Scope(PhaseTimer &t, std::string_view p) : timer(t), phase(p) {}
    ~Scope() { timer.add(phase, watch.seconds()); }
    Scope(const Scope &) = delete;
    Scope &operator=(const Scope &) = delete;
    PhaseTimer &timer;
    std::string_view phase;
    Stopwatch watch;
  };
  void add(std::string_view phase, double seconds) {
    for (auto &[name, total] : seconds_)
      if (name == phase) {
        total += seconds;
        return;
      }
    seconds_.emplace_back(phase, seconds);
  }
  std::vector<std::pair<std::string, double>> seconds_;
};

} // namespace sluice
