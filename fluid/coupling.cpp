// SPDX-License-Identifier: MIT
#include "fluid/coupling.hpp"

#include "bridge/base/progress.hpp"
#include "bridge/base/restart_files.hpp"
#include "bridge/base/stop_signal.hpp"
#include "bridge/participant.hpp"
#include "bridge/run_summary.hpp"
#include "bridge/settings.hpp"
#include "fluid/history.hpp"
#include "fluid/state_file.hpp"
#include "fluid/step_limit.hpp"
#include "fluid/surface_file.hpp"

#include <nlohmann/json.hpp>
#include <optional>

namespace sluice::fluid {

namespace {

// The map of a whole step jumps where a point changes its kind with the position of the wall, and
// an iteration across a jump has no limit. From here on the cloud stays as the last full step built
// it: the map is affine, and what is left to correct in the wall's position far below a spacing.
constexpr int most_full_iterations = 8;

/// The coupled walls as the bridge sees them, and the way back.
template <int dim> class CoupledSurface {
public:
  explicit CoupledSurface(const Walls<dim> &walls)
      : reference_(walls.position), displacement_(walls.position.size(), Vec<dim>::Zero()) {
    values_.resize(dim * walls.coupled_vertices.size());
  }
  /// Per wall vertex, as last read [m].
  const std::vector<Vec<dim>> &displacement() const { return displacement_; }

  bridge::InterfaceMesh mesh(const Walls<dim> &walls) const {
    bridge::InterfaceMesh mesh;
    mesh.dim = mesh.nodes_per_face = dim;
    std::vector<int> node(walls.position.size(), -1);
    for (std::size_t k = 0; k < walls.coupled_vertices.size(); ++k) {
      const Vec<dim> &x = walls.position[walls.coupled_vertices[k]];
      mesh.positions.insert(mesh.positions.end(), x.begin(), x.end());
      node[walls.coupled_vertices[k]] = static_cast<int>(k);
    }
    for (const int f : walls.coupled_faces)
      for (const int v : walls.faces[f].vertex)
        mesh.faces.push_back(node[v]);
    return mesh;
  }

  void read_positions(const bridge::Participant &bridge, double relative_time, Walls<dim> &walls) {
    bridge.read_data("displacement", relative_time, values_);
    for (std::size_t k = 0; k < walls.coupled_vertices.size(); ++k) {
      const int v = walls.coupled_vertices[k];
      displacement_[v] = value(k);
      walls.position[v] = reference_[v] + displacement_[v];
    }
  }

  void read_velocities(const bridge::Participant &bridge, double relative_time, Walls<dim> &walls) {
    bridge.read_data("velocity", relative_time, values_);
    for (std::size_t k = 0; k < walls.coupled_vertices.size(); ++k)
      walls.velocity[walls.coupled_vertices[k]] = value(k);
  }

  void write_forces(bridge::Participant &bridge, const FluidSolver<dim> &solver) {
    for (std::size_t k = 0; k < values_.size() / dim; ++k) {
      const Vec<dim> &f = solver.nodal_forces()[solver.walls.coupled_vertices[k]];
      std::copy(f.begin(), f.end(), values_.begin() + static_cast<std::ptrdiff_t>(dim * k));
    }
    bridge.write_data("force", values_);
  }

private:
  Vec<dim> value(std::size_t k) const { return Vec<dim>(&values_[dim * k]); }

  std::vector<Vec<dim>> reference_, displacement_;
  std::vector<double> values_;
};

/// A scene and the time of its first state.
template <int dim> struct Start {
  Scene<dim> scene;
  double time = 0;
  std::vector<std::byte> bridge{}; // of the run that a coupled one goes on from
};

template <int dim> bool has_partner(const Scene<dim> &scene) {
  return !scene.walls.coupled_vertices.empty() && scene.params.coupled_walls == "move";
}

/// A state that fits the scene's spacing and its run's length.
template <int dim>
SavedState<dim> read_fitting_state(const std::filesystem::path &file, const Scene<dim> &scene,
                                   const bridge::CaseSettings &settings) {
  SavedState<dim> saved = read_state<dim>(file);
  check(std::abs(saved.spacing - scene.params.spacing) <= 1e-12 * scene.params.spacing,
        "{}: its points are {} m apart, fluid.spacing_m is {} m", file.string(), saved.spacing,
        scene.params.spacing);
  check(saved.time < settings.end_time,
        "{}: its state is of t = {} s, the run ends at case.end_time_s = {}", file.string(),
        saved.time, settings.end_time);
  return saved;
}

/// The water and the bridge as a coupled run left them.
template <int dim>
Start<dim> restart_of(const Config &config, const bridge::CaseSettings &settings,
                      const std::filesystem::path &file) {
  Start<dim> start{.scene = read_scene<dim>(config, read_surface_file)};
  SavedState<dim> saved = read_fitting_state(file, start.scene, settings);
  check(has_partner(start.scene) && !saved.bridge.empty(),
        "{}: restart files are of coupled runs; the fluid alone goes on from fluid.start_state",
        file.string());
  start.scene.initial = std::move(saved.state);
  start.time = saved.time;
  start.bridge = std::move(saved.bridge);
  return start;
}

/// The water as filled, or as another run left it.
template <int dim> Start<dim> start_of(const Config &config, const bridge::CaseSettings &settings) {
  Start<dim> start{.scene = read_scene<dim>(config, read_surface_file)};
  FluidParams<dim> &params = start.scene.params;
  if (params.start_state.empty())
    return start;
  params.start_state = std::filesystem::path(config.file_name()).parent_path() / params.start_state;
  SavedState<dim> saved = read_fitting_state(params.start_state, start.scene, settings);
  check(!has_partner(start.scene),
        "fluid.start_state is for the fluid alone: the solid would start at t = 0, not at {} s; a "
        "coupled run goes on with sluice run --restart",
        saved.time);
  start.scene.initial = std::move(saved.state);
  check_clear_of_walls(start.scene, params.motion.wall_clearance * params.spacing);
  start.time = saved.time;
  return start;
}

// A lattice that does not fit the corners of the water holds more or less of it.
template <int dim> void note_volume_error(const Scene<dim> &scene) {
  constexpr double worth_a_note = 0.01;
  const double error = volume_error(scene);
  if (scene.params.start_state.empty() && std::abs(error) > worth_a_note)
    fmt::print(stderr,
               "fluid: the points stand for {:+.1f} % of the volume of water_m: its edges are no "
               "multiples of spacing_m = {} m\n",
               100 * error, scene.params.spacing);
}

/// Time of the fluid alone. Steps of the given length are counted, so that a run that goes on from
/// another keeps its times; others are summed. The last one is as long as the end leaves it.
class StepClock {
public:
  StepClock(double start, double end, double length) : end_(end), length_(length), origin_(start) {
    const double steps_before = std::round(start / length);
    if (std::abs(start - steps_before * length) > 1e-6 * length)
      return;
    origin_ = 0;
    step_ = static_cast<long>(steps_before);
  }
  bool is_over() const { return end_ - time() <= 1e-6 * length_; }
  double time() const { return origin_ + static_cast<double>(step_) * length_; } ///< [s]
  /// The next step's length where it is held to `limit` [s].
  double step_size(double limit) const {
    const double left = end_ - time();
    return left < (1 - 1e-6) * limit ? left : limit;
  }
  void pass(double step) {
    if (step == length_) {
      ++step_;
    } else {
      origin_ = time() + step;
      step_ = 0;
    }
  }

private:
  double end_, length_, origin_;
  long step_ = 0;
};

/// One step alone or one window with a partner.
template <int dim> class Run {
public:
  Run(const Config &config, const std::filesystem::path &folder,
      const std::filesystem::path &restart)
      : settings_(config.read<bridge::CaseSettings>("case")),
        start_(restart.empty() ? start_of<dim>(config, settings_)
                               : restart_of<dim>(config, settings_, restart)),
        solver_(start_.scene), folder_(folder), progress_("fluid", settings_.end_time) {
    if (const auto &from = start_.scene.params.start_state; !from.empty())
      check_is_elsewhere(from, folder);
    if (!restart.empty())
      check_is_elsewhere(restart, folder);
    note_volume_error(start_.scene);
  }

  void alone() {
    open_history();
    const std::vector<Vec<dim>> at_rest(solver_->walls.position.size(), Vec<dim>::Zero());
    StepClock clock(start_.time, settings_.end_time, settings_.time_step);
    while (!clock.is_over()) {
      move_walls(start_.scene.prescribed, clock.time(), settings_.time_step, solver_->walls);
      const LimitedStep limited =
          limited_step(solver_->state, solver_->walls, solver_->params(), settings_.time_step);
      const double dt = clock.step_size(limited.size);
      move_walls(start_.scene.prescribed, clock.time(), dt, solver_->walls);
      solver_->begin_step(dt);
      solver_->iterate();
      solver_->end_step();
      clock.pass(dt);
      history_->count(limited);
      finish_step(interface_totals(*solver_, at_rest, at_rest),
                  std::min(clock.time(), settings_.end_time));
    }
  }

  void coupled(bridge::Participant &bridge) {
    CoupledSurface<dim> surface(solver_->walls);
    bridge.set_mesh(surface.mesh(solver_->walls));
    if (!start_.bridge.empty())
      bridge.restore(start_.bridge);
    bridge.initialize();
    surface.read_positions(bridge, 0, solver_->walls);
    open_history();
    const StopSignal stop_signal;
    const bool repeats_steps = bridge.settings().iterate == "full";
    const bool may_halve = bridge.settings().max_halvings > 0;
    while (bridge.is_coupling_ongoing()) {
      const double dt = bridge.max_time_step_size();
      const bool is_first = bridge.iteration() == 1;
      const bool repeats_step = repeats_steps && bridge.iteration() <= most_full_iterations;
      if (is_first && bridge.requires_reading_checkpoint()) // the same window, half as long
        solver_->state = saved_;
      if (is_first) {
        surface.read_positions(bridge, 0, solver_->walls);
        moved_from_ = surface.displacement();
        if (repeats_steps || may_halve)
          saved_ = solver_->state;
      } else if (repeats_step) {
        solver_->state = saved_;
      }
      surface.read_velocities(bridge, dt, solver_->walls);
      iterate(bridge, surface, dt, is_first || repeats_step);
      if (stop_signal.has_come())
        bridge.request_stop();
      bridge.advance(dt);
      if (!bridge.is_time_window_complete())
        continue;
      solver_->end_step();
      surface.read_positions(bridge, 0, solver_->walls);
      const bridge::InterfaceTotals loads =
          interface_totals(*solver_, moved_from_, surface.displacement());
      bridge.report_totals(loads);
      finish_step(loads, bridge.time());
      if (bridge.requires_writing_restart()) {
        write_restart(bridge);
        if (bridge.is_coupling_ongoing())
          start_anew();
      }
    }
    bridge.finalize();
    check(!bridge.is_stopped(),
          "stopped at t = {:.6g} s, as it was told to; sluice run --restart {} goes on from there",
          bridge.time(), folder_.string());
  }

  void write_summary(const std::string &message, const nlohmann::json &bridge_summary) const {
    if (history_)
      history_->write_summary(*solver_, message, bridge_summary);
  }
  bool has_partner() const { return fluid::has_partner(start_.scene); }

private:
  void iterate(bridge::Participant &bridge, CoupledSurface<dim> &surface, double dt, bool moves) {
    if (moves)
      surface.read_positions(bridge, dt, solver_->walls);
    const std::string failure = failure_of([&] { compute(bridge.time(), dt, moves); });
    if (failure.empty())
      surface.write_forces(bridge, *solver_);
    else
      bridge.report_failure(failure);
  }

  void compute(double time, double dt, bool moves) {
    if (moves) {
      move_walls(start_.scene.prescribed, time, dt, solver_->walls);
      check_step(dt);
      solver_->begin_step(dt);
    }
    solver_->iterate();
  }

  // Whatever keeps the solver from doing a step (a solve that does not converge, points that fly
  // apart) may not in a shorter one, which is the bridge's to try; where it may not, it ends both
  // programs with the reason.
  template <class Step> static std::string failure_of(Step &&step) {
    try {
      step();
      return "";
    } catch (const UserError &failure) {
      return failure.what();
    }
  }

  void check_step(double dt) const {
    const auto [size, limit] =
        limited_by_motion(solver_->state, solver_->walls, solver_->params(), settings_.time_step);
    if (dt > size * (1 + 1e-9))
      fail("step {}: {:.3g} s is longer than fluid.courant = {} allows ({:.3g} s, {})",
           solver_->state.step + 1, dt, solver_->params().courant, size,
           step_limit_names[static_cast<std::size_t>(limit)]);
  }

  // Only a run that really begins touches the files of an earlier one.
  void open_history() {
    remove_restart_files(folder_, "fluid");
    history_.emplace(start_.scene, *solver_, folder_, settings_.output_interval, start_.time);
  }

  void write_restart(const bridge::Participant &bridge) const {
    write_state<dim>(
        restart_file(folder_, "fluid", bridge.time_window() - 1),
        {solver_->state, bridge.time(), solver_->params().spacing, bridge.saved_state()});
    remove_older_restart_files(folder_, "fluid");
  }

  // As the run that will go on from the file: whatever the solver remembers beside its state
  // (cells, memory of the solvers) is built anew in both.
  void start_anew() {
    Scene<dim> scene = start_.scene;
    scene.initial = std::move(solver_->state);
    PhaseTimer timer = std::move(solver_->timer);
    solver_.emplace(scene);
    solver_->timer = std::move(timer);
  }

  void finish_step(const bridge::InterfaceTotals &loads, double time) {
    solver_->timer("record", [&] { history_->record(*solver_, loads, time); });
    progress_.update(time, history_->note());
  }

  bridge::CaseSettings settings_;
  Start<dim> start_;
  std::optional<FluidSolver<dim>> solver_;
  std::filesystem::path folder_;
  std::optional<History<dim>> history_;
  Progress progress_;
  FluidState<dim> saved_;
  std::vector<Vec<dim>> moved_from_; // displacement of the wall vertices at the window's start [m]
};

template <int dim> std::string describe(const Config &config) {
  const Start<dim> start = start_of<dim>(config, config.read<bridge::CaseSettings>("case"));
  if (has_partner(start.scene))
    config.read<bridge::BridgeSettings>("bridge");
  return fmt::format("{} points ({:+.2f} % of the {} of water_m), {} wall {}",
                     start.scene.initial.points.size(), 100 * volume_error(start.scene),
                     dim == 2 ? "area" : "volume", start.scene.walls.faces.size(),
                     dim == 2 ? "segments" : "triangles");
}

template <int dim>
void run(const Config &config, const std::filesystem::path &folder,
         const std::filesystem::path &restart) {
  Run<dim> run(config, folder, restart);
  std::unique_ptr<bridge::Participant> bridge;
  const auto statistics = [&] {
    return bridge ? bridge::summary_of(bridge->statistics()) : nlohmann::json::object();
  };
  try {
    if (run.has_partner()) {
      bridge = std::make_unique<bridge::Participant>("fluid", config, folder);
      run.coupled(*bridge);
    } else {
      run.alone();
    }
  } catch (const std::exception &error) {
    run.write_summary(error.what(), statistics());
    if (bridge)
      bridge->abort(error.what());
    throw;
  }
  run.write_summary("", statistics());
}

} // namespace

std::string describe(const Config &config) {
  return dimension_of(config) == 2 ? describe<2>(config) : describe<3>(config);
}

void run(const Config &config, const std::filesystem::path &folder,
         const std::filesystem::path &restart) {
  if (dimension_of(config) == 2)
    run<2>(config, folder, restart);
  else
    run<3>(config, folder, restart);
}

} // namespace sluice::fluid
