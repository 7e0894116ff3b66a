// SPDX-License-Identifier: MIT
#include "bridge/launcher/supervisor.hpp"

#include "bridge/base/check.hpp"
#include "bridge/base/timer.hpp"

#include <algorithm>
#include <array>
#include <cerrno>
#include <csignal>
#include <cstring>
#include <fcntl.h>
#include <memory>
#include <optional>
#include <poll.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/signalfd.h>
#include <sys/wait.h>
#include <unistd.h>

namespace sluice::launcher {

std::string Outcome::how_it_ended() const {
  const std::string by_us = was_stopped ? ", stopped by sluice" : "";
  if (signal != 0)
    return fmt::format("ended by signal {} ({}){}", signal, strsignal(signal), by_us);
  return fmt::format("exit status {}{}", exit_status, by_us);
}

bool RunOutcome::ok() const {
  return signal == 0 && std::all_of(participants.begin(), participants.end(),
                                    [](const Outcome &o) { return o.ok(); });
}

namespace {

/// The signals that the supervisor waits for, as a file to poll. Blocked for its lifetime.
class SignalQueue {
public:
  SignalQueue() {
    std::signal(SIGCHLD, SIG_DFL); // inherited as ignored, no child would ever be reported
    sigset_t set{};
    sigemptyset(&set);
    for (const int s : {SIGINT, SIGTERM, SIGHUP, SIGCHLD})
      sigaddset(&set, s);
    sigprocmask(SIG_BLOCK, &set, &before_);
    fd_ = signalfd(-1, &set, SFD_CLOEXEC | SFD_NONBLOCK);
    check(fd_ >= 0, "cannot wait for signals ({})", std::strerror(errno));
  }
  ~SignalQueue() {
    ::close(fd_);
    sigprocmask(SIG_SETMASK, &before_, nullptr);
  }
  SignalQueue(const SignalQueue &) = delete;
  SignalQueue &operator=(const SignalQueue &) = delete;

  int fd() const { return fd_; }
  const sigset_t &mask_before() const { return before_; }
  /// The next signal, or nothing.
  std::optional<int> next() const {
    signalfd_siginfo info{};
    if (::read(fd_, &info, sizeof info) != sizeof info)
      return std::nullopt;
    return static_cast<int>(info.ssi_signo);
  }

private:
  sigset_t before_{};
  int fd_ = -1;
};

struct Child {
  Child(const Command &c) : command(c), relay(c.log, c.shown) {}
  const Command &command;
  LogRelay relay;
  pid_t pid = -1; ///< also its process group
  bool was_stopped = false;
};

[[noreturn]] void become(const Command &command, const LogRelay &relay, const sigset_t &mask,
                         pid_t parent) {
  setpgid(0, 0);
  prctl(PR_SET_PDEATHSIG, SIGTERM);
  if (getppid() != parent)
    _exit(128 + SIGTERM);
  const int nothing = ::open("/dev/null", O_RDONLY | O_CLOEXEC);
  dup2(nothing, STDIN_FILENO);
  dup2(relay.log(), STDOUT_FILENO);
  dup2(relay.write_end(), STDERR_FILENO);
  std::signal(SIGPIPE, SIG_DFL); // ignored by us, see main
  sigprocmask(SIG_SETMASK, &mask, nullptr);
  std::vector<char *> argv{const_cast<char *>(command.program.c_str())};
  for (const std::string &argument : command.arguments)
    argv.push_back(const_cast<char *>(argument.c_str()));
  argv.push_back(nullptr);
  execv(command.program.c_str(), argv.data());
  fmt::print(stderr, "{}: cannot be started: {}\n", command.program.filename().string(),
             std::strerror(errno));
  std::fflush(stderr);
  _exit(127);
}

/// The children of one run and the clock that ends them.
class Supervisor {
public:
  explicit Supervisor(const Deadlines &deadlines) : deadlines_(deadlines) {}
  ~Supervisor() { end_group_of_all(SIGKILL); }
  Supervisor(const Supervisor &) = delete;
  Supervisor &operator=(const Supervisor &) = delete;

  void start(const Command &command) {
    auto child = std::make_unique<Child>(command);
    const pid_t self = getpid();
    child->pid = fork();
    check(child->pid >= 0, "{}: cannot be started ({})", command.program.string(),
          std::strerror(errno));
    if (child->pid == 0)
      become(command, child->relay, signals_.mask_before(), self);
    setpgid(child->pid, child->pid); // the child does it too: whoever comes first
    child->relay.close_write_end();
    running_.push_back(std::move(child));
  }

  RunOutcome watch() {
    while (!running_.empty()) {
      wait_for_news();
      for (auto &child : running_)
        child->relay.pump();
      handle_signals();
      enforce_deadline();
    }
    outcome_.wall_time_s = watch_.seconds();
    return std::move(outcome_);
  }

private:
  void wait_for_news() {
    std::vector<pollfd> files{{signals_.fd(), POLLIN, 0}};
    for (const auto &child : running_)
      if (child->relay.read_end() >= 0)
        files.push_back({child->relay.read_end(), POLLIN, 0});
    int timeout_ms = -1;
    if (stop_at_s_) // a long wait is cut into hours: poll counts in an int
      timeout_ms = static_cast<int>(
          std::clamp(1000 * (*stop_at_s_ - watch_.seconds()) + 1, 0.0, 3'600'000.0));
    poll(files.data(), files.size(), timeout_ms);
  }

  void handle_signals() {
    while (const auto signal = signals_.next())
      if (*signal == SIGCHLD)
        reap();
      else
        stop_by_signal(*signal);
  }

  void reap() {
    int status = 0;
    rusage usage{};
    pid_t pid = 0;
    while ((pid = wait4(-1, &status, WNOHANG, &usage)) > 0) {
      const auto child = std::find_if(running_.begin(), running_.end(),
                                      [&](const auto &c) { return c->pid == pid; });
      if (child == running_.end())
        continue;
      record(**child, status, usage);
      running_.erase(child);
    }
    check(pid == 0 || running_.empty(), "its participants are gone, nobody knows how ({})",
          std::strerror(errno));
  }

  void record(Child &child, int status, const rusage &usage) {
    child.relay.pump();
    kill(-child.pid, SIGKILL); // what the participant may have left behind
    const auto seconds = [](const timeval &t) {
      return static_cast<double>(t.tv_sec) + 1e-6 * static_cast<double>(t.tv_usec);
    };
    Outcome outcome;
    outcome.participant = child.command.participant;
    outcome.signal = WIFSIGNALED(status) ? WTERMSIG(status) : 0;
    outcome.exit_status = outcome.signal != 0 ? 128 + outcome.signal : WEXITSTATUS(status);
    outcome.was_stopped = child.was_stopped;
    outcome.cpu_time_s = seconds(usage.ru_utime) + seconds(usage.ru_stime);
    outcome.peak_memory_mb = static_cast<double>(usage.ru_maxrss) / 1024;
    outcome.message = child.relay.last_message(child.command.program.filename().string());
    if (!outcome.ok() && !stop_at_s_)
      stop_at_s_ = watch_.seconds() + deadlines_.grace_s;
    outcome_.participants.push_back(std::move(outcome));
  }

  // Whoever ends a job may tell this process, its group and its session one after the other: a
  // SIGTERM after the first says nothing new. A second Ctrl-C is a user's who will not wait.
  void stop_by_signal(int signal) {
    const bool is_repeated = outcome_.signal != 0;
    if (is_repeated && signal == SIGTERM)
      return;
    outcome_.signal = signal;
    stop_all(is_repeated ? SIGKILL : signal);
    if (signal == SIGTERM) // they may end their window and write what a restart needs
      stop_at_s_ = watch_.seconds() + std::max(deadlines_.kill_s, deadlines_.grace_s);
  }

  void enforce_deadline() {
    if (stop_at_s_ && watch_.seconds() >= *stop_at_s_)
      stop_all(has_been_told_ ? SIGKILL : SIGTERM);
  }

  void stop_all(int signal) {
    for (auto &child : running_)
      child->was_stopped = true;
    end_group_of_all(signal);
    has_been_told_ = true;
    stop_at_s_ = watch_.seconds() + deadlines_.kill_s;
  }

  void end_group_of_all(int signal) {
    for (const auto &child : running_)
      kill(-child->pid, signal);
  }

  Deadlines deadlines_;
  SignalQueue signals_;
  Stopwatch watch_;
  std::vector<std::unique_ptr<Child>> running_;
  std::optional<double> stop_at_s_;
  bool has_been_told_ = false;
  RunOutcome outcome_;
};

} // namespace

RunOutcome run_together(std::span<const Command> commands, const Deadlines &deadlines) {
  Supervisor supervisor(deadlines);
  for (const Command &command : commands)
    supervisor.start(command);
  return supervisor.watch();
}

} // namespace sluice::launcher
