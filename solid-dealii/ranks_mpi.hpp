// SPDX-License-Identifier: MIT
// MPI as the files see it that call a library which wants a communicator.
#pragma once

#include "solid-dealii/ranks.hpp"

#include <mpi.h>

namespace sluice::solid {

struct Ranks::Communicator {
  MPI_Comm mpi;
};

/// Starts MPI where nobody has, and ends it with the program.
void start_mpi();

/// That of all ranks; of this process alone where it is one (MPI is started then: libraries want
/// it).
MPI_Comm mpi_communicator(const Ranks &ranks);

} // namespace sluice::solid
