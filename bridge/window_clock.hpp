// SPDX-License-Identifier: MIT
// Time is counted, not summed: an integer window number and the part of the window that sub-steps
// have used. The last window is as long as the end time leaves it, never of length zero.
#pragma once

#include "bridge/settings.hpp"

#include <cmath>

namespace sluice::bridge {

class WindowClock {
public:
  explicit WindowClock(const CaseSettings &settings)
      : end_(settings.end_time), length_(settings.time_step), n_windows_(settings.n_windows()) {}

  long window() const { return window_; } ///< from 1; n_windows + 1 after the end
  bool is_over() const { return window_ > n_windows_; }
  bool is_last() const { return window_ == n_windows_; }
  double start() const { return static_cast<double>(window_ - 1) * length_; } ///< [s]
  double time() const { return is_over() ? end_ : start() + elapsed_; }       ///< [s]
  double window_length() const { return length_of(window_); }                 ///< [s]
  double next_window_length() const { return length_of(window_ + 1); }        ///< [s]
  double left() const { return is_over() ? 0 : window_length() - elapsed_; }  ///< [s]
  double elapsed() const { return elapsed_; }                                 ///< [s]

  /// Moves on by a step of `dt` [s]; true when that ends the window (within rounding).
  bool step(double dt) {
    elapsed_ += dt;
    return left() <= 1e-9 * length_;
  }
  void restart_window() { elapsed_ = 0; }
  void next_window() {
    ++window_;
    elapsed_ = 0;
  }

private:
  double length_of(long window) const {
    const double rest = end_ - static_cast<double>(n_windows_ - 1) * length_;
    const bool is_full = window != n_windows_ || std::abs(rest - length_) <= 1e-6 * length_;
    return is_full ? length_ : rest;
  }

  double end_, length_;
  long n_windows_;
  long window_ = 1;
  double elapsed_ = 0;
};

} // namespace sluice::bridge
