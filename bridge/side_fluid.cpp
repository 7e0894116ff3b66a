// SPDX-License-Identifier: MIT
// The fluid's end: holds the map, sends mapped forces, receives the solid's verdict and motion.
#include "bridge/base/check.hpp"
#include "bridge/mapping_projection.hpp"
#include "bridge/side.hpp"

namespace sluice::bridge {

namespace {

struct Motion {
  std::vector<double> displacement, velocity; // of the solid's nodes
};

Motion read_motion(PayloadReader &read, std::size_t n) {
  Motion motion;
  motion.displacement = read_values(read, n);
  motion.velocity = read_values(read, n);
  return motion;
}

// What the solid says to an iteration.
struct Answer {
  Verdict verdict = Verdict::iterate;
  std::string explanation; // of a failure
  Motion accepted;         // of the window's end, when it converged
  Motion next;             // to compute with
};

Answer read_answer(PayloadReader &read, std::size_t n) {
  Answer answer;
  const auto verdict = read.number();
  if (verdict > static_cast<std::uint64_t>(Verdict::failed))
    throw MalformedMessage(fmt::format("unknown verdict {}", verdict));
  answer.verdict = static_cast<Verdict>(verdict);
  if (answer.verdict == Verdict::failed) {
    answer.explanation = read.text();
    return answer;
  }
  if (answer.verdict == Verdict::converged)
    answer.accepted = read_motion(read, n);
  answer.next = read_motion(read, n);
  return answer;
}

class FluidSide final : public Side {
public:
  explicit FluidSide(const BridgeSettings &settings) : is_implicit_(settings.is_implicit()) {}

  InterfaceMesh initialize(Link &link, const InterfaceMesh &own) override {
    send_mesh(link, own);
    InterfaceMesh solid = receive_mesh(link);
    map_ = projection_map(own, solid);
    n_solid_values_ = solid.positions.size();
    send_report(link);
    const Motion initial =
        link.receive(FrameType::initial, record_limit(2 * n_solid_values_),
                     "the solid's initial displacement and velocity",
                     [&](PayloadReader &read) { return read_motion(read, n_solid_values_); });
    fill("displacement", initial.displacement, initial.displacement);
    fill("velocity", initial.velocity, initial.velocity);
    return solid;
  }

  Verdict advance(const Exchange &exchange) override {
    send_forces(exchange);
    const Answer answer = receive_answer(exchange);
    if (answer.verdict == Verdict::failed) {
      ++exchange.statistics.failed_windows;
      throw UserError(answer.explanation);
    }
    update("displacement", answer.verdict, answer.accepted.displacement, answer.next.displacement);
    update("velocity", answer.verdict, answer.accepted.velocity, answer.next.velocity);
    return answer.verdict;
  }

  void finalize(const Exchange &exchange) override {
    PayloadWriter payload;
    write_totals(payload, exchange.totals);
    exchange.link.send(FrameType::goodbye, payload);
    exchange.link.receive(FrameType::goodbye, record_limit(0), "the solid's goodbye",
                          [](PayloadReader &) { return 0; });
  }

  const MapReport &map_report() const override { return map_.report(); }

private:
  void send_report(Link &link) {
    PayloadWriter payload;
    write_report(payload, map_.report());
    payload.reals(map_.conservative(writable.find("force")->second));
    link.send(FrameType::map_report, payload);
  }

  void send_forces(const Exchange &exchange) {
    PayloadWriter payload;
    write_position(payload, exchange);
    payload.reals(map_.conservative(writable.find("force")->second));
    write_totals(payload, exchange.totals);
    exchange.link.send(FrameType::forces, payload);
  }

  Answer receive_answer(const Exchange &exchange) const {
    const long window = exchange.clock.window();
    return exchange.link.receive(
        FrameType::iterate, record_limit(4 * n_solid_values_),
        fmt::format("the answer to iteration {} of window {} (t = {:.6g} s)", exchange.iteration,
                    window, exchange.clock.start()),
        [&](PayloadReader &read) {
          check_position(read, window, exchange.iteration);
          return read_answer(read, n_solid_values_);
        });
  }

  void fill(std::string_view field, const std::vector<double> &start,
            const std::vector<double> &end) {
    readable.find(field)->second = {map_.consistent(start), map_.consistent(end)};
  }

  // In the explicit scheme the fluid runs a window behind: it starts where it ended.
  void update(std::string_view field, Verdict verdict, const std::vector<double> &accepted,
              const std::vector<double> &next) {
    WindowField &values = readable.find(field)->second;
    if (verdict == Verdict::converged)
      values.start = is_implicit_ ? map_.consistent(accepted) : values.end;
    values.end = map_.consistent(next);
  }

  bool is_implicit_;
  Mapping map_;
  std::size_t n_solid_values_ = 0;
};

} // namespace

std::unique_ptr<Side> make_fluid_side(const BridgeSettings &settings) {
  auto side = std::make_unique<FluidSide>(settings);
  side->readable = {{"displacement", {}}, {"velocity", {}}};
  side->writable = {{"force", {}}};
  return side;
}

} // namespace sluice::bridge
