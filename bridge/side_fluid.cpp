// SPDX-License-Identifier: MIT
// The fluid's end: holds the map, sends mapped forces, receives the solid's verdict and motion.
#include "bridge/base/check.hpp"
#include "bridge/side.hpp"

namespace sluice::bridge {

namespace {

struct Motion {
  std::vector<double> displacement, velocity; // of the solid's nodes
};

// What the solid says to an iteration.
struct Answer {
  Verdict verdict = Verdict::iterate;
  std::string explanation; // of a failure, or of a window that is tried again
  Motion accepted;         // of the window's end, when it converged in an implicit scheme
  Motion next;             // to compute with
  bool stops_here = false; // the window was the run's last for now
};

MapKind kind_of(const std::string &mapping) {
  if (mapping == "nearest")
    return MapKind::nearest;
  if (mapping == "mortar")
    return MapKind::mortar;
  return mapping == "rbf" ? MapKind::rbf : MapKind::projection;
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
    n_solid_values_ = solid.positions.size();
    send_report(link);
    const Motion initial = link.receive(FrameType::initial, record_limit(2 * n_solid_values_),
                                        "the solid's initial displacement and velocity",
                                        [&](PayloadReader &read) { return read_motion(read); });
    fill("displacement", initial.displacement);
    if (has_velocity_)
      fill("velocity", initial.velocity);
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
    update("displacement", answer.verdict, answer.accepted.displacement, answer.next.displacement);
    if (has_velocity_)
      update("velocity", answer.verdict, answer.accepted.velocity, answer.next.velocity);
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
      check_restored(field.start.size(), needed);
    }
  }

  const MapReport &map_report() const override { return map_.report(); }

private:
  void send_report(Link &link) {
    PayloadWriter payload;
    write_report(payload, map_.report());
    payload.reals(map_.conservative(writable.find("force")->second));
    link.send(FrameType::map_report, std::move(payload));
  }

  void send_forces(const Exchange &exchange) {
    PayloadWriter payload;
    write_position(payload, exchange);
    payload.text(exchange.failure).number(exchange.wants_to_stop);
    payload.reals(map_.conservative(writable.find("force")->second));
    write_totals(payload, over_depth(exchange.totals, map_.depth()));
    exchange.link.send(FrameType::forces, std::move(payload));
  }

  Answer receive_answer(const Exchange &exchange) const {
    const long window = exchange.clock.window();
    return exchange.link.receive(
        FrameType::iterate, record_limit(4 * n_solid_values_) + longest_text,
        fmt::format("the answer to iteration {} of window {} (t = {:.6g} s)", exchange.iteration,
                    window, exchange.clock.start()),
        [&](PayloadReader &read) {
          check_position(read, window, exchange.iteration);
          return read_answer(read);
        });
  }

  Motion read_motion(PayloadReader &read) const {
    Motion motion;
    motion.displacement = read_values(read, n_solid_values_);
    motion.velocity = read_values(read, has_velocity_ ? n_solid_values_ : 0);
    return motion;
  }

  Answer read_answer(PayloadReader &read) const {
    Answer answer;
    const auto verdict = read.number();
    if (verdict > static_cast<std::uint64_t>(Verdict::retry))
      throw MalformedMessage(fmt::format("unknown verdict {}", verdict));
    answer.verdict = static_cast<Verdict>(verdict);
    if (answer.verdict == Verdict::failed || answer.verdict == Verdict::retry)
      answer.explanation = read.text();
    if (answer.verdict == Verdict::failed)
      return answer;
    if (answer.verdict == Verdict::converged)
      answer.stops_here = read.number() != 0;
    if (answer.verdict == Verdict::converged && is_implicit_)
      answer.accepted = read_motion(read);
    answer.next = read_motion(read);
    return answer;
  }

  void fill(std::string_view field, const std::vector<double> &values) {
    const std::vector<double> mapped = map_.consistent(values);
    readable.find(field)->second = {mapped, mapped, {}};
  }

  // In the explicit scheme the fluid runs a window behind: it starts where it ended.
  void update(std::string_view field, Verdict verdict, const std::vector<double> &accepted,
              const std::vector<double> &next) {
    WindowField &values = readable.find(field)->second;
    if (verdict == Verdict::converged)
      values.move_on(is_implicit_ ? map_.consistent(accepted) : values.end);
    values.end = map_.consistent(next);
  }

  bool is_implicit_, has_velocity_;
  MapKind kind_;
  Mapping map_;
  std::size_t n_solid_values_ = 0;
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
