// SPDX-License-Identifier: MIT
// [mpirun -n N] sluice-solid CASE.toml [--set TABLE.KEY=VALUE]... [--out DIR] [--check]
//                                      [--alone TASK]
#include "solid-dealii/alone.hpp"
#include "solid-dealii/coupling.hpp"
#include "solid-dealii/solid_solver.hpp"

#include <CLI/CLI.hpp>
#include <fmt/format.h>

namespace {

struct Options {
  std::string case_file, out = "out", task, restart;
  std::vector<std::string> overrides;
  sluice::solid::Hydrostatic water{1000, 9.81, 0.14};
  bool check_only = false;
};

template <int dim>
void print_check(const sluice::solid::SolidParams &params, const sluice::solid::Ranks &ranks) {
  const sluice::solid::SolidSolver<dim> solver(params, ranks);
  const auto elements = solver.discretisation().n_cells_of_all(),
             unknowns = solver.assembly().n_free_of_all();
  if (ranks.is_root())
    fmt::print("solid: {} {} elements, {} unknowns\n", elements, params.used_element(), unknowns);
}

void run(const Options &options, const sluice::solid::Ranks &ranks) {
  using namespace sluice;
  const Config config = Config::load(options.case_file, options.overrides);
  config.allow_tables({"case", "parameters", "bridge", "fluid", "fluid.rheology", "fluid.wall",
                       "fluid.gauge", "fluid.probe", "solid", "solid.boundary", "solid.probe"});
  if (options.check_only) {
    const auto params = solid::read_params(config);
    return params.dimension == 2 ? print_check<2>(params, ranks) : print_check<3>(params, ranks);
  }
  if (!options.task.empty())
    return solid::run_alone(options.task, config, options.water, options.out, options.restart,
                            ranks);
  std::filesystem::create_directories(options.out);
  solid::run(config, options.out, options.restart, ranks);
}

} // namespace

int main(int argc, char **argv) {
  Options options;
  CLI::App app{"Finite-strain elasticity: the solid participant of a case"};
  app.add_option("case", options.case_file, "case file (.toml)")->required();
  app.add_option("--set", options.overrides, "TABLE.KEY=VALUE overrides one value; repeatable")
      ->allow_extra_args(false);
  app.add_option("--out", options.out, "folder for all output")->capture_default_str();
  app.add_flag("--check", options.check_only, "read everything, build the mesh, stop");
  app.add_option("--alone", options.task,
                 "without a partner, under its own load or still water: static, modes or release");
  app.add_option(
      "--restart", options.restart,
      "go on from this restart file of a coupled run; with --alone release: from a solid_state.h5");
  app.add_option("--water-level", options.water.level, "[m] of that water")->capture_default_str();
  CLI11_PARSE(app, argc, argv);
  const auto ranks = sluice::solid::Ranks::of_launch();
  try {
    run(options, ranks);
  } catch (const std::exception &error) {
    fmt::print(stderr, "sluice-solid: {}\n", error.what());
    ranks.abort();
    return 1;
  }
  return 0;
}
