// SPDX-License-Identifier: MIT
#include "bridge/base/progress.hpp"

#include <algorithm>
#include <cstdio>
#include <fmt/format.h>
#include <unistd.h>

namespace sluice {

namespace {

std::string duration(double seconds) {
  const int s = static_cast<int>(seconds + 0.5);
  return s < 3600 ? fmt::format("{}:{:02}", s / 60, s % 60)
                  : fmt::format("{}:{:02}:{:02}", s / 3600, s / 60 % 60, s % 60);
}

} // namespace

Progress::Progress(std::string title, double end)
    : title_(std::move(title)), end_(end), on_terminal_(isatty(STDERR_FILENO) != 0) {}

Progress::~Progress() {
  if (open_line_)
    fmt::print(stderr, "\n");
}

void Progress::update(double now, std::string_view note) {
  const double fraction = std::clamp(end_ > 0 ? now / end_ : 1.0, 0.0, 1.0);
  const double since = watch_.seconds() - last_drawn_s_;
  const bool is_last = fraction >= 1.0 && last_fraction_ < 1.0;
  const bool is_due =
      on_terminal_ ? since >= 0.1 : since >= 10.0 || fraction - last_fraction_ >= 0.05;
  if (is_due || is_last)
    draw(fraction, note);
}

void Progress::draw(double fraction, std::string_view note) {
  const double elapsed = watch_.seconds();
  const std::string left =
      fraction > 1e-6 ? duration(elapsed * (1 - fraction) / fraction) : std::string("?");
  if (on_terminal_) {
    constexpr int width = 30;
    const int filled = static_cast<int>(fraction * width);
    fmt::print(stderr, "\r{} [{}{}] {:3.0f} %  {} elapsed, {} left  {}\033[K", title_,
               std::string(filled, '='), std::string(width - filled, ' '), 100 * fraction,
               duration(elapsed), left, note);
    open_line_ = true;
  } else {
    fmt::print(stderr, "{} {:3.0f} %  {} elapsed, {} left  {}\n", title_, 100 * fraction,
               duration(elapsed), left, note);
  }
  std::fflush(stderr);
  last_drawn_s_ = elapsed;
  last_fraction_ = fraction;
}

} // namespace sluice
