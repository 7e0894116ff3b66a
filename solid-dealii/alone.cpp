// SPDX-License-Identifier: MIT
#include "solid-dealii/alone.hpp"

#include "bridge/base/progress.hpp"
#include "bridge/settings.hpp"
#include "bridge/window_clock.hpp"
#include "solid-dealii/history.hpp"
#include "solid-dealii/state_file.hpp"

#include <nlohmann/json.hpp>

#include <cmath>

namespace sluice::solid {
namespace {

// The water stands on the side of smaller x (a body clamped left or right: on its lower side).
Side wet_side(Side clamped) {
  return clamped == Side::left || clamped == Side::right ? Side::lower : Side::left;
}

template <int dim>
void print_tip(const char *what, const SolidSolver<dim> &s, const SolidState &x) {
  for (const auto &probe : s.params().probes) {
    const int node =
        s.discretisation().nearest_node(Eigen::Map<const Vec<dim>>(probe.position.data()));
    const Vec<dim> u = s.discretisation().at(x.displacement, node);
    if (s.ranks().is_root())
      fmt::print("{}: {} ux {:.5f} mm, uy {:.5f} mm\n", what, probe.name, 1e3 * u.x(), 1e3 * u.y());
  }
  if (!s.params().mesh.empty())
    return;
  const auto end = free_end(s.discretisation(), s.clamped_side());
  const Vec<dim> middle = end.middle(x.displacement), front = end.at(x.displacement, end.front),
                 back = end.at(x.displacement, end.back);
  if (s.ranks().is_root())
    fmt::print("{}: tip ux {:.4f} mm, uy {:.4f} mm (front {:.4f} {:.4f}, back {:.4f} {:.4f})\n",
               what, 1e3 * middle.x(), 1e3 * middle.y(), 1e3 * front.x(), 1e3 * front.y(),
               1e3 * back.x(), 1e3 * back.y());
}

template <int dim> double tip_x(const SolidSolver<dim> &s, const SolidState &x) {
  return s.params().mesh.empty()
             ? free_end(s.discretisation(), s.clamped_side()).middle(x.displacement).x()
             : s.ranks().max(x.displacement.cwiseAbs().maxCoeff());
}

template <int dim> bool has_own_load(const SolidSolver<dim> &s) {
  return s.ranks().max(s.own_load().cwiseAbs().maxCoeff()) > 0;
}

template <int dim> Eigen::VectorXd dead_load(const SolidSolver<dim> &s, const Hydrostatic &water) {
  if (has_own_load(s))
    return Eigen::VectorXd::Zero(s.discretisation().n_dofs());
  return pressure_forces(s.discretisation(), wet_side(s.clamped_side()), water,
                         s.initial_state().displacement);
}

template <int dim>
void run_static(SolidSolver<dim> &s, const Hydrostatic &water, const std::filesystem::path &folder,
                double output_interval) {
  if (has_own_load(s)) {
    const SolidState state = s.solve_static(dead_load(s, water));
    print_tip("own load", s, state);
    std::filesystem::create_directories(folder);
    History<dim> history(s, folder, output_interval, &state);
    return history.write_summary("", nlohmann::json::object());
  }
  print_tip("follower pressure", s, s.solve_static_follower(wet_side(s.clamped_side()), water));
  print_tip("dead pressure", s, s.solve_static(dead_load(s, water)));
}

template <int dim> void run_modes(SolidSolver<dim> &s) {
  for (const double f : s.frequencies(s.initial_state(), 5))
    fmt::print("{:.4f} Hz\n", f);
}

template <int dim>
void run_release(SolidSolver<dim> &s, const Hydrostatic &water,
                 const bridge::CaseSettings &settings, const std::filesystem::path &folder,
                 const std::filesystem::path &restart) {
  std::filesystem::create_directories(folder);
  const Eigen::VectorXd load = dead_load(s, water);
  bridge::WindowClock clock(settings);
  SolidState state = s.initial_state();
  if (restart.empty())
    state.acceleration = s.consistent_acceleration(state, load);
  else {
    const SavedState saved = read_state(restart, state, s.ranks());
    state = saved.state;
    clock.start_at(saved.time);
  }
  History<dim> history(s, folder, settings.output_interval, &state, clock.time());
  std::optional<Progress> progress;
  if (s.ranks().is_root())
    progress.emplace("solid", settings.end_time);
  double highest = 0;
  while (!clock.is_over()) {
    const SolidState start = state;
    state = s.advance(start, load, clock.window_length());
    clock.next_window();
    history.record(start, state, load, clock.time());
    if (progress)
      progress->update(clock.time(), history.note());
    highest = std::max(highest, tip_x(s, state));
  }
  history.write_summary("", nlohmann::json::object());
  const double n = std::max(1.0, static_cast<double>(s.counts().solves));
  print_tip("at the end", s, state);
  if (!s.ranks().is_root())
    return;
  fmt::print("largest ux {:.4f} mm; {:.0f} steps of {:.3f} ms, {:.3f} ms CPU, {:.2f} Newton "
             "iterations\n",
             1e3 * highest, n, 1e3 * s.counts().seconds / n, 1e3 * s.counts().cpu_seconds / n,
             static_cast<double>(s.counts().iterations) / n);
}

template <int dim>
void run_task(const std::string &task, const SolidParams &params, const Config &config,
              const Hydrostatic &water, const std::filesystem::path &folder,
              const std::filesystem::path &restart, const Ranks &ranks) {
  SolidSolver<dim> solver(params, ranks);
  const auto settings = config.read<bridge::CaseSettings>("case");
  check(task == "modes" || has_own_load(solver) || params.mesh.empty(),
        "{}: [solid] has a mesh, but neither gravity_m_s2 nor a boundary with traction_pa: nothing "
        "loads it without a partner",
        config.file_name());
  if (task == "static")
    run_static(solver, water, folder, settings.output_interval);
  else if (task == "modes")
    run_modes(solver);
  else
    run_release(solver, water, settings, folder, restart);
}

} // namespace

void run_alone(const std::string &task, const Config &config, const Hydrostatic &water,
               const std::filesystem::path &folder, const std::filesystem::path &restart,
               const Ranks &ranks) {
  check(task == "static" || task == "modes" || task == "release",
        "--alone {}: unknown task; give static, modes or release", task);
  const auto params = read_params(config);
  if (params.dimension == 2)
    run_task<2>(task, params, config, water, folder, restart, ranks);
  else
    run_task<3>(task, params, config, water, folder, restart, ranks);
}

} // namespace sluice::solid
