// SPDX-License-Identifier: MIT
// Two programs in one mpirun that speak through MPI instead of a socket:
//
//   mpirun -n 3 my-fluid case.toml : -n 2 my-solid case.toml
//
// The ranks are split into the two programs; rank 0 of each speaks for it. A heartbeat is sent
// while a solver computes, by a thread: MPI must be initialised with MPI_THREAD_MULTIPLE.
#pragma once

#include "bridge/connection.hpp"
#include "bridge/transport.hpp"

#include <algorithm>
#include <memory>
#include <thread>

#include <mpi.h>

namespace sluice::bridge {

/// One of the two programs, as each of its ranks sees it.
struct MpiProgram {
  MPI_Comm ranks = MPI_COMM_NULL;       ///< of this program, in place of MPI_COMM_WORLD
  std::unique_ptr<Transport> transport; ///< rank 0: to rank 0 of the other program; else nothing
};

/// Collective over `world`. Throws UserError on every rank when one of the programs is missing or
/// MPI gives a lower level of thread support. `ranks` stays until MPI ends.
MpiProgram join_programs(Role self, MPI_Comm world);

/// Until `is_ready`; false when `deadline` passed first. Looks for the time that a small message
/// takes, then sleeps between two looks, for an eighth of the time waited so far and a millisecond
/// at most: MPI's own waits take a whole core.
template <class Ready> bool wait_for_mpi(Deadline deadline, Ready &&is_ready) {
  using std::chrono::microseconds;
  const auto begin = Clock::now();
  while (!is_ready()) {
    const auto now = Clock::now();
    if (now >= deadline)
      return false;
    if (now - begin > microseconds(50))
      std::this_thread::sleep_for(std::min<Clock::duration>((now - begin) / 8, microseconds(1000)));
  }
  return true;
}

} // namespace sluice::bridge
