// SPDX-License-Identifier: MIT
#include "solid-dealii/history.hpp"

#include "solid-dealii/state_file.hpp"

#include <nlohmann/json.hpp>

#include <cmath>

namespace sluice::solid {
namespace {

// Stress columns as Assembly::mean_stress orders them: xx yy zz xy xz yz.
Eigen::VectorXd pressure_of(const Eigen::MatrixXd &stress) {
  return -stress.topRows(3).colwise().mean().transpose();
}

Eigen::VectorXd von_mises_of(const Eigen::MatrixXd &stress) {
  Eigen::MatrixXd deviator = stress;
  deviator.topRows(3).rowwise() -= stress.topRows(3).colwise().mean();
  return (1.5 * (deviator.topRows(3).colwise().squaredNorm() +
                 2 * deviator.bottomRows(3).colwise().squaredNorm()))
      .cwiseSqrt()
      .transpose();
}

} // namespace

template <int dim>
History<dim>::History(const SolidSolver<dim> &solver, std::filesystem::path folder,
                      double output_interval, const SolidState *first, double time)
    : solver_(solver), folder_(std::move(folder)), output_interval_(output_interval),
      loads_(solver.ranks(), folder_ / "solid_loads.csv",
             "window,time_s,fx_n,fy_n,moment_nm,magnitude_n,moment_magnitude_nm,work_j,"
             "work_magnitude_j"),
      energy_(solver.ranks(), folder_ / "solid_energy.csv",
              "time_s,kinetic_j,strain_j,load_work_j"),
      reactions_(solver.ranks(), folder_ / "reactions.csv", "time_s,fx_n,fy_n,fz_n,moment_z_nm") {
  const auto &d = solver.discretisation();
  n_elements_ = d.n_cells_of_all(); // with all ranks here: a summary may be one rank's last word
  n_unknowns_ = solver.assembly().n_free_of_all();
  if (solver.params().mesh.empty()) {
    end_ = free_end(d, solver.clamped_side());
    tip_ = Series(d.ranks, folder_ / "tip.csv",
                  "time_s,ux_m,uy_m,ux_front_m,uy_front_m,ux_back_m,uy_back_m");
  }
  std::string header = "time_s";
  for (const auto &probe : solver.params().probes) {
    probe_nodes_.push_back(d.nearest_node(Eigen::Map<const Vec<dim>>(probe.position.data())));
    for (int c = 0; c < dim; ++c)
      header += fmt::format(",{}_u{}_m", probe.name, "xyz"[c]);
  }
  if (!probe_nodes_.empty())
    probes_ = Series(d.ranks, folder_ / "probes.csv", header);
  if (output_interval > 0)
    fields_.emplace(d, folder_);
  fields_written_ = first && output_interval > 0 ? std::lround(time / output_interval) : 0;
  record_state(first ? *first : solver.initial_state(), time);
}

template <int dim>
void History<dim>::record(const SolidState &start, const SolidState &state,
                          const Eigen::VectorXd &load, double time) {
  ++windows_;
  record_loads(start, state, load, time);
  record_state(state, time);
}

template <int dim>
void History<dim>::record_loads(const SolidState &start, const SolidState &state,
                                const Eigen::VectorXd &load, double time) {
  const auto sums =
      sum_loads(solver_.discretisation(), load, start.displacement, state.displacement);
  const Eigen::VectorXd reactions = solver_.reactions(state, load);
  Eigen::VectorXd held = Eigen::VectorXd::Zero(reactions.size());
  for (const int node : solver_.supports().held)
    held.template segment<dim>(dim * node) = reactions.template segment<dim>(dim * node);
  const auto support =
      sum_loads(solver_.discretisation(), held, start.displacement, state.displacement);
  reactions_.row({time, support.force.x(), support.force.y(), dim == 3 ? support.force[dim - 1] : 0,
                  support.moment.z()});
  loads_.row({static_cast<double>(windows_), time, sums.force.x(), sums.force.y(), sums.moment.z(),
              sums.force_magnitude, sums.moment_magnitude, sums.work, sums.work_magnitude});
}

template <int dim> void History<dim>::record_state(const SolidState &state, double time) {
  last_time_ = time;
  record_probes(state, time);
  record_tip(state, time);
  energy_.row({time, solver_.kinetic_energy(state), solver_.strain_energy(state), state.load_work});
  // Counted, not summed: sample k is written at the first window that ends at or after k intervals.
  if (fields_ && time >= (1 - 1e-9) * static_cast<double>(fields_written_) * output_interval_)
    write_fields(state, time);
}

template <int dim> void History<dim>::record_tip(const SolidState &state, double time) {
  if (!end_)
    return;
  const auto &u = state.displacement;
  const Vec<dim> front = end_->at(u, end_->front), back = end_->at(u, end_->back);
  last_tip_ = end_->middle(u);
  tip_.row({time, last_tip_.x(), last_tip_.y(), front.x(), front.y(), back.x(), back.y()});
}

template <int dim> void History<dim>::record_probes(const SolidState &state, double time) {
  if (probe_nodes_.empty())
    return;
  std::vector<double> row{time};
  for (const int node : probe_nodes_) {
    const Vec<dim> u = solver_.discretisation().at(state.displacement, node);
    row.insert(row.end(), u.begin(), u.end());
  }
  probes_.row(row);
  std::copy_n(row.begin() + 1, dim, last_tip_.begin());
}

template <int dim> void History<dim>::write_fields(const SolidState &state, double time) {
  const Stopwatch watch;
  const auto stress = solver_.assembly().mean_stress(state.displacement, state.modes);
  const auto energy = solver_.assembly().energy_of_cells(state.displacement, state.modes);
  fields_->write(time, {state.displacement, state.velocity, pressure_of(stress),
                        von_mises_of(stress), stress, energy});
  write_state(folder_ / "solid_state.h5", {state, time}, solver_.ranks());
  fields_written_ = std::lround(std::floor(time / output_interval_ * (1 + 1e-9))) + 1;
  output_seconds_ += watch.seconds();
}

template <int dim> std::string History<dim>::note() const {
  return fmt::format("t = {:.4f} s, tip {:.2f} mm", last_time_, 1e3 * last_tip_.x());
}

template <int dim>
void History<dim>::write_summary(std::string_view message, const nlohmann::json &extra) const {
  if (!solver_.ranks().is_root())
    return;
  const auto &counts = solver_.counts();
  const double windows = static_cast<double>(std::max(1L, windows_));
  const auto mean = static_cast<double>(counts.iterations) /
                    static_cast<double>(std::max(1L, counts.solves + counts.rejected_starts));
  nlohmann::json summary{
      {"completed", message.empty()},
      {"message", message},
      {"time_s", last_time_},
      {"wall_time_s", watch_.seconds()},
      {"cpu_time_s", process_cpu_time()},
      {"ms_per_step_solid", 1e3 * counts.seconds / windows},
      {"cpu_ms_per_step_solid", 1e3 * counts.cpu_seconds / windows},
      {"phases_ms",
       {{"newton", 1e3 * counts.seconds / windows}, {"output", 1e3 * output_seconds_ / windows}}},
      {"solid_solves", counts.solves},
      {"solid_rejected_starts", counts.rejected_starts},
      {"newton_iterations_mean", mean},
      {"newton_iterations_max", counts.iterations_max},
      {"solid_cut_steps", counts.cut_steps},
      {"solid_factorisations", counts.factorisations},
      {"solid_linear_iterations", counts.linear_iterations},
      {"solid_elements", n_elements_},
      {"solid_unknowns", n_unknowns_},
      {"solid_ranks", solver_.ranks().size()},
      {"solid_element", solver_.params().used_element()},
      {"solid_material", solver_.params().material},
      {"solid_dimension", dim}};
  summary.update(extra);
  const auto file = folder_ / "solid_summary.json";
  std::ofstream out(file);
  out << summary.dump(2, ' ', false, nlohmann::json::error_handler_t::replace) << '\n'
      << std::flush;
  check(out.good(), "{}: writing failed; is the disk full?", file.string());
}

template class History<2>;
template class History<3>;

} // namespace sluice::solid
