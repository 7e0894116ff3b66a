// SPDX-License-Identifier: MIT
#include "solid-dealii/history.hpp"

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
                      double output_interval)
    : solver_(solver), folder_(std::move(folder)), output_interval_(output_interval),
      end_(free_end(solver.discretisation(), solver.clamped_side())),
      tip_(folder_ / "tip.csv", "time_s,ux_m,uy_m,ux_front_m,uy_front_m,ux_back_m,uy_back_m"),
      loads_(folder_ / "solid_loads.csv",
             "window,time_s,fx_n,fy_n,moment_nm,magnitude_n,moment_magnitude_nm,work_j,"
             "work_magnitude_j"),
      energy_(folder_ / "solid_energy.csv", "time_s,kinetic_j,strain_j,load_work_j") {
  if (output_interval > 0)
    fields_.emplace(solver.discretisation(), folder_);
  record_state(solver.initial_state(), 0);
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
  loads_.row({static_cast<double>(windows_), time, sums.force.x(), sums.force.y(), sums.moment.z(),
              sums.force_magnitude, sums.moment_magnitude, sums.work, sums.work_magnitude});
}

template <int dim> void History<dim>::record_state(const SolidState &state, double time) {
  const auto &u = state.displacement;
  const Vec<dim> front = end_.at(u, end_.front), back = end_.at(u, end_.back);
  last_time_ = time;
  last_tip_ = end_.middle(u);
  tip_.row({time, last_tip_.x(), last_tip_.y(), front.x(), front.y(), back.x(), back.y()});
  energy_.row({time, solver_.kinetic_energy(state), solver_.strain_energy(state), state.load_work});
  // Counted, not summed: sample k is written at the first window that ends at or after k intervals.
  if (fields_ && time >= (1 - 1e-9) * static_cast<double>(fields_written_) * output_interval_)
    write_fields(state, time);
}

template <int dim> void History<dim>::write_fields(const SolidState &state, double time) {
  const Stopwatch watch;
  const auto stress = solver_.assembly().mean_stress(state.displacement, state.modes);
  fields_->write(time,
                 {state.displacement, state.velocity, pressure_of(stress), von_mises_of(stress)});
  fields_written_ = std::lround(std::floor(time / output_interval_ * (1 + 1e-9))) + 1;
  output_seconds_ += watch.seconds();
}

template <int dim> std::string History<dim>::note() const {
  return fmt::format("t = {:.4f} s, tip {:.2f} mm", last_time_, 1e3 * last_tip_.x());
}

template <int dim>
void History<dim>::write_summary(std::string_view message, const nlohmann::json &extra) const {
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
      {"solid_elements", solver_.discretisation().n_cells()},
      {"solid_unknowns", solver_.assembly().n_free()},
      {"solid_element", solver_.params().element},
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
