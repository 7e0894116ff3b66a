// SPDX-License-Identifier: MIT
#include "tests/fuzz/wire_input.hpp"

#include "bridge/participant.hpp"
#include "bridge/transport_local.hpp"
#include "tests/support/allocation_counter.hpp"

#include <algorithm>
#include <thread>
#include <utility>

namespace sluice::bridge {
namespace {

// Two windows; the second may be halved once.
const Config &config() {
  static const Config parsed =
      Config::parse("[case]\nname = \"wire\"\nend_time_s = 2e-3\ntime_step_s = 1e-3\n"
                    "[bridge]\ntoken = \"open\"\nmax_iterations = 4\nmax_halvings = 1\n",
                    "wire.toml");
  return parsed;
}

// A column of water against a wall that gives way: enough to iterate.
void run(Participant &bridge, bool is_solid) {
  bridge.set_mesh(is_solid ? InterfaceMesh{2, 2, {0, 0, 0, 0.5, 0, 1}, {0, 1, 1, 2}}
                           : InterfaceMesh{2, 2, {0, 0, 0, 0.3, 0, 0.7, 0, 1}, {0, 1, 1, 2, 2, 3}});
  bridge.initialize();
  std::vector<double> motion(bridge.mesh().positions.size()), force(motion.size());
  while (bridge.is_coupling_ongoing()) {
    const double dt = bridge.max_time_step_size();
    if (is_solid) {
      bridge.read_data("force", dt, force);
      for (std::size_t k = 0; k < motion.size(); ++k)
        motion[k] = 1e-4 * force[k];
      bridge.write_data("displacement", motion);
      bridge.write_data("velocity", motion);
    } else {
      bridge.read_data("displacement", dt, motion);
      for (std::size_t k = 0; k < motion.size(); ++k)
        force[k] = 1 - motion[k];
      bridge.write_data("force", force);
    }
    bridge.advance(dt);
  }
  bridge.finalize();
}

// Says nothing that anybody hears, and hears what it was given.
class ScriptedTransport final : public Transport {
public:
  ScriptedTransport(Bytes bytes, std::size_t &received)
      : bytes_(std::move(bytes)), received_(received) {}
  std::size_t write_some(Pieces pieces, Deadline) override { return pieces.front().size(); }
  std::size_t read_some(std::span<std::byte> into, Deadline) override {
    const std::size_t n = std::min(into.size(), bytes_.size() - received_);
    if (n == 0)
      throw ConnectionLost("end of the input");
    std::copy_n(bytes_.begin() + static_cast<std::ptrdiff_t>(received_), n, into.begin());
    received_ += n;
    return n;
  }
  bool can_write() override { return false; } // no heartbeats

private:
  Bytes bytes_;
  std::size_t &received_;
};

Bytes framed(std::span<const std::byte> records) {
  Bytes stream;
  for (std::uint64_t sequence = 0; records.size() >= 3; ++sequence) {
    const auto type = std::to_integer<std::uint16_t>(records[0]);
    const std::size_t announced =
        std::to_integer<std::size_t>(records[1]) + 256 * std::to_integer<std::size_t>(records[2]);
    const std::size_t length = std::min(announced, records.size() - 3);
    const Bytes frame =
        encode_frame(static_cast<FrameType>(type), sequence, records.subspan(3, length));
    stream.insert(stream.end(), frame.begin(), frame.end());
    records = records.subspan(3 + length);
  }
  return stream;
}

// Passes everything on and keeps what it heard, as records.
class RecordingTransport final : public Transport {
public:
  RecordingTransport(std::unique_ptr<Transport> inner, Bytes &heard)
      : inner_(std::move(inner)), heard_(heard) {}
  std::size_t write_some(Pieces pieces, Deadline deadline) override {
    return inner_->write_some(pieces, deadline);
  }
  std::size_t read_some(std::span<std::byte> into, Deadline deadline) override {
    const std::size_t n = inner_->read_some(into, deadline);
    heard_.insert(heard_.end(), into.begin(), into.begin() + static_cast<std::ptrdiff_t>(n));
    return n;
  }
  bool can_write() override { return false; }

private:
  std::unique_ptr<Transport> inner_;
  Bytes &heard_;
};

Bytes input_of(std::span<const std::byte> stream, bool is_solid) {
  Bytes input{std::byte{is_solid}};
  while (stream.size() >= header_size) {
    const FrameHeader header = decode_header(stream.first<header_size>());
    const auto payload = stream.subspan(header_size, header.length);
    for (const std::uint64_t byte :
         {static_cast<std::uint64_t>(header.type), header.length % 256, header.length / 256})
      input.push_back(static_cast<std::byte>(byte));
    input.insert(input.end(), payload.begin(), payload.end());
    stream = stream.subspan(header_size + header.length);
  }
  return input;
}

} // namespace

Reception receive(std::span<const std::byte> input, const std::filesystem::path &folder) {
  Reception reception;
  if (input.empty())
    return reception;
  const auto kind = std::to_integer<unsigned>(input.front());
  const bool is_solid = kind & 1;
  const auto rest = input.subspan(1);
  auto transport = std::make_unique<ScriptedTransport>(
      kind & 2 ? Bytes(rest.begin(), rest.end()) : framed(rest), reception.received);
  const Config &settings = config();
  sluice::testing::begin_peak_memory();
  try {
    Participant bridge(is_solid ? "solid" : "fluid", settings, folder, std::move(transport));
    run(bridge, is_solid);
  } catch (const UserError &error) {
    reception.error = error.what();
  }
  reception.memory = sluice::testing::peak_memory();
  return reception;
}

std::size_t memory_limit(std::size_t received) {
  constexpr std::size_t own = 1 << 18, chunk = 1 << 20;
  return own + chunk + 64 * received;
}

Conversations record_conversations(const std::filesystem::path &folder) {
  Bytes fluid_heard, solid_heard;
  auto [fluid_end, solid_end] = local_transports();
  std::thread fluid([&, &end = fluid_end] {
    Participant bridge("fluid", config(), folder,
                       std::make_unique<RecordingTransport>(std::move(end), fluid_heard));
    run(bridge, false);
  });
  Participant bridge("solid", config(), folder,
                     std::make_unique<RecordingTransport>(std::move(solid_end), solid_heard));
  run(bridge, true);
  fluid.join();
  return {input_of(fluid_heard, false), input_of(solid_heard, true)};
}

} // namespace sluice::bridge
