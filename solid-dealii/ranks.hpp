// SPDX-License-Identifier: MIT
// The processes (MPI ranks) that share one body: sums, extremes, messages. A process on its own
// needs no MPI and starts none.
#pragma once

#include <Eigen/Core>

#include <memory>
#include <span>
#include <vector>

namespace sluice::solid {

class Ranks {
public:
  /// One process.
  Ranks() = default;
  /// All processes that mpirun has started together with this one; this one where it has not.
  static Ranks of_launch();

  int size() const { return size_; }
  int rank() const { return rank_; }
  bool is_one() const { return size_ == 1; }
  /// The rank that speaks to the partner, the terminal and most files.
  bool is_root() const { return rank_ == 0; }

  double sum(double value) const;
  double min(double value) const;
  double max(double value) const;
  template <int n>
  Eigen::Matrix<double, n, 1> sum(Eigen::Matrix<double, n, 1> values) const { // of every entry
    for (double &value : values)
      value = sum(value);
    return values;
  }
  /// Of the ranks below this one.
  double sum_before(double value) const;
  /// What the root has.
  double from_root(double value) const;

  using Lists = std::vector<std::vector<double>>;
  /// One list per rank: on every rank, or on the root only (elsewhere none).
  Lists gather_everywhere(const std::vector<double> &mine) const;
  Lists gather(const std::vector<double> &mine) const;
  /// Every rank's own of the root's lists; those of other ranks do not count.
  std::vector<double> scatter(const Lists &of_root) const;
  /// Sends lists[k] to rank partners[k], and returns the lists of equal size that come from there.
  Lists exchange(std::span<const int> partners, const Lists &lists) const;

  /// Ends the processes of all ranks. For a program's main after an error, which only one rank may
  /// have met; does nothing for one process.
  void abort() const;

  /// MPI's communicator; defined in ranks_mpi.hpp.
  struct Communicator;
  const Communicator &communicator() const { return *communicator_; }

private:
  int size_ = 1, rank_ = 0;
  std::shared_ptr<const Communicator> communicator_; // none for one process
};

} // namespace sluice::solid
