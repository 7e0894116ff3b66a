// SPDX-License-Identifier: MIT
// The fluid's end: holds the map, sends mapped forces, receives the solid's verdict and motion.
#include "bridge/base/check.hpp"
#include "bridge/side.hpp"

#include <random>

namespace sluice::bridge {

namespace {

// What the solid says to an iteration, beside the motion.
struct Answer {
  Verdict verdict = Verdict::iterate;
  std::string explanation; // of a failure, or of a window that is tried again
  bool stops_here = false; // the window was the run's last for now
};

MapKind kind_of(const std::string &mapping) {
  if (mapping == "nearest")
    return MapKind::nearest;
  if (mapping == "mortar")
    return MapKind::mortar;
  return mapping == "rbf" ? MapKind::rbf : MapKind::projection;
}

// No two runs have the same one.
std::uint64_t drawn_number() {
  std::random_device draw;
  return std::uint64_t{draw()} << 32 | draw();
}

// A plane fluid sums per metre, a solid in space over its depth.
std::optional<WindowTotals> over_depth(std::optional<WindowTotals> totals, double depth) {
  if (!totals)
    return totals;
  InterfaceTotals &sums = totals->totals;
  for (std::size_t d = 0; d < 3; ++d) {
    sums.force[d] *= depth;
    sums.moment[d] *= depth;
  }
  for (double *sum :
       {&sums.work, &sums.force_magnitude, &sums.moment_magnitude, &sums.work_magnitude})
    *sum *= depth;
  return totals;
}

class FluidSide final : public Side {
public:
  explicit FluidSide(const BridgeSettings &settings)
      : is_implicit_(settings.is_implicit()), has_velocity_(settings.has_velocity()),
        kind_(kind_of(settings.mapping)) {}

  InterfaceMesh initialize(Link &link, const InterfaceMesh &own) override {
    send_mesh(link, own);
    InterfaceMesh solid = receive_mesh(link);
    map_ = make_mapping(kind_, own, solid);
    arrived_.resize(solid.positions.size());
    mapped_.resize(solid.positions.size());
    for (auto &[name, field] : readable)
      field.start.resize(own.positions.size());
    send_report(link);
    link.receive(FrameType::initial, record_limit(2 * solid.positions.size()),
                 "the solid's initial displacement and velocity", [&](PayloadReader &read) {
                   read_motion(read, &WindowField::start);
                   return 0;
                 });
    for (auto &[name, field] : readable)
      field.end = field.start;
    return solid;
  }

  Verdict advance(const Exchange &exchange) override {
    send_forces(exchange);
    const Answer answer = receive_answer(exchange);
    if (answer.verdict == Verdict::failed) {
      ++exchange.statistics.failed_windows;
      throw UserError(answer.explanation);
    }
    stops_here = answer.stops_here;
    exchange.statistics.halved_windows += answer.verdict == Verdict::retry;
    return answer.verdict;
  }

  void finalize(const Exchange &exchange) override {
    PayloadWriter payload;
    write_totals(payload, over_depth(exchange.totals, map_.depth()));
    exchange.link.send(FrameType::goodbye, std::move(payload));
    exchange.link.receive(FrameType::goodbye, record_limit(0), "the solid's goodbye",
                          [](PayloadReader &) { return 0; });
  }

  void save(StateWriter &state) override {
    for (auto &[name, field] : readable)
      state(field);
  }
  void restore(StateReader &state) override {
    for (auto &[name, field] : readable) {
      const std::size_t needed = field.start.size();
      state(field);
      check_restored(field, needed);
    }
  }

  const MapReport &map_report() const override { return map_.report(); }

private:
  void send_report(Link &link) {
    run = drawn_number();
    PayloadWriter payload;
    payload.number(run);
    write_report(payload, map_.report());
    payload.borrowed(forces_on_solid());
    link.send(FrameType::map_report, std::move(payload));
  }

  void send_forces(const Exchange &exchange) {
    PayloadWriter payload;
    write_position(payload, exchange);
    payload.text(exchange.failure).number(exchange.wants_to_stop);
    payload.borrowed(forces_on_solid());
    write_totals(payload, over_depth(exchange.totals, map_.depth()));
    exchange.link.send(FrameType::forces, std::move(payload));
  }

  std::span<const double> forces_on_solid() {
    const std::vector<double> &forces = writable.find("force")->second;
    if (map_.is_identity())
      return forces;
    map_.conservative(forces, mapped_);
    return mapped_;
  }

  Answer receive_answer(const Exchange &exchange) {
    const long window = exchange.clock.window();
    return exchange.link.receive(
        FrameType::iterate, record_limit(4 * arrived_.size()) + longest_text,
        Awaited("the answer to", exchange.iteration, window, exchange.clock.start()),
        [&](PayloadReader &read) {
          check_position(read, window, exchange.iteration);
          return read_answer(read);
        });
  }

  // Both fields, mapped, at one instant of the window.
  void read_motion(PayloadReader &read, std::vector<double> WindowField::*instant) {
    read_mapped(read, readable.find("displacement")->second.*instant);
    if (has_velocity_)
      read_mapped(read, readable.find("velocity")->second.*instant);
    else
      read.reals(std::span<double>());
  }
  void read_mapped(PayloadReader &read, std::vector<double> &values) {
    if (map_.is_identity())
      return read.reals(values);
    read.reals(arrived_);
    map_.consistent(arrived_, values);
  }

  Answer read_answer(PayloadReader &read) {
    Answer answer;
    const auto verdict = read.number();
    if (verdict > static_cast<std::uint64_t>(Verdict::retry))
      throw MalformedMessage(fmt::format("unknown verdict {}", verdict));
    answer.verdict = static_cast<Verdict>(verdict);
    if (answer.verdict == Verdict::failed || answer.verdict == Verdict::retry)
      answer.explanation = read.text();
    if (answer.verdict == Verdict::failed)
      return answer;
    if (answer.verdict == Verdict::converged) {
      answer.stops_here = read.number() != 0;
      read_accepted(read);
    }
    read_motion(read, &WindowField::end);
    return answer;
  }

  // In the explicit scheme the fluid runs a window behind: it starts where it ended.
  void read_accepted(PayloadReader &read) {
    for (auto &[name, field] : readable) {
      field.move_on();
      if (!is_implicit_)
        field.start.swap(field.end);
    }
    if (is_implicit_)
      read_motion(read, &WindowField::start);
  }

  bool is_implicit_, has_velocity_;
  MapKind kind_;
  Mapping map_;
  std::vector<double> arrived_, mapped_; // motion and forces at the solid's nodes
};

} // namespace

std::unique_ptr<Side> make_fluid_side(const BridgeSettings &settings) {
  auto side = std::make_unique<FluidSide>(settings);
  side->readable = {{"displacement", {}}};
  if (settings.has_velocity())
    side->readable.emplace("velocity", WindowField());
  side->writable = {{"force", {}}};
  return side;
}

} // namespace sluice::bridge
