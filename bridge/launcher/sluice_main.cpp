// SPDX-License-Identifier: MIT
// sluice: starts every participant of a case as a process of its own.
//
//   sluice run CASE.toml [--set TABLE.KEY=VALUE]... [--out DIR] [--threads N] [--restart DIR]
//   sluice check CASE.toml [--set TABLE.KEY=VALUE]...
//
// Exit status: 0 complete, 1 failed, 2 wrong usage, 128 + signal when it was told to stop.
#include "bridge/base/restart_files.hpp"
#include "bridge/launcher/participants.hpp"
#include "bridge/launcher/run_folder.hpp"
#include "bridge/launcher/summary.hpp"
#include "bridge/launcher/supervisor.hpp"

#include <CLI/CLI.hpp>

#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <sched.h>
#include <unistd.h>

namespace sluice::launcher {

namespace fs = std::filesystem;

namespace {

constexpr int exit_failed = 1;
constexpr int exit_usage = 2;

struct Options {
  std::string case_file;
  std::vector<std::string> overrides;
  std::string out;
  std::string programs;
  std::string restart; ///< folder of the run to go on from
  int threads = 0;     ///< 0: every core that this process may use
  double grace_s = Deadlines{}.grace_s;
};

// The reader may be gone (`sluice run ... | head`): neither the run nor its outcome depends on
// that.
template <class... Args>
void say(std::FILE *to, fmt::format_string<Args...> format, Args &&...args) {
  std::fputs(fmt::format(format, std::forward<Args>(args)...).c_str(), to);
}

int cores_available() {
  cpu_set_t set;
  return sched_getaffinity(0, sizeof set, &set) == 0 ? CPU_COUNT(&set) : 1;
}

void set_default(const char *name, const std::string &value) {
  setenv(name, value.c_str(), /*overwrite=*/0);
}

/// Returns the number of threads that each participant gets.
int prepare_environment(int threads) {
  if (threads > 0) {
    setenv("OMP_NUM_THREADS", std::to_string(threads).c_str(), 1);
    setenv("DEAL_II_NUM_THREADS", std::to_string(threads).c_str(), 1);
  }
  set_default("OMP_NUM_THREADS", std::to_string(cores_available()));
  // In a serial scheme one participant waits while the other computes: its threads must sleep soon.
  // Spins before a thread sleeps, 1 mm gate to 0.02 s on two cores, idle / one of them busy with
  // something else: 0: 5.7 / 6.0 s, 1000: 4.0 / 6.9 s, 3000: 3.7 / 8.4 s, 10000: 3.6 / 13.1 s.
  set_default("OMP_WAIT_POLICY", "passive");
  set_default("GOMP_SPINCOUNT", "3000");
  // As root, Open MPI refuses to start unless it is told twice.
  set_default("OMPI_ALLOW_RUN_AS_ROOT", "1");
  set_default("OMPI_ALLOW_RUN_AS_ROOT_CONFIRM", "1");
  return std::atoi(std::getenv("OMP_NUM_THREADS"));
}

std::vector<std::string> arguments_of(const Options &options) {
  std::vector<std::string> arguments{options.case_file};
  for (const std::string &text : options.overrides)
    arguments.insert(arguments.end(), {"--set", text});
  return arguments;
}

/// As the summary shows them: it may be passed on.
std::vector<std::string> without_secrets(std::vector<std::string> overrides) {
  for (std::string &text : overrides)
    if (text.substr(0, text.find('=')).find("token") != std::string::npos)
      text = text.substr(0, text.find('=')) + "=(not shown)";
  return overrides;
}

std::string now_utc() {
  const std::time_t now = std::time(nullptr);
  char text[32];
  std::strftime(text, sizeof text, "%Y-%m-%dT%H:%M:%SZ", std::gmtime(&now));
  return text;
}

std::string indented(const std::string &text) {
  std::string out = "    ";
  for (const char c : text)
    out += c == '\n' ? "\n    " : std::string(1, c);
  return out;
}

void print_failure(const Outcome &outcome) {
  say(stderr, "  {}: {}\n", outcome.participant, outcome.how_it_ended());
  if (!outcome.message.empty())
    say(stderr, "{}\n", indented(outcome.message));
  else if (!outcome.was_stopped)
    say(stderr, "    (no message)\n");
}

void report_failures(const RunOutcome &outcome, const Case &scene, const fs::path &folder) {
  if (outcome.signal != 0)
    say(stderr, "sluice: {} was stopped by signal {}\n", scene.name, outcome.signal);
  else
    say(stderr, "sluice: {} failed\n", scene.name);
  for (const Outcome &participant : outcome.participants)
    if (!participant.ok())
      print_failure(participant);
  say(stderr, "  output so far and the logs: {}\n", folder.string());
}

/// A folder of its own under the system's temporary one, gone at the end of the scope.
class TemporaryFolder {
public:
  TemporaryFolder() {
    std::string pattern = (fs::temp_directory_path() / "sluice-XXXXXX").string();
    check(mkdtemp(pattern.data()) != nullptr, "cannot make a temporary folder {}", pattern);
    path_ = pattern;
  }
  ~TemporaryFolder() {
    std::error_code ignored;
    fs::remove_all(path_, ignored);
  }
  TemporaryFolder(const TemporaryFolder &) = delete;
  TemporaryFolder &operator=(const TemporaryFolder &) = delete;
  const fs::path &path() const { return path_; }

private:
  fs::path path_;
};

void print_check(const Outcome &outcome) {
  if (outcome.ok())
    say(stdout, "{}: OK\n", outcome.participant);
  else
    print_failure(outcome);
}

/// What every participant says of the case, without computing anything.
RunOutcome ask_participants(const std::vector<Participant> &participants, const Options &options) {
  const TemporaryFolder logs;
  std::vector<Command> commands;
  for (const Participant &participant : participants) {
    auto arguments = arguments_of(options);
    arguments.emplace_back("--check");
    commands.push_back({participant.name, participant.program, std::move(arguments),
                        logs.path() / (participant.name + ".log"), Shown::no});
  }
  return run_together(commands, Deadlines{});
}

/// A case that one of them refuses is not started: its partner would wait for it in vain.
int report_refusal(const RunOutcome &outcome, const Case &scene) {
  if (outcome.signal != 0)
    return 128 + outcome.signal;
  say(stderr, "sluice: {} failed\n", scene.name);
  for (const Outcome &participant : outcome.participants)
    if (!participant.ok())
      print_failure(participant);
  return exit_failed;
}

/// What each participant goes on from; nothing for a run from the start.
std::map<std::string, fs::path> restart_files_of(const std::vector<Participant> &participants,
                                                 const Options &options, const fs::path &folder) {
  if (options.restart.empty())
    return {};
  check(participants.size() > 1, "--restart is for coupled runs; the fluid alone goes on "
                                 "from fluid.start_state");
  check(!fs::exists(folder) || !fs::exists(options.restart) ||
            !fs::equivalent(folder, options.restart),
        "{}: a run cannot go on in the folder of the run it starts from; choose another --out",
        folder.string());
  std::vector<std::string> names;
  for (const Participant &participant : participants)
    names.push_back(participant.name);
  return last_restart_files(fs::absolute(options.restart), names);
}

// [parameters] are read by the scripts of a case, which write what follows from them.
void refuse_parameters(const Options &options) {
  for (const std::string &text : options.overrides)
    check(!text.starts_with("parameters."),
          "--set {}: no solver reads [parameters]; use cases/run, which prepares the case from it, "
          "or the case's own prepare",
          text);
}

int run(const Options &options) {
  refuse_parameters(options);
  const Config config = Config::load(options.case_file, options.overrides);
  const Case scene = read_case(config);
  const auto participants = participants_of(config, options.programs);
  const fs::path folder =
      fs::absolute(options.out.empty() ? fs::path("out") / scene.name : fs::path(options.out));
  const int threads = prepare_environment(options.threads);
  if (const RunOutcome answers = ask_participants(participants, options); !answers.ok())
    return report_refusal(answers, scene);
  const auto restart_files = restart_files_of(participants, options, folder);
  const FolderLock lock = prepare_run_folder(folder, scene.name, options.case_file);

  RunDescription description{scene.name, fs::absolute(options.case_file).string(),
                             without_secrets(options.overrides), threads, now_utc()};
  std::vector<Command> commands;
  for (const Participant &participant : participants) {
    auto arguments = arguments_of(options);
    if (const auto file = restart_files.find(participant.name); file != restart_files.end())
      arguments.insert(arguments.end(), {"--restart", file->second.string()});
    arguments.insert(arguments.end(), {"--out", folder.string()});
    commands.push_back({participant.name, participant.program, std::move(arguments),
                        folder / (participant.name + ".log"),
                        commands.empty() ? Shown::yes : Shown::no});
  }
  Deadlines deadlines;
  deadlines.grace_s = options.grace_s;
  const RunOutcome outcome = run_together(commands, deadlines);

  if (!outcome.ok())
    report_failures(outcome, scene, folder); // first: what follows may fail too, on a full disk
  const bool completed = write_summary(folder, description, outcome);
  const fs::path collection = combine_collections(folder, scene.name);
  if (!outcome.ok())
    return outcome.signal != 0 ? 128 + outcome.signal : exit_failed;
  if (!completed) {
    say(stderr,
        "sluice: {} is not complete: a participant says so, or its summary is broken; see {}\n",
        scene.name, (folder / "summary.json").string());
    return exit_failed;
  }
  say(stdout, "{}: complete in {:.1f} s, {}\n", scene.name, outcome.wall_time_s,
      (collection.empty() ? folder / "summary.json" : collection).string());
  return 0;
}

int check_case(const Options &options) {
  refuse_parameters(options);
  const Config config = Config::load(options.case_file, options.overrides);
  read_case(config);
  const auto participants = participants_of(config, options.programs);
  prepare_environment(options.threads);
  const RunOutcome outcome = ask_participants(participants, options);
  for (const Outcome &participant : outcome.participants)
    print_check(participant);
  if (!outcome.ok())
    return outcome.signal != 0 ? 128 + outcome.signal : exit_failed;
  say(stdout, "{}: OK\n", options.case_file);
  return 0;
}

void add_common_options(CLI::App &command, Options &options) {
  command.add_option("CASE", options.case_file, "case file (.toml)")->required();
  command
      .add_option("--set", options.overrides, "TABLE.KEY=VALUE, overrides one key; may be repeated")
      ->expected(1)
      ->take_all();
  command
      .add_option("--threads", options.threads, "threads of each participant (default: every core)")
      ->check(CLI::Range(1, 4096));
  command.add_option("--programs", options.programs,
                     "folder of the participants' programs (default: beside this one)");
}

} // namespace

} // namespace sluice::launcher

int main(int argc, char **argv) {
  using namespace sluice::launcher;
  std::signal(SIGPIPE, SIG_IGN); // a write to a terminal that is gone fails, and that is all
  CLI::App app("Starts every participant of a Sluice case, each as a process of its own.",
               "sluice");
  app.require_subcommand(1);
  Options options;
  CLI::App *run_command = app.add_subcommand("run", "run a case");
  add_common_options(*run_command, options);
  run_command->add_option("--out", options.out, "folder for the output (default: out/<case>)");
  run_command->add_option("--restart", options.restart,
                          "folder of a run: go on from the last window of which it has restart "
                          "files (bridge.restart_every_windows, or one that got SIGTERM)");
  run_command
      ->add_option("--grace", options.grace_s,
                   "seconds that the others get to end by themselves when one has failed")
      ->check(CLI::NonNegativeNumber);
  CLI::App *check_command = app.add_subcommand("check", "check a case without computing anything");
  add_common_options(*check_command, options);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError &error) {
    return app.exit(error) == 0 ? 0 : exit_usage;
  }
  try {
    return *run_command ? run(options) : check_case(options);
  } catch (const std::exception &error) {
    say(stderr, "sluice: {}\n", error.what());
    return exit_failed;
  }
}
