// SPDX-License-Identifier: MIT
// The piston of piston.hpp on any number of ranks, for mpi_test.py:
//   mpirun -n N mpi_piston fluid CASE.toml OUT : -n M mpi_piston solid CASE.toml OUT
// The solid's rank 0 prints the displacement after each window. With BAD_RANK=program:rank that
// rank fails in the third window; with SPLIT=0 the two programs meet over a socket instead.
#include "bridge/participant_distributed.hpp"
#include "bridge/transport_mpi.hpp"

#include "piston.hpp"

#include <cstdio>
#include <cstdlib>

namespace sluice::bridge {
namespace {

// The faces of one rank: shares that grow with the rank, so that they are uneven; nodes between two
// ranks belong to both.
struct Part {
  InterfaceMesh mesh;
  std::vector<int> numbers; // of its nodes in the whole
  std::size_t first_face = 0;
};

Part part_of(const InterfaceMesh &whole, int rank, int n_ranks) {
  const auto faces_before = [&](int r) {
    return static_cast<int>(whole.n_faces()) * r * (r + 1) / (n_ranks * (n_ranks + 1));
  };
  const int first = faces_before(rank), end = faces_before(rank + 1);
  Part part{{whole.dim, whole.nodes_per_face, {}, {}}, {}, static_cast<std::size_t>(first)};
  for (int node = first; end > first && node <= end; ++node) {
    const auto x = whole.position(static_cast<std::size_t>(node));
    part.mesh.positions.insert(part.mesh.positions.end(), x.begin(), x.end());
    part.numbers.push_back(node);
    if (node < end)
      part.mesh.faces.insert(part.mesh.faces.end(), {node - first, node - first + 1});
  }
  return part;
}

void fail_here(const std::string &program, int rank, int window) {
  const char *bad = std::getenv("BAD_RANK");
  check(!bad || window != 3 || bad != fmt::format("{}:{}", program, rank),
        "the solver of rank {} broke down", rank);
}

void run_fluid(DistributedParticipant &bridge, const Piston &piston, const Part &part, int rank) {
  const std::size_t n = part.mesh.positions.size();
  bridge.set_mesh(part.mesh, part.numbers);
  bridge.initialize();
  std::vector<double> before(n), after(n), force(n);
  for (int window = 1; bridge.is_coupling_ongoing();) {
    const double dt = bridge.max_time_step_size();
    bridge.read_data("velocity", 0, before);
    bridge.read_data("velocity", dt, after);
    std::fill(force.begin(), force.end(), 0.0);
    for (std::size_t f = 0; f < part.mesh.n_faces(); ++f) {
      const double length = part.mesh.position(f + 1)[1] - part.mesh.position(f)[1];
      for (const std::size_t node : {f, f + 1})
        force[2 * node] -=
            piston.added_mass * length / 2 * (after[2 * node] - before[2 * node]) / dt;
    }
    fail_here("fluid", rank, window);
    bridge.write_data("force", force);
    bridge.advance(dt);
    window += bridge.is_time_window_complete();
  }
  bridge.finalize();
}

void run_solid(DistributedParticipant &bridge, const Piston &piston, const Part &part, int rank,
               MPI_Comm ranks) {
  const std::size_t n = part.mesh.positions.size();
  const auto along_x = [&](double value) {
    std::vector<double> values(n, 0.0);
    for (std::size_t k = 0; k < n; k += 2)
      values[k] = value;
    return values;
  };
  double d = piston.start, v = 0, saved_d = d, saved_v = v;
  bridge.set_mesh(part.mesh, part.numbers);
  bridge.write_data("displacement", along_x(d));
  bridge.initialize();
  std::vector<double> force(n);
  for (int window = 1; bridge.is_coupling_ongoing();) {
    if (bridge.requires_writing_checkpoint()) {
      saved_d = d;
      saved_v = v;
    }
    const double dt = bridge.max_time_step_size();
    bridge.read_data("force", dt, force);
    double own = 0, sum = 0; // a node that the rank before has too is counted there
    for (std::size_t k = part.first_face > 0 ? 2 : 0; k < n; k += 2)
      own += force[k];
    MPI_Allreduce(&own, &sum, 1, MPI_DOUBLE, MPI_SUM, ranks);
    const double m = piston.structure_mass, k = piston.stiffness;
    const double v_new =
        (m * v + dt * sum - dt * k * (d + 0.25 * dt * v)) / (m + 0.25 * dt * dt * k);
    d += 0.5 * dt * (v + v_new);
    v = v_new;
    fail_here("solid", rank, window);
    bridge.write_data("displacement", along_x(d));
    bridge.write_data("velocity", along_x(v));
    bridge.advance(dt);
    if (bridge.requires_reading_checkpoint()) {
      d = saved_d;
      v = saved_v;
      continue;
    }
    ++window;
    if (rank == 0)
      std::printf("%.17g\n", d);
  }
  bridge.finalize();
}

int run(const std::string &name, const Config &config, const std::string &folder) {
  MpiProgram program;
  const char *split = std::getenv("SPLIT");
  if (split && *split == '0')
    program.ranks = MPI_COMM_WORLD;
  else
    program = join_programs(role_of(name), MPI_COMM_WORLD);
  Piston piston;
  piston.added_mass = 5;
  int rank = 0, n_ranks = 1;
  MPI_Comm_rank(program.ranks, &rank);
  MPI_Comm_size(program.ranks, &n_ranks);
  try {
    DistributedParticipant bridge(name, config, folder, program.ranks,
                                  std::move(program.transport));
    try {
      const Part part = part_of(name == "fluid" ? fluid_line() : solid_line(), rank, n_ranks);
      if (name == "fluid")
        run_fluid(bridge, piston, part, rank);
      else
        run_solid(bridge, piston, part, rank, program.ranks);
    } catch (const std::exception &error) {
      bridge.abort(error.what());
      throw;
    }
  } catch (const std::exception &error) {
    std::fprintf(stderr, "[%s %d] %s\n", name.c_str(), rank, error.what());
    return 1;
  }
  return 0;
}

} // namespace
} // namespace sluice::bridge

int main(int argc, char **argv) {
  int level = 0;
  MPI_Init_thread(&argc, &argv, MPI_THREAD_MULTIPLE, &level);
  const int status =
      argc == 4 ? sluice::bridge::run(argv[1], sluice::Config::load(argv[2]), argv[3]) : 2;
  MPI_Finalize();
  return status;
}
