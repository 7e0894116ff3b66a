// SPDX-License-Identifier: MIT
// A participant whose solver runs on several MPI ranks: the verbs of participant.hpp, each called
// by all ranks together. Rank 0 holds the bridge; data are gathered there and handed out from
// there. What fails on one rank is thrown on all of them, and the partner is told. What a restart
// needs is rank 0's, and so is the bridge's part of the restart file.
#pragma once

#include "bridge/participant.hpp"

#include <functional>

#include <mpi.h>

namespace sluice::bridge {

class DistributedParticipant {
public:
  /// `ranks` are this program's own. `transport`, on rank 0, is that of join_programs
  /// (transport_mpi.hpp) where bridge.transport = "mpi", else nothing.
  DistributedParticipant(const std::string &name, const Config &config,
                         const std::filesystem::path &out_dir, MPI_Comm ranks,
                         std::unique_ptr<Transport> transport = nullptr);

  /// `part` is this rank's part of the surface, node `a` of it the node `numbers[a]` of the whole,
  /// counted from 0 without gaps. Ranks may share nodes; a rank may have none (dim still set).
  void set_mesh(const InterfaceMesh &part, std::span<const int> numbers);
  /// `saved` counts on rank 0.
  void restore(std::span<const std::byte> saved);
  void initialize();

  bool is_coupling_ongoing() const { return state_.is_ongoing != 0; }
  bool is_time_window_complete() const { return state_.is_complete != 0; }
  double max_time_step_size() const { return state_.max_time_step_size; }
  bool requires_writing_checkpoint() const { return state_.must_write != 0; }
  bool requires_reading_checkpoint() const { return state_.must_read != 0; }
  double time() const { return state_.time; }
  long time_window() const { return state_.time_window; }
  int iteration() const { return state_.iteration; }

  bool requires_writing_restart() const { return state_.must_write_restart != 0; }
  /// On rank 0; empty on the others.
  std::vector<std::byte> saved_state();
  /// By one rank alone or several; all of them learn of it in the next advance.
  void request_stop() { wants_to_stop_ = true; }
  bool is_stopped() const { return state_.is_stopped != 0; }

  /// This rank's values, dim per node of its part. Where ranks share a node, its forces are summed,
  /// and of displacement and velocity the lowest rank's count.
  void write_data(std::string_view field, std::span<const double> values);
  void read_data(std::string_view field, double relative_time, std::span<double> values);
  /// `reason` is empty on the ranks that could do the window.
  void report_failure(std::string_view reason);
  void advance(double dt);
  void finalize();
  /// From one rank or several: the others learn of it in their next call.
  void abort(std::string_view message) noexcept;
  /// Sums over this rank's part; they are added up.
  void report_totals(const InterfaceTotals &totals);

private:
  struct State { // of rank 0's participant
    int is_ongoing = 1, is_complete = 0, must_write = 0, must_read = 0;
    int must_write_restart = 0, is_stopped = 0, iteration = 1;
    long time_window = 1;
    double max_time_step_size = 0, time = 0;
  };
  void agree(const std::string &problem = "");
  void act(const std::function<void(Participant &)> &action);
  std::string first_of(const std::string &text) const;
  void broadcast(std::string &text, int from) const;
  template <class T> std::vector<T> gathered(std::span<const T> own) const;
  void assemble(std::string_view field, const std::vector<double> &all);

  std::string name_;
  MPI_Comm ranks_;
  int rank_ = 0, n_ranks_ = 1;
  std::unique_ptr<Participant> bridge_; // rank 0
  State state_;
  bool is_over_ = false; // all ranks know of the end
  bool wants_to_stop_ = false;
  int dim_ = 2;
  std::size_t n_own_ = 0;            // values of this rank
  std::vector<int> numbers_;         // rank 0: of all nodes, rank by rank
  std::vector<int> counts_, starts_; // rank 0: values of each rank and where they begin
  std::vector<double> whole_;        // rank 0: a field on the whole surface
};

} // namespace sluice::bridge
