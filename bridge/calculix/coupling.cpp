// SPDX-License-Identifier: MIT
#include "bridge/calculix/coupling.hpp"

#include "bridge/base/progress.hpp"
#include "bridge/base/restart_files.hpp"
#include "bridge/base/stop_signal.hpp"
#include "bridge/calculix/history.hpp"
#include "bridge/calculix/model.hpp"
#include "bridge/calculix/state_file.hpp"
#include "bridge/calculix/windows.hpp"
#include "bridge/participant.hpp"
#include "bridge/run_summary.hpp"

#include <nlohmann/json.hpp>

namespace sluice::calculix {
namespace {

/// One coupled run.
class Run {
public:
  Run(Model model, const CalculixParams &params, const bridge::CaseSettings &settings,
      std::filesystem::path folder)
      : model_(std::move(model)), folder_(std::move(folder)),
        output_interval_(settings.output_interval),
        windows_(model_.deck, params.ccx, params.threads, folder_ / "calculix"),
        progress_("solid", settings.end_time), forces_(surface().mesh.positions.size()) {
    const NodeField rest = NodeField::Zero(3, model_.deck.nodes.rbegin()->first);
    start_at({rest, rest, 0});
  }

  /// Goes on from the end of a window of another run.
  void restore(bridge::Participant &bridge, const std::filesystem::path &file) {
    check_is_elsewhere(file, folder_);
    const SavedState saved = read_state(file);
    bridge.restore(saved.bridge);
    start_at(windows_.restore(saved.ccx, saved.time, saved.windows));
  }

  void coupled(bridge::Participant &bridge) {
    bridge.set_mesh(surface().mesh);
    bridge.initialize();
    // Only now: a partner that never comes must not cost the series of an earlier run.
    remove_restart_files(folder_, "solid");
    history_.emplace(model_.deck, model_.probe, folder_, output_interval_, motion_,
                     bridge.time_window() - 1);
    const StopSignal stop_signal;
    while (bridge.is_coupling_ongoing()) {
      const double dt = bridge.max_time_step_size();
      read_forces(bridge, dt);
      advance_solid(bridge, dt);
      if (stop_signal.has_come())
        bridge.request_stop();
      bridge.advance(dt);
      // An iterate that is refused leaves no trace: the next one starts from the same state.
      if (bridge.is_time_window_complete())
        finish_window(bridge);
      if (bridge.requires_writing_restart())
        write_restart(bridge);
    }
    bridge.finalize();
    check(!bridge.is_stopped(),
          "stopped at t = {:.6g} s, as it was told to; sluice run --restart {} goes on from there",
          bridge.time(), folder_.string());
  }

  /// Nothing before the partner was met.
  void write_summary(std::string_view message, const bridge::Participant &bridge) const {
    if (history_)
      history_->write_summary(message, windows_.cost(), bridge::summary_of(bridge.statistics()));
  }

private:
  const Interface &surface() const { return model_.surface; }

  void start_at(const Motion &motion) {
    motion_ = motion;
    start_ = surface().gather(motion.displacement);
  }

  void write_restart(const bridge::Participant &bridge) const {
    const long windows = bridge.time_window() - 1;
    write_state(restart_file(folder_, "solid", windows),
                {bridge.time(), windows, windows_.saved(), bridge.saved_state()});
    remove_older_restart_files(folder_, "solid");
  }

  // As ccx will read them: the totals below are those of what it was given.
  void read_forces(const bridge::Participant &bridge, double relative_time) {
    bridge.read_data("force", relative_time, forces_);
    loads_ = surface().scatter(forces_);
    for (NodalForce &load : loads_)
      load.force = load.force.unaryExpr(&rounded_as_ccx_reads);
  }

  // A window without a solution is the bridge's to cut; where it may not, it ends both programs
  // with the reason.
  void advance_solid(bridge::Participant &bridge, double dt) {
    try {
      motion_ = windows_.solve(loads_, dt);
      write_motion(bridge);
    } catch (const Diverged &failure) {
      bridge.report_failure(failure.what());
    }
  }

  void write_motion(bridge::Participant &bridge) const {
    bridge.write_data("displacement", surface().gather(motion_.displacement));
    bridge.write_data("velocity", surface().gather(motion_.velocity));
  }

  void finish_window(bridge::Participant &bridge) {
    windows_.accept();
    const auto end = surface().gather(motion_.displacement);
    const auto totals = bridge::interface_totals(surface().mesh.dim, surface().mesh.positions,
                                                 surface().collect(loads_), start_, end);
    bridge.report_totals(totals);
    history_->record(motion_, totals, bridge.time());
    progress_.update(bridge.time(), history_->note());
    start_ = end;
  }

  Model model_;
  std::filesystem::path folder_;
  double output_interval_; // [s]
  Windows windows_;
  std::optional<History> history_;
  Progress progress_;
  std::vector<double> forces_;
  std::vector<NodalForce> loads_;
  Motion motion_;
  std::vector<double> start_; // displacement of the interface at the start of the window
};

} // namespace

void run(bridge::Participant &bridge, const Config &config, const std::filesystem::path &folder,
         const std::filesystem::path &restart) {
  const auto params = config.read<CalculixParams>("solid");
  Run run(read_model(config, params), params, bridge.case_settings(), folder);
  if (!restart.empty())
    run.restore(bridge, restart);
  try {
    run_coupled(bridge, [&] { run.coupled(bridge); });
  } catch (const std::exception &error) {
    run.write_summary(error.what(), bridge);
    throw;
  }
  run.write_summary("", bridge);
}

void run(const Config &config, const std::filesystem::path &folder,
         const std::filesystem::path &restart) {
  bridge::Participant bridge("solid", config, folder);
  run(bridge, config, folder, restart);
}

} // namespace sluice::calculix
