// SPDX-License-Identifier: MIT
#include "solid-dealii/ranks_mpi.hpp"

#include <cstdlib>
#include <numeric>

namespace sluice::solid {
namespace {

// mpirun tells its children how many they are: Open MPI's and MPICH's.
bool is_one_of_several() {
  for (const char *name : {"OMPI_COMM_WORLD_SIZE", "PMI_SIZE"})
    if (const char *size = std::getenv(name))
      return std::atoi(size) > 1;
  return false;
}

int length(const std::vector<double> &list) { return static_cast<int>(list.size()); }

std::vector<int> starts_of(const std::vector<int> &lengths) {
  std::vector<int> starts(lengths.size() + 1, 0);
  std::partial_sum(lengths.begin(), lengths.end(), starts.begin() + 1);
  return starts;
}

Ranks::Lists cut(const std::vector<double> &all, const std::vector<int> &starts) {
  Ranks::Lists lists;
  for (std::size_t r = 0; r + 1 < starts.size(); ++r)
    lists.emplace_back(all.begin() + starts[r], all.begin() + starts[r + 1]);
  return lists;
}

double reduced(double value, MPI_Op operation, const Ranks &ranks) {
  if (!ranks.is_one())
    MPI_Allreduce(MPI_IN_PLACE, &value, 1, MPI_DOUBLE, operation, ranks.communicator().mpi);
  return value;
}

} // namespace

void start_mpi() {
  int is_started = 0;
  MPI_Initialized(&is_started);
  if (is_started != 0)
    return;
  // Open MPI would start a daemon for a process on its own unless told that it stays alone.
  if (!is_one_of_several())
    setenv("OMPI_MCA_ess_singleton_isolated", "1", 0);
  int provided = 0; // the bridge's threads call no MPI
  MPI_Init_thread(nullptr, nullptr, MPI_THREAD_FUNNELED, &provided);
  std::atexit([] { MPI_Finalize(); });
}

MPI_Comm mpi_communicator(const Ranks &ranks) {
  start_mpi();
  return ranks.is_one() ? MPI_COMM_SELF : ranks.communicator().mpi;
}

Ranks Ranks::of_launch() {
  Ranks ranks;
  if (!is_one_of_several())
    return ranks;
  start_mpi();
  ranks.communicator_ = std::make_shared<Communicator>(Communicator{MPI_COMM_WORLD});
  MPI_Comm_size(MPI_COMM_WORLD, &ranks.size_);
  MPI_Comm_rank(MPI_COMM_WORLD, &ranks.rank_);
  return ranks;
}

double Ranks::sum(double value) const { return reduced(value, MPI_SUM, *this); }
double Ranks::min(double value) const { return reduced(value, MPI_MIN, *this); }
double Ranks::max(double value) const { return reduced(value, MPI_MAX, *this); }

double Ranks::sum_before(double value) const {
  double before = 0;
  if (!is_one())
    MPI_Exscan(&value, &before, 1, MPI_DOUBLE, MPI_SUM, communicator_->mpi);
  return is_root() ? 0 : before; // the lowest rank's is undefined
}

double Ranks::from_root(double value) const {
  if (!is_one())
    MPI_Bcast(&value, 1, MPI_DOUBLE, 0, communicator_->mpi);
  return value;
}

Ranks::Lists Ranks::gather_everywhere(const std::vector<double> &mine) const {
  if (is_one())
    return {mine};
  const int n = length(mine);
  std::vector<int> lengths(static_cast<std::size_t>(size_));
  MPI_Allgather(&n, 1, MPI_INT, lengths.data(), 1, MPI_INT, communicator_->mpi);
  const auto starts = starts_of(lengths);
  std::vector<double> all(static_cast<std::size_t>(starts.back()));
  MPI_Allgatherv(mine.data(), n, MPI_DOUBLE, all.data(), lengths.data(), starts.data(), MPI_DOUBLE,
                 communicator_->mpi);
  return cut(all, starts);
}

Ranks::Lists Ranks::gather(const std::vector<double> &mine) const {
  if (is_one())
    return {mine};
  const int n = length(mine);
  std::vector<int> lengths(is_root() ? static_cast<std::size_t>(size_) : 0);
  MPI_Gather(&n, 1, MPI_INT, lengths.data(), 1, MPI_INT, 0, communicator_->mpi);
  const auto starts = starts_of(lengths);
  std::vector<double> all(static_cast<std::size_t>(starts.back()));
  MPI_Gatherv(mine.data(), n, MPI_DOUBLE, all.data(), lengths.data(), starts.data(), MPI_DOUBLE, 0,
              communicator_->mpi);
  return cut(all, starts);
}

std::vector<double> Ranks::scatter(const Lists &of_root) const {
  if (is_one())
    return of_root.front();
  std::vector<int> lengths;
  std::vector<double> all;
  for (const auto &list : of_root) {
    lengths.push_back(length(list));
    all.insert(all.end(), list.begin(), list.end());
  }
  int n = 0;
  MPI_Scatter(lengths.data(), 1, MPI_INT, &n, 1, MPI_INT, 0, communicator_->mpi);
  std::vector<double> mine(static_cast<std::size_t>(n));
  MPI_Scatterv(all.data(), lengths.data(), starts_of(lengths).data(), MPI_DOUBLE, mine.data(), n,
               MPI_DOUBLE, 0, communicator_->mpi);
  return mine;
}

Ranks::Lists Ranks::exchange(std::span<const int> partners, const Lists &lists) const {
  Lists received(lists);
  std::vector<MPI_Request> requests;
  for (std::size_t k = 0; k < partners.size(); ++k) {
    MPI_Irecv(received[k].data(), length(received[k]), MPI_DOUBLE, partners[k], 0,
              communicator_->mpi, &requests.emplace_back());
    MPI_Isend(lists[k].data(), length(lists[k]), MPI_DOUBLE, partners[k], 0, communicator_->mpi,
              &requests.emplace_back());
  }
  MPI_Waitall(static_cast<int>(requests.size()), requests.data(), MPI_STATUSES_IGNORE);
  return received;
}

void Ranks::abort() const {
  if (!is_one())
    MPI_Abort(communicator_->mpi, 1);
}

} // namespace sluice::solid
