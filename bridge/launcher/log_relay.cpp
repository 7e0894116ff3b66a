// SPDX-License-Identifier: MIT
#include "bridge/launcher/log_relay.hpp"

#include "bridge/base/check.hpp"

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <fcntl.h>
#include <pty.h>
#include <string_view>
#include <termios.h>
#include <unistd.h>

namespace sluice::launcher {

namespace {

constexpr std::size_t lines_remembered = 12;

void write_all(int fd, std::string_view bytes) {
  while (!bytes.empty()) {
    const ssize_t n = ::write(fd, bytes.data(), bytes.size());
    if (n < 0 && errno == EINTR)
      continue;
    if (n <= 0)
      return; // a closed terminal or a full disk must not end the run's supervision
    bytes.remove_prefix(static_cast<std::size_t>(n));
  }
}

std::string without_escapes(const std::string &text) {
  std::string plain;
  for (std::size_t k = 0; k < text.size(); ++k)
    if (text[k] == '\033' && k + 1 < text.size() && text[k + 1] == '[')
      while (k + 1 < text.size() && !std::isalpha(static_cast<unsigned char>(text[k])))
        ++k;
    else
      plain += text[k];
  return plain;
}

} // namespace

LogRelay::LogRelay(const std::filesystem::path &log, Shown shown) : shown_(shown) {
  log_ = ::open(log.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_APPEND | O_CLOEXEC, 0644);
  check(log_ >= 0, "{}: cannot be written ({}); give another --out folder", log.string(),
        std::strerror(errno));
  open_channel();
  fcntl(read_end_, F_SETFL, O_NONBLOCK);
}

LogRelay::~LogRelay() {
  for (const int fd : {read_end_, write_end_, log_})
    if (fd >= 0)
      ::close(fd);
}

void LogRelay::open_channel() {
  if (shown_ == Shown::yes && isatty(STDERR_FILENO) != 0) {
    termios raw{};
    cfmakeraw(&raw); // no translation of line ends
    winsize size{};
    check(openpty(&read_end_, &write_end_, nullptr, &raw, &size) == 0,
          "no pseudo-terminal for the progress bar ({})", std::strerror(errno));
    fcntl(read_end_, F_SETFD, FD_CLOEXEC);
    fcntl(write_end_, F_SETFD, FD_CLOEXEC);
  } else {
    std::array<int, 2> ends{};
    check(pipe2(ends.data(), O_CLOEXEC) == 0, "no pipe for a log ({})", std::strerror(errno));
    read_end_ = ends[0];
    write_end_ = ends[1];
  }
}

void LogRelay::close_write_end() {
  ::close(write_end_);
  write_end_ = -1;
}

void LogRelay::pump() {
  std::array<char, 4096> buffer{};
  while (read_end_ >= 0) {
    const ssize_t n = ::read(read_end_, buffer.data(), buffer.size());
    if (n > 0) {
      const std::string_view bytes(buffer.data(), static_cast<std::size_t>(n));
      if (shown_ == Shown::yes)
        write_all(STDERR_FILENO, bytes);
      for (const char c : bytes)
        take(c);
      continue;
    }
    if (n < 0 && errno == EINTR)
      continue;
    if (n < 0 && (errno == EAGAIN || errno == EWOULDBLOCK))
      return;
    finish_line(); // end of file; a pseudo-terminal without writers says EIO
    ::close(read_end_);
    read_end_ = -1;
  }
}

void LogRelay::take(char c) {
  if (c == '\n')
    return finish_line();
  if (c == '\r') {
    restart_line_ = true;
    return;
  }
  if (restart_line_)
    line_.clear();
  restart_line_ = false;
  line_ += c;
}

void LogRelay::finish_line() {
  const std::string plain = without_escapes(line_);
  line_.clear();
  restart_line_ = false;
  if (plain.empty())
    return;
  write_all(log_, plain + "\n");
  recent_.push_back(plain);
  if (recent_.size() > lines_remembered)
    recent_.pop_front();
}

std::string LogRelay::last_message(const std::string &program) const {
  if (recent_.empty())
    return "";
  const auto is_ours = [&](const std::string &line) { return line.starts_with(program + ":"); };
  const auto ours = std::find_if(recent_.rbegin(), recent_.rend(), is_ours);
  if (ours == recent_.rend())
    return recent_.back();
  std::string message = *ours;
  for (auto line = ours.base(); line != recent_.end(); ++line)
    message += "\n" + *line;
  return message;
}

} // namespace sluice::launcher
