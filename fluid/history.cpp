// SPDX-License-Identifier: MIT
#include "fluid/history.hpp"

#include "bridge/base/check.hpp"
#include "fluid/state_file.hpp"

#include <cmath>
#include <fstream>
#include <limits>
#include <nlohmann/json.hpp>

namespace sluice::fluid {

namespace {

template <int dim> std::string series_header(const std::vector<GaugeParams<dim>> &gauges) {
  // Volumes are areas in the plane; energies, momenta and forces then are per metre of depth.
  const auto vector = [](const char *name, const char *unit) {
    std::string columns;
    for (int d = 0; d < dim; ++d)
      columns += fmt::format(",{}_{}_{}", name, "xyz"[d], unit);
    return columns;
  };
  std::string header = "time_s,kinetic_j,potential_j,work_on_walls_j,outlet_energy_j,"
                       "by_correction_j,by_projection_j,by_damping_j";
  for (const char *name : {"volume", "point_volume", "tank_volume", "tank_point_volume",
                           "outflow_past_tip", "outflow"})
    header += fmt::format(",{}_{}", name, dim == 2 ? "m2" : "m3");
  header += ",max_speed_m_s,min_pressure_pa,max_pressure_pa" + vector("momentum", "n_s") +
            vector("wall_force", "n") + vector("outlet_momentum", "n_s") +
            ",guarded_rows,pressure_iterations,wall_returns,lost_points,points";
  for (const GaugeParams<dim> &gauge : gauges)
    header += (gauge.is_front() ? ",front_" : ",level_") + gauge.name + "_m";
  return header;
}

template <int dim> std::string loads_header() {
  return std::string("window,time_s,") +
         (dim == 2 ? "fx_n,fy_n,moment_nm" : "fx_n,fy_n,fz_n,mx_nm,my_nm,mz_nm") +
         ",magnitude_n,moment_magnitude_nm,work_j,work_magnitude_j";
}

template <int dim> double volume_of_points(std::int64_t count, double spacing) {
  double volume = static_cast<double>(count);
  for (int d = 0; d < dim; ++d)
    volume *= spacing;
  return volume;
}

template <int dim> VerticalLine<dim> line_of(const GaugeParams<dim> &gauge) {
  if constexpr (dim == 2)
    return VerticalLine<2>(gauge.x);
  else
    return {gauge.x, gauge.z};
}

} // namespace

template <int dim>
History<dim>::History(const Scene<dim> &scene, const FluidSolver<dim> &solver,
                      std::filesystem::path folder, double output_interval, double time)
    : folder_(std::move(folder)), gauges_(scene.gauges),
      series_(folder_ / "fluid.csv", series_header<dim>(gauges_)),
      loads_(folder_ / "fluid_loads.csv", loads_header<dim>()), points_(folder_), walls_(folder_),
      output_interval_(output_interval), last_time_(time) {
  for (const ProbeParams<dim> &probe : scene.probes)
    probes_.emplace_back(probe, folder_);
  const Points<dim> &points = solver.state.points;
  start_ = integrate(solver.state, scene.params);
  double lowest = -1e300;
  for (const Vec<dim> &x : points.position)
    lowest = std::max(lowest, scene.params.gravity.dot(x));
  energy_scale_ =
      start_.kinetic + start_.potential + scene.params.density * start_.point_volume * lowest;
  outlet_energy_ = start_outlet_energy_ = solver.outlet_energy();
  initial_volume_ = start_.point_volume;
  last_ = start_;
  write_fields(solver, time);
}

template <int dim>
void History<dim>::record_loads(const FluidSolver<dim> &solver,
                                const bridge::InterfaceTotals &loads, double time) {
  work_on_walls_ += loads.work;
  std::vector<double> row{static_cast<double>(solver.state.step), time};
  row.insert(row.end(), loads.force.begin(), loads.force.begin() + dim);
  row.insert(row.end(), loads.moment.begin() + (dim == 2 ? 2 : 0), loads.moment.end());
  row.insert(row.end(),
             {loads.force_magnitude, loads.moment_magnitude, loads.work, loads.work_magnitude});
  loads_.row(row);
}

template <int dim> Vec<dim> History<dim>::force_on_all_walls(const FluidSolver<dim> &solver) {
  if (!solver.params().record_wall_force)
    return Vec<dim>::Constant(std::numeric_limits<double>::quiet_NaN());
  const Points<dim> &points = solver.state.points;
  build_wall_quadrature(points, solver.walls, solver.cloud(), WallPart::all, all_walls_);
  evaluate_tractions(points, solver.walls, solver.cloud(), solver.problem(), points.pressure,
                     solver.viscosity(), all_walls_, all_tractions_);
  return integrate_resultant(all_walls_, all_tractions_).force -
         solver.report().contact_impulse / solver.dt();
}

template <int dim> double History<dim>::energy_gain(const Integrals<dim> &now) const {
  return now.kinetic + now.potential + work_on_walls_ + outlet_energy_ - start_.kinetic -
         start_.potential - start_outlet_energy_;
}

template <int dim>
void History<dim>::update_extremes(const FluidSolver<dim> &solver, const Integrals<dim> &now) {
  energy_gain_max_ = std::max(energy_gain_max_, energy_gain(now));
  volume_drift_max_ = std::max(volume_drift_max_,
                               std::abs(now.tank_volume - now.tank_point_volume) / initial_volume_);
  const EnergyChanges &changes = solver.report().energy;
  energy_changes_.correction += changes.correction;
  energy_changes_.projection += changes.projection;
  energy_changes_.damping += changes.damping;
  guarded_rows_ += solver.report().rows.guarded();
  pressure_iterations_ += solver.report().pressure_iterations;
  pressure_solves_ += solver.report().pressure_solves;
  cells_ += solver.state.points.size();
  cells_cut_ += solver.report().cells_cut;
  viscous_passes_ += solver.report().viscous_passes;
  near_walls_ += static_cast<long>(solver.cloud().wall_points.size());
  viscosity_skipped_ += solver.report().viscosity_skipped;
  viscous_iterations_ += solver.report().viscous_iterations;
  ++steps_;
}

template <int dim>
void History<dim>::record(const FluidSolver<dim> &solver, const bridge::InterfaceTotals &loads,
                          double time) {
  record_loads(solver, loads, time);
  const Integrals<dim> now = integrate(solver);
  const Vec<dim> wall_force = force_on_all_walls(solver);
  outlet_energy_ = solver.outlet_energy();
  update_extremes(solver, now);
  const double spacing = solver.params().spacing;
  const FluidState<dim> &state = solver.state;
  std::vector<double> row{time,
                          now.kinetic,
                          now.potential,
                          work_on_walls_,
                          outlet_energy_,
                          energy_changes_.correction,
                          energy_changes_.projection,
                          energy_changes_.damping,
                          now.volume,
                          now.point_volume,
                          now.tank_volume,
                          now.tank_point_volume,
                          initial_volume_ - now.tank_point_volume,
                          volume_of_points<dim>(state.outflow_points, spacing),
                          now.max_speed,
                          now.min_pressure,
                          now.max_pressure};
  for (const Vec<dim> &v : {now.momentum, wall_force, state.outlet_momentum})
    row.insert(row.end(), v.begin(), v.end());
  row.insert(row.end(),
             {static_cast<double>(solver.report().rows.guarded()),
              static_cast<double>(solver.report().pressure_iterations),
              static_cast<double>(state.wall_returns), static_cast<double>(state.lost_points),
              static_cast<double>(state.points.size())});
  for (const GaugeParams<dim> &gauge : gauges_) {
    const VerticalLine<dim> line = line_of(gauge);
    row.push_back(gauge.is_front()
                      ? front(state.points, gauge.y, spacing)
                      : water_level(state.points, line, spacing, floor_at(solver.walls, line)));
  }
  series_.row(row);
  write_fields(solver, time);
  last_ = now;
  last_time_ = time;
}

template <int dim> void History<dim>::write_fields(const FluidSolver<dim> &solver, double time) {
  if (output_interval_ <= 0 || time < next_output_ - 1e-9 * output_interval_)
    return;
  points_.write(solver, time);
  walls_.write(solver.walls, solver.state.step, time);
  if (solver.state.points.size() == static_cast<int>(solver.cloud().kind.size()))
    for (ProbeOutput<dim> &probe : probes_) // not before the first step
      probe.write(solver, time);
  write_state_file(solver, time);
  next_output_ += output_interval_ * std::ceil((time - next_output_) / output_interval_ + 1e-6);
}

template <int dim>
void History<dim>::write_state_file(const FluidSolver<dim> &solver, double time) const {
  write_state<dim>(folder_ / "fluid_state.h5", {solver.state, time, solver.params().spacing});
}

template <int dim> void History<dim>::count(const LimitedStep &step) {
  ++limits_[static_cast<std::size_t>(step.limit)];
  smallest_step_ = std::min(smallest_step_, step.size);
}

template <int dim> std::string History<dim>::note() const {
  return fmt::format("t = {:.4f} s, max speed {:.2f} m/s", last_time_, last_.max_speed);
}

template <int dim>
void History<dim>::write_summary(const FluidSolver<dim> &solver, const std::string &message,
                                 const nlohmann::json &bridge_summary) const {
  nlohmann::json summary = bridge_summary;
  const double n = std::max(1L, steps_), wall = watch_.seconds();
  double own = 0;
  nlohmann::json phases = nlohmann::json::object();
  for (const auto &[phase, seconds] : solver.timer.seconds()) {
    phases[phase] = 1e3 * seconds / n;
    own += seconds;
  }
  const double volume = volume_of_point<dim>(solver.params().spacing);
  summary["points"] =
      solver.state.points.size() + solver.state.outflow_points + solver.state.lost_points;
  summary["spacing_m"] = solver.params().spacing;
  summary["steps"] = steps_;
  summary["end_time_s"] = last_time_;
  summary["lost_points"] = solver.state.lost_points;
  summary["outflow_points"] = solver.state.outflow_points;
  summary["wall_returns"] = solver.state.wall_returns;
  summary[dim == 2 ? "outflow_m2" : "outflow_m3"] =
      static_cast<double>(solver.state.outflow_points) * volume;
  summary["wall_time_s"] = wall;
  summary["cpu_time_s"] = process_cpu_time();
  summary["ms_per_step_fluid"] = 1e3 * own / n;
  summary["phases_ms"] = phases;
  summary["guarded_rows_per_step"] = static_cast<double>(guarded_rows_) / n;
  summary["pressure_iterations_per_solve"] =
      static_cast<double>(pressure_iterations_) / std::max(1L, pressure_solves_);
  summary["cells_known_share"] =
      1 - static_cast<double>(cells_cut_) / static_cast<double>(std::max(1L, cells_));
  summary["points_away_from_walls_share"] =
      1 - static_cast<double>(near_walls_) / static_cast<double>(std::max(1L, cells_));
  summary["viscosity_skipped_steps"] = viscosity_skipped_;
  summary["viscous_passes_per_step"] = static_cast<double>(viscous_passes_) / n;
  summary["viscous_iterations_per_step"] = static_cast<double>(viscous_iterations_) / n;
  const RowCounts &pressure_rows = solver.report().rows;
  summary["pressure_rows_last_step"] = {{"quadratic", pressure_rows.quadratic},
                                        {"blended", pressure_rows.blended},
                                        {"linear", pressure_rows.linear},
                                        {"plain", pressure_rows.plain},
                                        {"open", pressure_rows.open}};
  const ViscousRowCounts &rows = solver.report().viscous_rows;
  summary["viscous_rows_last_step"] = {{"quadratic", rows.quadratic},
                                       {"linear", rows.linear},
                                       {"surface", rows.surface},
                                       {"pairs", rows.pairs}};
  summary["volume_drift_max"] = volume_drift_max_;
  if (solver.params().courant > 0) {
    summary["smallest_step_s"] = smallest_step_;
    for (std::size_t k = 0; k < limits_.size(); ++k)
      summary["steps_held_by"][std::string(step_limit_names[k])] = limits_[k];
  }
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

template class History<2>;
template class History<3>;

} // namespace sluice::fluid
