// SPDX-License-Identifier: MIT
// Round trip of one advance between two processes of one host: three components per node each way,
// serial-explicit, nodes that match, next to a bare TCP ping-pong of the same bytes in the same
// run. The time of advance() includes what the partner does meanwhile: read_data and write_data of
// all values. Prints a Markdown table of medians (minima) in microseconds. Usage:
//   round_trip_benchmark [own | free] [largest number of nodes, default 100000]
// own (default): each process stays on a core of its own; free: as the scheduler places them.
#include "bridge/mapping.hpp"
#include "bridge/participant.hpp"

#include <arpa/inet.h>
#include <fmt/format.h>
#include <netinet/tcp.h>
#include <sched.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

using namespace sluice;
using namespace sluice::bridge;

namespace {

using Microseconds = std::chrono::duration<double, std::micro>;

struct Times {
  double median = 0, least = 0; // [us]
  std::string text() const { return fmt::format("{:.0f} ({:.0f})", median, least); }
};

template <class Body> double timed(Body &&body) {
  const auto begin = std::chrono::steady_clock::now();
  body();
  return Microseconds(std::chrono::steady_clock::now() - begin).count();
}

// The measurements take turns, as a machine is never the same for long.
constexpr int rounds = 6;
long repetitions(std::size_t n_nodes) { return n_nodes > 20000 ? 40 : 500; } // of a round

class Samples {
public:
  /// The first fifth of a round warms up.
  void add(const std::vector<double> &round) {
    const auto warm = round.begin() + static_cast<std::ptrdiff_t>(round.size() / 5);
    all_.insert(all_.end(), warm, round.end());
  }
  Times times() {
    std::sort(all_.begin(), all_.end());
    return {all_[all_.size() / 2], all_.front()};
  }

private:
  std::vector<double> all_;
};

// Parent and child of a measurement.
enum class Program { measuring = 0, answering = 1 };
bool has_own_core = true;

void take_place(Program program) {
  cpu_set_t cores;
  CPU_ZERO(&cores);
  CPU_SET(static_cast<int>(program), &cores);
  if (has_own_core)
    ::sched_setaffinity(0, sizeof cores, &cores);
}

// ---- bare TCP -----------------------------------------------------------------------------------

void send_all(int socket, const std::vector<char> &bytes) {
  for (std::size_t k = 0; k < bytes.size();)
    k += static_cast<std::size_t>(
        std::max<ssize_t>(0, ::send(socket, bytes.data() + k, bytes.size() - k, 0)));
}
void receive_all(int socket, std::vector<char> &bytes) {
  for (std::size_t k = 0; k < bytes.size();)
    k += static_cast<std::size_t>(
        std::max<ssize_t>(0, ::recv(socket, bytes.data() + k, bytes.size() - k, 0)));
}

std::vector<double> bare_tcp(std::size_t n_nodes) {
  const long n = repetitions(n_nodes);
  std::vector<char> bytes(24 * n_nodes, 'x');
  const int listener = ::socket(AF_INET, SOCK_STREAM, 0);
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  socklen_t size = sizeof address;
  ::bind(listener, reinterpret_cast<sockaddr *>(&address), size);
  ::getsockname(listener, reinterpret_cast<sockaddr *>(&address), &size);
  ::listen(listener, 1);
  const int on = 1;
  const pid_t child = ::fork();
  if (child == 0) {
    take_place(Program::answering);
    const int socket = ::socket(AF_INET, SOCK_STREAM, 0);
    ::connect(socket, reinterpret_cast<sockaddr *>(&address), sizeof address);
    ::setsockopt(socket, IPPROTO_TCP, TCP_NODELAY, &on, sizeof on);
    for (long k = 0; k < n; ++k) {
      receive_all(socket, bytes);
      send_all(socket, bytes);
    }
    ::_exit(0);
  }
  const int socket = ::accept(listener, nullptr, nullptr);
  ::setsockopt(socket, IPPROTO_TCP, TCP_NODELAY, &on, sizeof on);
  std::vector<double> samples;
  for (long k = 0; k < n; ++k)
    samples.push_back(timed([&] {
      send_all(socket, bytes);
      receive_all(socket, bytes);
    }));
  ::waitpid(child, nullptr, 0);
  ::close(socket);
  ::close(listener);
  return samples;
}

// ---- the bridge ---------------------------------------------------------------------------------

InterfaceMesh nodes_on_a_line(std::size_t n) {
  InterfaceMesh mesh{3, 3, {}, {}};
  for (std::size_t k = 0; k < n; ++k)
    mesh.positions.insert(mesh.positions.end(), {static_cast<double>(k), 0, 0});
  return mesh;
}

Config config_for(const std::string &transport, long windows) {
  return Config::parse(fmt::format("[case]\nname = \"echo\"\nend_time_s = {}\ntime_step_s = 1\n"
                                   "[bridge]\ntransport = \"{}\"\nscheme = \"serial-explicit\"\n"
                                   "mapping = \"nearest\"\nmotion = \"displacement\"\n",
                                   windows, transport),
                       "echo.toml");
}

void echo(const Config &config, const std::string &folder, std::size_t n_nodes) {
  Participant bridge("solid", config, folder);
  bridge.set_mesh(nodes_on_a_line(n_nodes));
  bridge.initialize();
  std::vector<double> values(3 * n_nodes);
  while (bridge.is_coupling_ongoing()) {
    bridge.read_data("force", bridge.max_time_step_size(), values);
    bridge.write_data("displacement", values);
    bridge.advance(bridge.max_time_step_size());
  }
  bridge.finalize();
}

struct RoundTrip {
  Samples advance, copies, start_up; // start-up: from nothing to the first data, of both processes
};

void through_bridge(const std::string &transport, std::size_t n_nodes, RoundTrip &result) {
  std::string folder = std::filesystem::temp_directory_path() / "sluice-round-trip-XXXXXX";
  if (!::mkdtemp(folder.data()))
    std::abort();
  const Config config = config_for(transport, repetitions(n_nodes));
  const pid_t child = ::fork();
  if (child == 0) {
    take_place(Program::answering);
    echo(config, folder, n_nodes);
    ::_exit(0);
  }
  std::vector<double> values(3 * n_nodes, 1.0), advance, copies;
  std::optional<Participant> bridge;
  result.start_up.add({timed([&] {
    bridge.emplace("fluid", config, folder);
    bridge->set_mesh(nodes_on_a_line(n_nodes));
    bridge->initialize();
  })});
  while (bridge->is_coupling_ongoing()) {
    const double write = timed([&] { bridge->write_data("force", values); });
    advance.push_back(timed([&] { bridge->advance(1); }));
    copies.push_back(write + timed([&] { bridge->read_data("displacement", 0, values); }));
  }
  bridge->finalize();
  bridge.reset();
  ::waitpid(child, nullptr, 0);
  std::filesystem::remove_all(folder);
  result.advance.add(advance);
  result.copies.add(copies);
}

// Both products with as many entries as nodes: what any other map costs at least, which the bridge
// leaves out where the nodes match.
double map_cost(std::size_t n_nodes) {
  const InterfaceMesh mesh = nodes_on_a_line(n_nodes);
  const Mapping map = make_mapping(MapKind::nearest, mesh, mesh);
  std::vector<double> values(3 * n_nodes, 1.0), mapped(3 * n_nodes);
  std::vector<double> times;
  for (int k = 0; k < 50; ++k)
    times.push_back(timed([&] {
      map.conservative(values, mapped);
      map.consistent(mapped, values);
    }));
  Samples samples;
  samples.add(times);
  return samples.times().median;
}

void print_row(std::size_t n_nodes) {
  Samples bare;
  RoundTrip tcp, local, shared;
  for (int round = 0; round < rounds; ++round) {
    bare.add(bare_tcp(n_nodes));
    through_bridge("tcp", n_nodes, tcp);
    through_bridge("unix", n_nodes, local);
    through_bridge("shared", n_nodes, shared);
  }
  const Times reference = bare.times();
  fmt::print("| {} | {}", n_nodes, reference.text());
  for (RoundTrip *trip : {&tcp, &local, &shared}) {
    const Times times = trip->advance.times();
    fmt::print(" | {} | {:.2f} ({:.2f})", times.text(), times.median / reference.median,
               times.least / reference.least);
  }
  fmt::print(" | {:.0f} | {:.0f}", shared.copies.times().median, map_cost(n_nodes));
  for (RoundTrip *trip : {&tcp, &local, &shared})
    fmt::print("{} {:.1f}", trip == &tcp ? " |" : ",", 1e-3 * trip->start_up.times().median);
  fmt::print(" |\n");
  std::fflush(stdout);
}

} // namespace

int main(int argc, char **argv) {
  has_own_core = argc < 2 || std::string(argv[1]) != "free";
  const long largest = argc > 2 ? std::atol(argv[2]) : 100000;
  take_place(Program::measuring);
  fmt::print(
      "| nodes | bare TCP | tcp | ratio | unix | ratio | shared | ratio | own write and read "
      "| map, if not identity | start-up ms (tcp, unix, shared) |\n"
      "|---|---|---|---|---|---|---|---|---|---|---|\n");
  for (const long nodes : {1L, 100L, 1000L, 10000L, 100000L})
    if (nodes <= largest)
      print_row(static_cast<std::size_t>(nodes));
}
