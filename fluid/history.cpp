// SPDX-License-Identifier: MIT
#include "fluid/history.hpp"

#include "bridge/base/check.hpp"
#include "fluid/state_file.hpp"

#include <cmath>
#include <fstream>
#include <nlohmann/json.hpp>

namespace sluice::fluid {

namespace {

std::string series_header(const std::vector<GaugeParams> &gauges) {
  std::string header =
      "time_s,kinetic_j,potential_j,work_on_walls_j,outlet_energy_j,volume_m2,point_volume_m2,"
      "tank_volume_m2,tank_point_volume_m2,outflow_past_tip_m2,outflow_m2,max_speed_m_s,"
      "min_pressure_pa,max_pressure_pa,momentum_x_n_s,momentum_y_n_s,wall_force_x_n,"
      "wall_force_y_n,outlet_momentum_x_n_s,outlet_momentum_y_n_s,guarded_rows,"
      "pressure_iterations,wall_returns,lost_points,points";
  for (const GaugeParams &gauge : gauges)
    header += ",level_" + gauge.name + "_m";
  return header;
}

} // namespace

History::History(const Scene &scene, const FluidSolver &solver, std::filesystem::path folder,
                 double output_interval, double time)
    : folder_(std::move(folder)), gauges_(scene.gauges),
      series_(folder_ / "fluid.csv", series_header(gauges_)),
      loads_(folder_ / "fluid_loads.csv", "window,time_s,fx_n,fy_n,moment_nm,magnitude_n,"
                                          "moment_magnitude_nm,work_j,work_magnitude_j"),
      points_(folder_), walls_(folder_), output_interval_(output_interval), last_time_(time) {
  for (const ProbeParams &probe : scene.probes)
    probes_.emplace_back(probe, folder_);
  const Points &points = solver.state.points;
  start_ = integrate(solver.state, scene.params);
  double lowest = -1e300;
  for (const Vec<2> &x : points.position)
    lowest = std::max(lowest, scene.params.gravity.dot(x));
  energy_scale_ = start_.kinetic + start_.potential +
                  scene.params.density * start_.point_volume * lowest;
  outlet_energy_ = start_outlet_energy_ = solver.outlet_energy();
  initial_volume_ = start_.point_volume;
  last_ = start_;
  write_fields(solver, time);
}

void History::record_loads(const FluidSolver &solver, const bridge::InterfaceTotals &loads,
                           double time) {
  work_on_walls_ += loads.work;
  loads_.row({static_cast<double>(solver.state.step), time, loads.force[0], loads.force[1],
              loads.moment[2], loads.force_magnitude, loads.moment_magnitude, loads.work,
              loads.work_magnitude});
}

Vec<2> History::force_on_all_walls(const FluidSolver &solver) {
  const Points &points = solver.state.points;
  build_wall_quadrature(points, solver.walls, solver.cloud(), WallPart::all, all_walls_);
  evaluate_tractions(points, solver.walls, solver.cloud(), solver.problem(), points.pressure,
                     solver.viscosity(), all_walls_, all_tractions_);
  return integrate_resultant(all_walls_, all_tractions_).force;
}

double History::energy_gain(const Integrals &now) const {
  return now.kinetic + now.potential + work_on_walls_ + outlet_energy_ - start_.kinetic -
         start_.potential - start_outlet_energy_;
}

void History::update_extremes(const FluidSolver &solver, const Integrals &now) {
  energy_gain_max_ = std::max(energy_gain_max_, energy_gain(now));
  volume_drift_max_ =
      std::max(volume_drift_max_,
               std::abs(now.tank_volume - now.tank_point_volume) / initial_volume_);
  guarded_rows_ += solver.report().rows.linear + solver.report().rows.plain;
  pressure_iterations_ += solver.report().pressure_iterations;
  pressure_solves_ += solver.report().pressure_solves;
  viscous_passes_ += solver.report().viscous_passes;
  viscous_iterations_ += solver.report().viscous_iterations;
  ++steps_;
}

void History::record(const FluidSolver &solver, const bridge::InterfaceTotals &loads, double time) {
  record_loads(solver, loads, time);
  const Integrals now = integrate(solver);
  const Vec<2> wall_force =
      force_on_all_walls(solver) - solver.report().contact_impulse / solver.dt();
  outlet_energy_ = solver.outlet_energy();
  update_extremes(solver, now);
  const double spacing = solver.params().spacing;
  const FluidState &state = solver.state;
  std::vector<double> row{
      time, now.kinetic, now.potential, work_on_walls_, outlet_energy_, now.volume,
      now.point_volume, now.tank_volume, now.tank_point_volume,
      initial_volume_ - now.tank_point_volume,
      static_cast<double>(state.outflow_points) * spacing * spacing, now.max_speed,
      now.min_pressure, now.max_pressure, now.momentum.x(), now.momentum.y(), wall_force.x(),
      wall_force.y(), state.outlet_momentum.x(), state.outlet_momentum.y(),
      static_cast<double>(solver.report().rows.linear + solver.report().rows.plain),
      static_cast<double>(solver.report().pressure_iterations),
      static_cast<double>(state.wall_returns), static_cast<double>(state.lost_points),
      static_cast<double>(state.points.size())};
  for (const GaugeParams &gauge : gauges_)
    row.push_back(
        water_level(state.points, gauge.x, spacing, floor_at(solver.walls, gauge.x)));
  series_.row(row);
  write_fields(solver, time);
  last_ = now;
  last_time_ = time;
}

void History::write_fields(const FluidSolver &solver, double time) {
  if (output_interval_ <= 0 || time < next_output_ - 1e-9 * output_interval_)
    return;
  points_.write(solver, time);
  walls_.write(solver.walls, solver.state.step, time);
  if (solver.state.points.size() == static_cast<int>(solver.cloud().kind.size()))
    for (ProbeOutput &probe : probes_) // not before the first step
      probe.write(solver, time);
  write_state_file(solver, time);
  next_output_ += output_interval_ * std::ceil((time - next_output_) / output_interval_ + 1e-6);
}

void History::write_state_file(const FluidSolver &solver, double time) const {
  write_state(folder_ / "fluid_state.h5", {solver.state, time, solver.params().spacing});
}

std::string History::note() const {
  return fmt::format("t = {:.4f} s, max speed {:.2f} m/s", last_time_, last_.max_speed);
}

void History::write_summary(const FluidSolver &solver, const std::string &message,
                            const nlohmann::json &bridge_summary) const {
  nlohmann::json summary = bridge_summary;
  const double n = std::max(1L, steps_), wall = watch_.seconds();
  double own = 0;
  nlohmann::json phases = nlohmann::json::object();
  for (const auto &[phase, seconds] : solver.timer.seconds()) {
    phases[phase] = 1e3 * seconds / n;
    own += seconds;
  }
  const double area = solver.params().spacing * solver.params().spacing;
  summary["points"] = solver.state.points.size() + solver.state.outflow_points +
                      solver.state.lost_points;
  summary["spacing_m"] = solver.params().spacing;
  summary["steps"] = steps_;
  summary["end_time_s"] = last_time_;
  summary["lost_points"] = solver.state.lost_points;
  summary["outflow_points"] = solver.state.outflow_points;
  summary["wall_returns"] = solver.state.wall_returns;
  summary["outflow_m2"] = static_cast<double>(solver.state.outflow_points) * area;
  summary["wall_time_s"] = wall;
  summary["cpu_time_s"] = process_cpu_time();
  summary["ms_per_step_fluid"] = 1e3 * own / n;
  summary["phases_ms"] = phases;
  summary["guarded_rows_per_step"] = static_cast<double>(guarded_rows_) / n;
  summary["pressure_iterations_per_solve"] =
      static_cast<double>(pressure_iterations_) / std::max(1L, pressure_solves_);
  summary["viscous_passes_per_step"] = static_cast<double>(viscous_passes_) / n;
  summary["viscous_iterations_per_step"] = static_cast<double>(viscous_iterations_) / n;
  const ViscousRowCounts &rows = solver.report().viscous_rows;
  summary["viscous_rows_last_step"] = {{"quadratic", rows.quadratic},
                                       {"linear", rows.linear},
                                       {"surface", rows.surface},
                                       {"pairs", rows.pairs}};
  summary["volume_drift_max"] = volume_drift_max_;
  if (steps_ > 0 && energy_scale_ > 0) {
    summary["energy_gain_max"] = energy_gain_max_ / energy_scale_;
    summary["energy_drift"] = energy_gain(last_) / energy_scale_;
  }
  summary["completed"] = message.empty();
  if (!message.empty())
    summary["message"] = message;
  const auto file = folder_ / "fluid_summary.json";
  std::ofstream out(file);
  out << summary.dump(2) << '\n' << std::flush;
  check(out.good(), "{}: cannot be written", file.string());
  if (message.empty())
    write_state_file(solver, last_time_);
}

} // namespace sluice::fluid
