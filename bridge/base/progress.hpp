// SPDX-License-Identifier: MIT
// Progress of a run: a bar with the time left on a terminal, plain lines elsewhere.
#pragma once

#include "bridge/base/timer.hpp"

#include <string>
#include <string_view>

namespace sluice {

class Progress {
public:
  /// `title` is shown in front; `end` is the value at which the run is complete.
  Progress(std::string title, double end);
  ~Progress();
  Progress(const Progress &) = delete;
  Progress &operator=(const Progress &) = delete;

  /// Reports `now` of `end`; `note` is a short text such as "t = 0.012 s, 3 iterations".
  /// Cheap: redraws ten times a second on a terminal, prints a line at most every ten seconds
  /// or twentieth part of the run elsewhere.
  void update(double now, std::string_view note);

private:
  void draw(double fraction, std::string_view note);
  std::string title_;
  double end_;
  bool on_terminal_;
  bool open_line_ = false;
  Stopwatch watch_;
  double last_drawn_s_ = -1e9;
  double last_fraction_ = -1;
};

} // namespace sluice
