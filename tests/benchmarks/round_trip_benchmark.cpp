// SPDX-License-Identifier: MIT
// Round trip of one advance between two processes of one host: three components per node each way,
// serial-explicit, matching nodes (the map is the identity; its cost is reported apart), next to a
// bare TCP ping-pong of the same bytes in the same run. Prints a Markdown table of medians
// (minima). Usage: round_trip_benchmark [largest number of nodes, default 100000]
#include "bridge/mapping.hpp"
#include "bridge/participant.hpp"

#include <arpa/inet.h>
#include <fmt/format.h>
#include <netinet/tcp.h>
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

Times times_of(std::vector<double> samples) {
  samples.erase(samples.begin(), samples.begin() + static_cast<std::ptrdiff_t>(samples.size() / 5));
  std::sort(samples.begin(), samples.end());
  return {samples[samples.size() / 2], samples.front()};
}

long repetitions(std::size_t n_nodes) { return n_nodes > 20000 ? 150 : 1500; }

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

Times bare_tcp(std::size_t n_nodes) {
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
  return times_of(samples);
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
  Times advance;
  double start_up = 0; // [us] from nothing to the first data, both processes started together
};

RoundTrip through_bridge(const std::string &transport, std::size_t n_nodes) {
  std::string folder = std::filesystem::temp_directory_path() / "sluice-round-trip-XXXXXX";
  if (!::mkdtemp(folder.data()))
    std::abort();
  const Config config = config_for(transport, repetitions(n_nodes));
  RoundTrip result;
  const pid_t child = ::fork();
  if (child == 0) {
    echo(config, folder, n_nodes);
    ::_exit(0);
  }
  std::vector<double> values(3 * n_nodes, 1.0), samples;
  std::optional<Participant> bridge;
  result.start_up = timed([&] {
    bridge.emplace("fluid", config, folder);
    bridge->set_mesh(nodes_on_a_line(n_nodes));
    bridge->initialize();
  });
  while (bridge->is_coupling_ongoing())
    samples.push_back(timed([&] {
      bridge->write_data("force", values);
      bridge->advance(1);
      bridge->read_data("displacement", 0, values);
    }));
  bridge->finalize();
  bridge.reset();
  ::waitpid(child, nullptr, 0);
  std::filesystem::remove_all(folder);
  result.advance = times_of(samples);
  return result;
}

// Both products with the identity, as the fluid's side does them in a round trip.
double map_cost(std::size_t n_nodes) {
  const InterfaceMesh mesh = nodes_on_a_line(n_nodes);
  const Mapping map = make_mapping(MapKind::nearest, mesh, mesh);
  const std::vector<double> values(3 * n_nodes, 1.0);
  std::vector<double> samples;
  for (int k = 0; k < 50; ++k)
    samples.push_back(timed([&] {
      map.conservative(values);
      map.consistent(values);
    }));
  return times_of(samples).median;
}

} // namespace

int main(int argc, char **argv) {
  const long largest = argc > 1 ? std::atol(argv[1]) : 100000;
  fmt::print("| nodes | bare TCP | tcp | ratio | unix | ratio | shared | ratio | of which map | "
             "start-up ms (tcp, unix, shared) |\n|---|---|---|---|---|---|---|---|---|---|\n");
  for (const long nodes : {1L, 100L, 1000L, 10000L, 100000L}) {
    if (nodes > largest)
      break;
    const auto n = static_cast<std::size_t>(nodes);
    const Times bare = bare_tcp(n);
    const RoundTrip tcp = through_bridge("tcp", n), local = through_bridge("unix", n),
                    shared = through_bridge("shared", n);
    const double map = map_cost(n);
    const auto ratio = [&](const RoundTrip &trip) {
      return fmt::format("{:.2f}", (trip.advance.median - map) / bare.median);
    };
    fmt::print("| {} | {} | {} | {} | {} | {} | {} | {} | {:.0f} | {:.0f}, {:.0f}, {:.0f} |\n",
               nodes, bare.text(), tcp.advance.text(), ratio(tcp), local.advance.text(),
               ratio(local), shared.advance.text(), ratio(shared), map, 1e-3 * tcp.start_up,
               1e-3 * local.start_up, 1e-3 * shared.start_up);
    std::fflush(stdout);
  }
}
