// SPDX-License-Identifier: MIT
// A program of a test in a process of its own, which may be killed or stopped.
#pragma once

#include <csignal>
#include <functional>
#include <sys/wait.h>
#include <unistd.h>

namespace sluice::bridge {

/// Runs `program` in another process, which is gone when this object is.
class Child {
public:
  explicit Child(const std::function<void()> &program) : pid_(::fork()) {
    if (pid_ != 0)
      return;
    try {
      program();
    } catch (...) {
      ::_exit(1);
    }
    ::_exit(0);
  }
  ~Child() {
    if (pid_ <= 0)
      return;
    ::kill(pid_, SIGKILL);
    ::waitpid(pid_, nullptr, 0);
  }
  Child(const Child &) = delete;
  Child &operator=(const Child &) = delete;

  /// Waits for its end; the exit status (0: `program` returned, 1: it threw), or 128 and the number
  /// of the signal that ended it, as a shell says it.
  int exit_status() {
    int status = 0;
    ::waitpid(pid_, &status, 0);
    pid_ = 0;
    return WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
  }

private:
  pid_t pid_;
};

} // namespace sluice::bridge
