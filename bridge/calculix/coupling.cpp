// SPDX-License-Identifier: MIT
#include "bridge/calculix/coupling.hpp"

#include "bridge/base/progress.hpp"
#include "bridge/calculix/history.hpp"
#include "bridge/calculix/model.hpp"
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
        progress_("solid", settings.end_time), forces_(surface().mesh.positions.size()),
        start_(surface().mesh.positions.size()) {}

  void coupled(bridge::Participant &bridge) {
    check(bridge.settings().restart_every == 0,
          "bridge.restart_every_windows: sluice-calculix writes no restart files yet; set it to 0");
    bridge.set_mesh(surface().mesh);
    bridge.initialize();
    // Only now: a partner that never comes must not cost the series of an earlier run.
    history_.emplace(model_.deck, model_.probe, folder_, output_interval_);
    while (bridge.is_coupling_ongoing()) {
      const double dt = bridge.max_time_step_size();
      read_forces(bridge, dt);
      advance_solid(bridge, dt);
      bridge.advance(dt);
      // An iterate that is refused leaves no trace: the next one starts from the same state.
      if (bridge.is_time_window_complete())
        finish_window(bridge);
    }
    bridge.finalize();
  }

  /// Nothing before the partner was met.
  void write_summary(std::string_view message, const bridge::Participant &bridge) const {
    if (history_)
      history_->write_summary(message, windows_.cost(), bridge::summary_of(bridge.statistics()));
  }

private:
  const Interface &surface() const { return model_.surface; }

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

void run(bridge::Participant &bridge, const Config &config, const std::filesystem::path &folder) {
  const auto params = config.read<CalculixParams>("solid");
  Run run(read_model(config, params), params, bridge.case_settings(), folder);
  try {
    run_coupled(bridge, [&] { run.coupled(bridge); });
  } catch (const std::exception &error) {
    run.write_summary(error.what(), bridge);
    throw;
  }
  run.write_summary("", bridge);
}

void run(const Config &config, const std::filesystem::path &folder) {
  bridge::Participant bridge("solid", config, folder);
  run(bridge, config, folder);
}

} // namespace sluice::calculix
