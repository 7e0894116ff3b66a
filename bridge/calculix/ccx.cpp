// SPDX-License-Identifier: MIT
#include "bridge/calculix/ccx.hpp"

#include "bridge/base/check.hpp"
#include "bridge/base/timer.hpp"

#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <fcntl.h>
#include <fstream>
#include <spawn.h>
#include <sstream>
#include <string_view>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>
#include <vector>

extern char **environ;

namespace sluice::calculix {

namespace fs = std::filesystem;

namespace {

bool is_program(const fs::path &file) {
  return fs::is_regular_file(file) && access(file.c_str(), X_OK) == 0;
}

fs::path find_program(const std::string &program) {
  constexpr const char *what_to_do =
      "install CalculiX (Debian: calculix-ccx), or set solid.ccx to its path";
  if (program.find('/') != std::string::npos) {
    check(is_program(program), "calculix: '{}' is not an executable file; {}", program, what_to_do);
    return fs::absolute(program);
  }
  const char *path = std::getenv("PATH");
  std::stringstream folders(path ? path : "");
  for (std::string folder; std::getline(folders, folder, ':');)
    if (is_program(fs::path(folder) / program))
      return fs::absolute(fs::path(folder) / program);
  fail("calculix: there is no program '{}' on PATH; {}", program, what_to_do);
}

/// This process's environment with the numbers of threads that ccx looks at.
class Environment {
public:
  explicit Environment(int threads) {
    for (char **entry = environ; *entry; ++entry)
      if (!is_about_threads(*entry))
        entries_.emplace_back(*entry);
    entries_.push_back("OMP_NUM_THREADS=" + std::to_string(threads));
    for (std::string &entry : entries_)
      pointers_.push_back(entry.data());
    pointers_.push_back(nullptr);
  }
  char *const *pointers() const { return pointers_.data(); }

private:
  static bool is_about_threads(std::string_view entry) {
    return entry.starts_with("OMP_NUM_THREADS=") || entry.starts_with("CCX_NPROC_") ||
           entry.starts_with("NUMBER_OF_CPUS=");
  }
  std::vector<std::string> entries_;
  std::vector<char *> pointers_;
};

struct Ended {
  int status = 0; ///< as waitpid gives it
  double cpu_seconds = 0;
};

Ended wait_for(pid_t pid) {
  Ended ended;
  rusage usage{};
  while (wait4(pid, &ended.status, 0, &usage) < 0)
    check(errno == EINTR, "calculix: ccx is gone, nobody knows how ({})", std::strerror(errno));
  const auto seconds = [](const timeval &t) {
    return static_cast<double>(t.tv_sec) + 1e-6 * static_cast<double>(t.tv_usec);
  };
  ended.cpu_seconds = seconds(usage.ru_utime) + seconds(usage.ru_stime);
  return ended;
}

Ended run_process(const fs::path &program, const std::string &job, const fs::path &folder,
                  int threads) {
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  posix_spawn_file_actions_addchdir_np(&actions, folder.c_str());
  posix_spawn_file_actions_addopen(&actions, STDIN_FILENO, "/dev/null", O_RDONLY, 0);
  posix_spawn_file_actions_addopen(&actions, STDOUT_FILENO, (job + ".log").c_str(),
                                   O_WRONLY | O_CREAT | O_TRUNC, 0644);
  posix_spawn_file_actions_adddup2(&actions, STDOUT_FILENO, STDERR_FILENO);
  std::string name = program.string(), input = job;
  char *arguments[] = {name.data(), input.data(), nullptr};
  pid_t pid = -1;
  const int error = posix_spawn(&pid, name.c_str(), &actions, nullptr, arguments,
                                Environment(threads).pointers());
  posix_spawn_file_actions_destroy(&actions);
  check(error == 0, "calculix: {} cannot be started in {} ({})", name, folder.string(),
        std::strerror(error));
  return wait_for(pid);
}

std::string text_of(const fs::path &file) {
  std::ifstream in(file, std::ios::binary);
  std::stringstream text;
  text << in.rdbuf();
  return text.str();
}

bool begins_an_error(std::string_view line) {
  return line.find("*ERROR") != line.npos || line.starts_with("At line ") || // of Fortran's runtime
         line.starts_with("Fortran runtime error");
}

// The first error with the lines that belong to it, as one line; "" when there is none.
std::string error_in(const std::string &log) {
  constexpr int most_lines = 4;
  std::stringstream lines(log);
  std::string message;
  int length = 0;
  for (std::string line; std::getline(lines, line) && length < most_lines;) {
    if (length == 0 && !begins_an_error(line))
      continue;
    const auto first = line.find_first_not_of(" \t");
    if (first == std::string::npos)
      break;
    if (length++ > 0)
      message += ' ';
    message.append(line, first);
  }
  return message;
}

// "" for a good run.
std::string what_failed(int status, const std::string &log, const fs::path &result) {
  const std::string error = error_in(log);
  const std::string said = error.empty() ? "" : ": " + error;
  if (WIFSIGNALED(status))
    return fmt::format("was ended by signal {} ({}){}", WTERMSIG(status),
                       strsignal(WTERMSIG(status)), said);
  if (WEXITSTATUS(status) != 0)
    return fmt::format("ended with status {}{}", WEXITSTATUS(status), said);
  if (!error.empty())
    return "reports" + said;
  if (log.find("Job finished") == std::string::npos)
    return "ended before its job was finished";
  return fs::exists(result) ? "" : "left no restart file";
}

} // namespace

Ccx::Ccx(const std::string &program, int threads, fs::path folder)
    : program_(find_program(program)), threads_(threads), folder_(std::move(folder)) {}

void Ccx::run(const std::string &job, const std::string &task) {
  const fs::path result = folder_ / (job + ".rout"), log = folder_ / (job + ".log");
  fs::remove(result); // one of an earlier run must not be taken for this one's
  const Stopwatch watch;
  const Ended ended = run_process(program_, job, folder_, threads_);
  ++cost_.runs;
  cost_.seconds += watch.seconds();
  cost_.cpu_seconds += ended.cpu_seconds;
  const std::string failure = what_failed(ended.status, text_of(log), result);
  if (failure.empty())
    return;
  const std::string message =
      fmt::format("calculix: ccx failed in {}: it {}. Its input and what it said: {}, {}", task,
                  failure, (folder_ / (job + ".inp")).string(), log.string());
  if (failure.find("diverge") != std::string::npos)
    throw Diverged(message);
  throw UserError(message);
}

} // namespace sluice::calculix
