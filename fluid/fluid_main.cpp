// SPDX-License-Identifier: MIT
// sluice-fluid CASE.toml [--set TABLE.KEY=VALUE]... [--out DIR] [--check] [--restart FILE]
#include "fluid/coupling.hpp"
#include "fluid/parallel.hpp"

#include <CLI/CLI.hpp>
#include <cstdlib>
#include <filesystem>
#include <fmt/format.h>
#include <unistd.h>

namespace {

// While a partner computes, threads that wait must sleep: OpenMP's spin for milliseconds and take
// the partner's cores, unless the environment says otherwise when the program is loaded. So it is
// set as the launcher does, and the program begins anew.
void wait_without_spinning(const sluice::Config &config, char **arguments) {
  if (!config.has_table("bridge") || std::getenv("OMP_WAIT_POLICY") != nullptr ||
      std::getenv("GOMP_SPINCOUNT") != nullptr)
    return;
  setenv("OMP_WAIT_POLICY", "passive", 0);
  setenv("GOMP_SPINCOUNT", "3000", 0);
  std::error_code error;
  const auto program = std::filesystem::read_symlink("/proc/self/exe", error);
  if (!error)
    execv(program.c_str(), arguments); // comes back only where it fails; then threads spin
}

struct Options {
  std::string case_file, out = "out", restart;
  std::vector<std::string> overrides;
  int threads = 0;
  bool check_only = false;
};

void run(const Options &options, char **arguments) {
  using namespace sluice;
  const Config config = Config::load(options.case_file, options.overrides);
  wait_without_spinning(config, arguments);
  config.allow_tables({"case", "parameters", "bridge", "fluid", "fluid.rheology", "fluid.wall",
                       "fluid.gauge", "fluid.probe", "solid", "solid.boundary", "solid.probe"});
  if (options.threads > 0)
    fluid::set_number_of_threads(options.threads);
  if (options.check_only) {
    fmt::print("fluid: {}\n", fluid::describe(config));
    return;
  }
  std::filesystem::create_directories(options.out);
  fluid::run(config, options.out, options.restart);
}

} // namespace

int main(int argc, char **argv) {
  Options options;
  CLI::App app{"Meshless free-surface flow: the fluid participant of a case"};
  app.add_option("case", options.case_file, "case file (.toml)")->required();
  app.add_option("--set", options.overrides, "TABLE.KEY=VALUE overrides one value; repeatable")
      ->allow_extra_args(false);
  app.add_option("--out", options.out, "folder for all output")->capture_default_str();
  app.add_option("--restart", options.restart, "restart file that a coupled run goes on from");
  app.add_option("--threads", options.threads, "threads; default: OMP_NUM_THREADS or all cores");
  app.add_flag("--check", options.check_only, "read everything, build the scene, stop");
  CLI11_PARSE(app, argc, argv);
  try {
    run(options, argv);
  } catch (const std::exception &error) {
    fmt::print(stderr, "sluice-fluid: {}\n", error.what());
    return 1;
  }
  return 0;
}
