// SPDX-License-Identifier: MIT
// Time is counted, not summed. A window of the case is 2^most_halvings ticks; a window that fails
// is halved and tried again, and after `windows_to_grow` accepted ones the length doubles when the
// tick count allows it. Beside the ticks only the part of the window that sub-steps have used is
// kept. The last window of the case is as long as the end time leaves it, never of length zero.
// A run that goes on to a later end counts anew from where such a cut window has left it.
#pragma once

#include "bridge/settings.hpp"

#include <algorithm>
#include <cmath>

namespace sluice::bridge {

class WindowClock {
public:
  explicit WindowClock(const CaseSettings &settings, int most_halvings = 0, int windows_to_grow = 4)
      : settings_(settings), n_windows_(settings.n_windows()), full_(1L << most_halvings),
        windows_to_grow_(windows_to_grow), span_(full_) {}

  long window() const {
    return accepted_ + 1;
  } ///< from 1, halved ones counted as they are accepted
  bool is_over() const { return tick_ >= n_windows_ * full_; }
  bool is_last() const { return tick_ + span_ >= n_windows_ * full_; }
  double start() const { return time_of(tick_); }                                     ///< [s]
  double time() const { return is_over() ? end() : start() + elapsed_; }              ///< [s]
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
  /// Before the first window: it starts at `time` [s], at which another run has ended.
  void start_at(double time) {
    const double windows = std::round(time / settings_.time_step);
    if (std::abs(time - windows * settings_.time_step) <= 1e-9 * settings_.time_step) {
      tick_ = full_ * static_cast<long>(windows);
      return;
    }
    origin_ = time;
    n_windows_ = settings_.n_windows(origin_);
  }
  /// Between two windows.
  template <class Archive> void archive(Archive &a) {
    const double end_now = end();
    a(origin_, settings_.end_time, tick_, span_, accepted_, since_halved_);
    go_on_to(end_now);
  }

private:
  double end() const { return settings_.end_time; }
  // The ticks that are over keep their time: those of a window that the earlier end has cut become
  // the origin.
  void go_on_to(double new_end) {
    n_windows_ = settings_.n_windows(origin_);
    const double now = start();
    settings_.end_time = new_end;
    n_windows_ = settings_.n_windows(origin_);
    if (start() == now)
      return;
    origin_ = now;
    tick_ = 0;
    n_windows_ = settings_.n_windows(origin_);
  }
  // A window of twice the length starts only where one of that length would stand.
  long next_span() const {
    const bool may_grow = span_ < full_ && since_halved_ + 1 >= windows_to_grow_ &&
                          (tick_ + span_) % (2 * span_) == 0;
    return may_grow ? 2 * span_ : span_;
  }
  // Of the last window of the case [s]; a full one where the two differ by rounding.
  double last_length() const {
    const double length = settings_.time_step;
    const double rest = end() - origin_ - static_cast<double>(n_windows_ - 1) * length;
    return std::abs(rest - length) <= 1e-6 * length ? length : rest;
  }
  // Of the case's window that starts at `tick` or contains it [s].
  double case_window_length(long tick) const {
    return tick / full_ == n_windows_ - 1 ? last_length() : settings_.time_step;
  }
  double part_of_full(long ticks) const {
    return static_cast<double>(ticks) / static_cast<double>(full_);
  }
  double length_of(long tick, long span) const {
    return case_window_length(tick) * part_of_full(span);
  }
  double time_of(long tick) const {
    if (tick >= n_windows_ * full_ && last_length() != settings_.time_step)
      return end();
    return origin_ + static_cast<double>(tick / full_) * settings_.time_step +
           case_window_length(tick) * part_of_full(tick % full_);
  }

  CaseSettings settings_;
  double origin_ = 0; // [s], of tick 0
  long n_windows_;    // from there to the end
  long full_;         // ticks of a window of the case
  int windows_to_grow_;
  long tick_ = 0, span_;
  long accepted_ = 0;
  long since_halved_ = 0; // windows accepted since the length last changed
  double elapsed_ = 0;
};

} // namespace sluice::bridge
