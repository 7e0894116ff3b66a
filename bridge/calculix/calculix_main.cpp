// SPDX-License-Identifier: MIT
// sluice-calculix CASE.toml [--set TABLE.KEY=VALUE]... [--out DIR] [--restart FILE] [--check]
//                           [--print-box]
#include "bridge/calculix/box_deck.hpp"
#include "bridge/calculix/ccx.hpp"
#include "bridge/calculix/coupling.hpp"
#include "bridge/calculix/model.hpp"

#include <CLI/CLI.hpp>
#include <fmt/format.h>

namespace {

struct Options {
  std::string case_file, out = "out", restart;
  std::vector<std::string> overrides;
  bool check_only = false, print_box = false;
};

void print_check(const sluice::Config &config) {
  using namespace sluice::calculix;
  const auto params = config.read<CalculixParams>("solid");
  const Model model = read_model(config, params);
  const Ccx ccx(params.ccx, params.threads, "");
  fmt::print("solid: {} elements, {} interface nodes, {} faces; {}\n", model.deck.elements.size(),
             model.surface.mesh.n_nodes(), model.surface.mesh.n_faces(), ccx.program().string());
}

void print_box(const sluice::Config &config) {
  const auto params = config.read<sluice::calculix::CalculixParams>("solid");
  sluice::check(params.input.empty(), "solid.input = \"{}\" is the model; there is no box to print",
                params.input);
  fmt::print("{}", sluice::calculix::box_deck(params.box));
}

void run(const Options &options) {
  using namespace sluice;
  const Config config = Config::load(options.case_file, options.overrides);
  // The fluid knows its own sub-tables.
  config.allow_tables({"case", "parameters", "bridge", "fluid", "fluid.*", "solid"});
  if (options.print_box)
    return print_box(config);
  if (options.check_only)
    return print_check(config);
  std::filesystem::create_directories(options.out);
  calculix::run(config, options.out, options.restart);
}

} // namespace

int main(int argc, char **argv) {
  Options options;
  CLI::App app{"CalculiX as the solid participant of a case"};
  app.add_option("case", options.case_file, "case file (.toml)")->required();
  app.add_option("--set", options.overrides, "TABLE.KEY=VALUE overrides one value; repeatable")
      ->allow_extra_args(false);
  app.add_option("--out", options.out, "folder for all output")->capture_default_str();
  app.add_option("--restart", options.restart, "restart file that the run goes on from");
  app.add_flag("--check", options.check_only, "read everything, look for ccx, stop");
  app.add_flag("--print-box", options.print_box, "print the input file of the box, stop");
  CLI11_PARSE(app, argc, argv);
  try {
    run(options);
  } catch (const std::exception &error) {
    fmt::print(stderr, "sluice-calculix: {}\n", error.what());
    return 1;
  }
  return 0;
}
