// SPDX-License-Identifier: MIT
// The piston of piston.hpp on any number of ranks, for mpi_test.py:
//   mpirun -n N mpi_piston fluid CASE.toml OUT : -n M mpi_piston solid CASE.toml OUT
// The solid's rank 0 prints the displacement after each window. With BAD_RANK=program:rank that
// rank fails in the third window; with SPLIT=0 the two programs meet over a socket instead; with
// FROM=FOLDER they go on from what a run has left there; with STOPPED_RANK=program:rank that rank
// is told to stop in the third window; with LOW_LEVEL=program that one asks MPI for too few
// threads; with STALL=1 one long message comes later than its deadline, and nothing else.
#include "bridge/message.hpp"
#include "bridge/participant_distributed.hpp"
#include "bridge/transport_mpi.hpp"

#include "piston.hpp"

#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <fstream>

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

std::string wish(const char *name) {
  const char *value = std::getenv(name);
  return value ? value : "";
}

void fail_here(const std::string &program, int rank, int window) {
  check(window != 3 || wish("BAD_RANK") != fmt::format("{}:{}", program, rank),
        "the solver of rank {} broke down", rank);
}

void stop_here(DistributedParticipant &bridge, const std::string &program, int rank, int window) {
  if (window == 3 && wish("STOPPED_RANK") == fmt::format("{}:{}", program, rank))
    bridge.request_stop();
}

// ---- what a restart needs, kept by rank 0; the solid's state is its motion
// -----------------------

struct Motion {
  double displacement, velocity;
};

std::vector<std::byte> bytes_of(const std::filesystem::path &file) {
  std::ifstream in(file, std::ios::binary);
  const std::string text{std::istreambuf_iterator<char>(in), {}};
  const auto bytes = std::as_bytes(std::span(text));
  return {bytes.begin(), bytes.end()};
}

void write(const std::filesystem::path &file, std::span<const std::byte> bytes) {
  std::ofstream(file, std::ios::binary)
      .write(reinterpret_cast<const char *>(bytes.data()), std::ssize(bytes));
}

void restore(DistributedParticipant &bridge, const std::string &program) {
  if (!wish("FROM").empty())
    bridge.restore(bytes_of(std::filesystem::path(wish("FROM")) / program));
}

void keep(DistributedParticipant &bridge, const std::filesystem::path &file, int rank) {
  const auto saved = bridge.saved_state();
  EXPECT_EQ(saved.empty(), rank != 0);
  if (rank == 0)
    write(file, saved);
}

void run_fluid(DistributedParticipant &bridge, const Piston &piston, const Part &part, int rank,
               const std::filesystem::path &folder) {
  const std::size_t n = part.mesh.positions.size();
  bridge.set_mesh(part.mesh, part.numbers);
  restore(bridge, "fluid");
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
    stop_here(bridge, "fluid", rank, window);
    bridge.write_data("force", force);
    bridge.advance(dt);
    window += bridge.is_time_window_complete();
    if (bridge.requires_writing_restart())
      keep(bridge, folder / "fluid", rank);
  }
  bridge.finalize();
}

void run_solid(DistributedParticipant &bridge, const Piston &piston, const Part &part, int rank,
               MPI_Comm ranks, const std::filesystem::path &folder) {
  const std::size_t n = part.mesh.positions.size();
  const auto along_x = [&](double value) {
    std::vector<double> values(n, 0.0);
    for (std::size_t k = 0; k < n; k += 2)
      values[k] = value;
    return values;
  };
  Motion motion{piston.start, 0};
  if (const auto from = wish("FROM"); !from.empty())
    std::memcpy(&motion, bytes_of(std::filesystem::path(from) / "motion").data(), sizeof motion);
  double d = motion.displacement, v = motion.velocity, saved_d = d, saved_v = v;
  bridge.set_mesh(part.mesh, part.numbers);
  bridge.write_data("displacement", along_x(d));
  restore(bridge, "solid");
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
    stop_here(bridge, "solid", rank, window);
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
    if (bridge.requires_writing_restart()) {
      motion = {d, v};
      keep(bridge, folder / "solid", rank);
      write(folder / "motion", std::as_bytes(std::span(&motion, 1)));
    }
  }
  bridge.finalize();
}

// The sender leaves MPI alone while its message is under way; the receiver gives up, throws its
// memory away, and asks again.
void exchange_late_message(const std::string &name, Transport &transport) {
  using std::chrono::milliseconds;
  constexpr std::size_t length = 8 << 20;
  const auto byte_at = [](std::size_t k) { return static_cast<std::byte>(k * 2654435761u >> 16); };
  if (name == "fluid") {
    Bytes sent(length);
    for (std::size_t k = 0; k < length; ++k)
      sent[k] = byte_at(k);
    check(transport.write_some(sent, deadline_in(0.01)) == length, "not taken over");
    std::fill(sent.begin(), sent.end(), std::byte{0}); // the transport's own copy counts
    std::this_thread::sleep_for(milliseconds(500));
    while (!transport.can_write())
      std::this_thread::sleep_for(milliseconds(1));
    return;
  }
  std::this_thread::sleep_for(milliseconds(100));
  std::size_t received = 0;
  for (int asked = 0; received < length; ++asked) {
    Bytes room(length - received);
    const std::size_t n = transport.read_some(room, deadline_in(asked == 0 ? 0.1 : 20));
    for (std::size_t k = 0; k < n; ++k, ++received)
      check(room[k] == byte_at(received), "byte {} is wrong", received);
    check(n > 0 || asked == 0, "nothing came");
  }
  std::printf("%zu bytes\n", received);
}

int run(const std::string &name, const Config &config, const std::string &folder) {
  MpiProgram program;
  try {
    program.ranks = MPI_COMM_WORLD;
    if (wish("SPLIT") != "0")
      program = join_programs(role_of(name), MPI_COMM_WORLD);
    if (wish("STALL") == "1") {
      exchange_late_message(name, *program.transport);
      return 0;
    }
  } catch (const std::exception &error) {
    std::fprintf(stderr, "[%s] %s\n", name.c_str(), error.what());
    return 1;
  }
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
        run_fluid(bridge, piston, part, rank, folder);
      else
        run_solid(bridge, piston, part, rank, program.ranks, folder);
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
  const bool is_low = argc > 1 && sluice::bridge::wish("LOW_LEVEL") == argv[1];
  int level = 0;
  MPI_Init_thread(&argc, &argv, is_low ? MPI_THREAD_FUNNELED : MPI_THREAD_MULTIPLE, &level);
  const int status =
      argc == 4 ? sluice::bridge::run(argv[1], sluice::Config::load(argv[2]), argv[3]) : 2;
  MPI_Finalize();
  return status;
}
