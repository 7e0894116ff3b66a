// SPDX-License-Identifier: MIT
#include "solid-dealii/coupling.hpp"

#include "bridge/base/progress.hpp"
#include "bridge/base/restart_files.hpp"
#include "bridge/base/stop_signal.hpp"
#include "bridge/run_summary.hpp"
#include "bridge/settings.hpp"
#include "solid-dealii/history.hpp"
#include "solid-dealii/interface_of_ranks.hpp"
#include "solid-dealii/partner.hpp"
#include "solid-dealii/state_file.hpp"

#include <nlohmann/json.hpp>

namespace sluice::solid {
namespace {

template <int dim> Interface<dim> interface_of(const SolidSolver<dim> &solver) {
  const auto &wetted = solver.supports().wetted;
  if constexpr (dim == 3)
    if (solver.params().interface == "plane")
      return plane_interface(solver.discretisation(), wetted);
  return wetted_interface(solver.discretisation(), wetted);
}

/// One coupled run.
template <int dim> class Run {
public:
  Run(const SolidParams &params, const bridge::CaseSettings &settings, std::filesystem::path folder,
      const Ranks &ranks)
      : ranks_(ranks), solver_(params, ranks), folder_(std::move(folder)),
        output_interval_(settings.output_interval),
        surface_(interface_of(solver_), solver_.discretisation()), state_(solver_.initial_state()),
        forces_(surface_.mesh().positions.size()) {
    if (ranks.is_root())
      progress_.emplace("solid", settings.end_time);
  }

  /// Goes on from the end of a window of another run.
  void restore(Partner bridge, const std::filesystem::path &file) {
    check_is_elsewhere(file, folder_);
    SavedState saved = read_state(file, state_, ranks_);
    check(!bridge.speaks() || !saved.bridge.empty(), "{}: not the restart file of a coupled run",
          file.string());
    bridge.restore(saved.bridge);
    state_ = std::move(saved.state);
    start_time_ = saved.time;
  }

  void coupled(Partner bridge) {
    bridge.set_mesh(surface_.mesh());
    bridge.initialize();
    // Only now: a partner that never comes must not cost the series of an earlier run.
    if (bridge.speaks())
      remove_restart_files(folder_, "solid");
    history_.emplace(solver_, folder_, output_interval_, &state_, start_time_);
    const StopSignal stop_signal;
    while (bridge.is_coupling_ongoing()) {
      if (bridge.iteration() == 1) {
        start_ = state_;
        guess_.reset();
      }
      const double dt = bridge.max_time_step_size();
      read_forces(bridge, dt);
      advance_solid(bridge, dt);
      if (stop_signal.has_come())
        bridge.request_stop();
      bridge.advance(dt);
      if (bridge.requires_reading_checkpoint()) {
        guess_ = state_; // the next iterate is near: only its Newton iterations are saved
        state_ = start_;
      } else if (bridge.is_time_window_complete()) {
        finish_window(bridge);
        if (bridge.requires_writing_restart()) {
          write_restart(bridge);
          solver_.start_anew();
        }
      }
    }
    bridge.finalize();
    check(!bridge.is_stopped(),
          "stopped at t = {:.6g} s, as it was told to; sluice run --restart {} goes on from there",
          bridge.time(), folder_.string());
  }

  /// Nothing before the partner was met.
  void write_summary(std::string_view message, const bridge::Participant &bridge) const {
    if (history_)
      history_->write_summary(message, bridge::summary_of(bridge.statistics()));
  }

private:
  void write_restart(const Partner &bridge) const {
    const auto file = restart_file(folder_, "solid", bridge.time_window() - 1);
    write_state(file, {state_, bridge.time(), bridge.saved_state()}, ranks_);
    if (bridge.speaks())
      remove_older_restart_files(folder_, "solid");
  }

  void read_forces(const Partner &bridge, double relative_time) {
    bridge.read_data("force", relative_time, forces_);
    load_ = surface_.scatter(forces_);
  }

  // A window without a solution is the bridge's to cut; where it may not, it ends both programs
  // with the reason.
  void advance_solid(Partner &bridge, double dt) {
    try {
      state_ = solver_.advance(start_, load_, dt, guess_ ? &*guess_ : nullptr);
      write_motion(bridge);
    } catch (const NoSolution &failure) {
      bridge.report_failure(failure.what());
    }
  }

  void write_motion(Partner &bridge) const {
    bridge.write_data("displacement", surface_.gather(state_.displacement));
    bridge.write_data("velocity", surface_.gather(state_.velocity));
  }

  // Sums from the solver's own load vector, about the accepted configuration.
  void finish_window(Partner &bridge) {
    bridge.report_totals(bridge::interface_totals(
        surface_.mesh().dim, surface_.mesh().positions, surface_.gather_forces(load_),
        surface_.gather(start_.displacement), surface_.gather(state_.displacement)));
    const double time = bridge.time();
    history_->record(start_, state_, load_, time);
    if (progress_)
      progress_->update(time, history_->note());
  }

  Ranks ranks_;
  SolidSolver<dim> solver_;
  std::filesystem::path folder_;
  double output_interval_; // [s]
  InterfaceOfRanks<dim> surface_;
  std::optional<History<dim>> history_;
  std::optional<Progress> progress_; // on the root
  double start_time_ = 0;            // [s]
  SolidState state_, start_;         // now, and at the start of the window
  std::optional<SolidState> guess_;  // the last iterate of the same window
  std::vector<double> forces_;
  Eigen::VectorXd load_;
};

template <int dim>
void run_in(bridge::Participant *bridge, const SolidParams &params, const Config &config,
            const std::filesystem::path &folder, const std::filesystem::path &restart,
            const Ranks &ranks) {
  Run<dim> run(params, config.read<bridge::CaseSettings>("case"), folder, ranks);
  if (!restart.empty())
    run.restore({bridge, ranks}, restart);
  if (!bridge)
    return run.coupled({nullptr, ranks});
  try {
    run_coupled(*bridge, [&] { run.coupled({bridge, ranks}); });
  } catch (const std::exception &error) {
    run.write_summary(error.what(), *bridge);
    throw;
  }
  run.write_summary("", *bridge);
}

} // namespace

void run(bridge::Participant *bridge, const Config &config, const std::filesystem::path &folder,
         const std::filesystem::path &restart, const Ranks &ranks) {
  const auto params = read_params(config);
  if (params.dimension == 2)
    run_in<2>(bridge, params, config, folder, restart, ranks);
  else
    run_in<3>(bridge, params, config, folder, restart, ranks);
}

void run(const Config &config, const std::filesystem::path &folder,
         const std::filesystem::path &restart, const Ranks &ranks) {
  std::optional<bridge::Participant> bridge;
  if (ranks.is_root())
    bridge.emplace("solid", config, folder);
  run(bridge ? &*bridge : nullptr, config, folder, restart, ranks);
}

} // namespace sluice::solid
