// SPDX-License-Identifier: MIT
// Time is counted, not summed. A window of the case is 2^most_halvings ticks; a window that fails
// is halved and tried again, and after `windows_to_grow` accepted ones the length doubles when the
// tick count allows it. Beside the ticks only the part of the window that sub-steps have used is
// kept. The last window of the case is as long as the end time leaves it, never of length zero.
#pragma once

#include "bridge/settings.hpp"

#include <algorithm>
#include <cmath>

namespace sluice::bridge {

class WindowClock {
public:
  explicit WindowClock(const CaseSettings &settings, int most_halvings = 0, int windows_to_grow = 4)
      : end_(settings.end_time), length_(settings.time_step), n_windows_(settings.n_windows()),
        full_(1L << most_halvings), windows_to_grow_(windows_to_grow), span_(full_) {}

  long window() const {
    return accepted_ + 1;
  } ///< from 1, halved ones counted as they are accepted
  bool is_over() const { return tick_ >= n_windows_ * full_; }
  bool is_last() const { return tick_ + span_ >= n_windows_ * full_; }
  double start() const { return time_of(tick_); }                                     ///< [s]
  double time() const { return is_over() ? end_ : start() + elapsed_; }               ///< [s]
  double window_length() const { return length_of(tick_, span_); }                    ///< [s]
  double next_window_length() const { return length_of(tick_ + span_, next_span()); } ///< [s]
  double left() const { return is_over() ? 0 : window_length() - elapsed_; }          ///< [s]
  double elapsed() const { return elapsed_; }                                         ///< [s]
  bool can_halve() const { return span_ > 1; }
  double halved_length() const { return length_of(tick_, span_ / 2); } ///< [s]

  /// Moves on by a step of `dt` [s]; true when that ends the window (within rounding).
  bool step(double dt) {
    elapsed_ += dt;
    return left() <= 1e-9 * window_length();
  }
  void restart_window() { elapsed_ = 0; }
  void next_window() {
    const long next = next_span();
    since_halved_ = next == span_ ? since_halved_ + 1 : 0;
    tick_ += span_;
    span_ = next;
    ++accepted_;
    elapsed_ = 0;
  }
  /// The window starts anew at half its length.
  void halve() {
    span_ /= 2;
    since_halved_ = 0;
    elapsed_ = 0;
  }
  /// Between two windows.
  template <class Archive> void archive(Archive &a) { a(tick_, span_, accepted_, since_halved_); }

private:
  // A window of twice the length starts only where one of that length would stand.
  long next_span() const {
    const bool may_grow = span_ < full_ && since_halved_ + 1 >= windows_to_grow_ &&
                          (tick_ + span_) % (2 * span_) == 0;
    return may_grow ? 2 * span_ : span_;
  }
  // Of the case's window that starts at `tick` or contains it [s].
  double case_window_length(long tick) const {
    const double rest = end_ - static_cast<double>(n_windows_ - 1) * length_;
    const bool is_full =
        tick / full_ != n_windows_ - 1 || std::abs(rest - length_) <= 1e-6 * length_;
    return is_full ? length_ : rest;
  }
  double part_of_full(long ticks) const {
    return static_cast<double>(ticks) / static_cast<double>(full_);
  }
  double length_of(long tick, long span) const {
    return case_window_length(tick) * part_of_full(span);
  }
  double time_of(long tick) const {
    return static_cast<double>(tick / full_) * length_ +
           case_window_length(tick) * part_of_full(tick % full_);
  }

  double end_, length_;
  long n_windows_;
  long full_; // ticks of a window of the case
  int windows_to_grow_;
  long tick_ = 0, span_;
  long accepted_ = 0;
  long since_halved_ = 0; // windows accepted since the length last changed
  double elapsed_ = 0;
};

} // namespace sluice::bridge
