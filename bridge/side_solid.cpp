// SPDX-License-Identifier: MIT
// The solid's end: receives mapped forces, runs the scheme, sends the verdict and the next motion.
#include "bridge/base/check.hpp"
#include "bridge/side.hpp"

namespace sluice::bridge {

namespace {

Eigen::Map<const Eigen::VectorXd> vector_of(const std::vector<double> &values) {
  return {values.data(), static_cast<Eigen::Index>(values.size())};
}

std::span<const double> values_of(const Eigen::VectorXd &vector) {
  return {vector.data(), static_cast<std::size_t>(vector.size())};
}

void write_motion(PayloadWriter &write, const InterfaceState &state) {
  write.borrowed(values_of(state.displacement)).borrowed(values_of(state.velocity));
}

class SolidSide final : public Side {
public:
  SolidSide(const BridgeSettings &settings, const std::filesystem::path &out_dir)
      : settings_(settings), log_file_(out_dir / "coupling.csv"),
        balance_(out_dir / "balance.csv") {}

  InterfaceMesh initialize(Link &link, const InterfaceMesh &own) override {
    InterfaceMesh fluid = receive_mesh(link);
    send_mesh(link, own);
    n_values_ = own.positions.size();
    WindowField &force = readable.find("force")->second;
    force.start.resize(n_values_);
    receive_report(link, force.start);
    force.end = force.start;
    const InterfaceView motion = written_motion();
    scheme_.emplace(
        settings_, InterfaceState{motion.displacement, motion.velocity}, extent(own), own.n_nodes(),
        settings_.is_parallel() ? Eigen::VectorXd(vector_of(force.start)) : Eigen::VectorXd());
    PayloadWriter payload;
    write_motion(payload, scheme_->accepted());
    link.send(FrameType::initial, std::move(payload));
    // Only now: a partner that never comes must not cost the log of an earlier run.
    log_.emplace(log_file_, "window,iteration,time_s,displacement_residual,force_residual,"
                            "relaxation,columns,converged");
    return fluid;
  }

  // In the parallel schemes the forces of an iteration are needed at its end only.
  void await_window(const Exchange &exchange) override {
    if (!settings_.is_parallel())
      receive_forces(exchange, 1, readable.find("force")->second.end);
  }

  Verdict advance(const Exchange &exchange) override {
    WindowField &force = readable.find("force")->second;
    if (settings_.is_parallel()) {
      computed_.resize(n_values_);
      receive_forces(exchange, exchange.iteration, computed_);
    }
    std::vector<double> &computed = settings_.is_parallel() ? computed_ : force.end;
    const IterationRecord record = answered(exchange, computed);
    log(exchange, record);
    if (record.verdict == Verdict::converged) {
      force.move_on();
      force.start.swap(computed);
    }
    if (settings_.is_parallel())
      force.end.assign(scheme_->force().begin(), scheme_->force().end());
    else if (record.verdict == Verdict::iterate)
      receive_forces(exchange, exchange.iteration + 1, force.end);
    return record.verdict;
  }

  void finalize(const Exchange &exchange) override {
    const auto totals = exchange.link.receive(FrameType::goodbye, record_limit(16),
                                              "the fluid's goodbye", read_totals);
    if (totals)
      balance_.add_fluid(*totals, exchange.statistics);
    exchange.link.send(FrameType::goodbye, PayloadWriter());
  }

  void save(StateWriter &state) override {
    state(readable.find("force")->second, *scheme_, balance_);
  }
  void restore(StateReader &state) override {
    WindowField &force = readable.find("force")->second;
    state(force, *scheme_, balance_);
    check_restored(force, n_values_);
  }

  void add_totals(const WindowTotals &totals, Statistics &statistics) override {
    balance_.add_solid(totals, statistics);
  }
  const MapReport &map_report() const override { return report_; }

private:
  const std::vector<double> &written_velocity() const {
    return settings_.has_velocity() ? writable.find("velocity")->second : no_values_;
  }
  InterfaceView written_motion() const {
    return {vector_of(writable.find("displacement")->second), vector_of(written_velocity())};
  }

  void receive_report(Link &link, std::vector<double> &initial_forces) {
    link.receive(FrameType::map_report, record_limit(n_values_), "the fluid's map",
                 [&](PayloadReader &read) {
                   run = read.number();
                   report_ = read_report(read);
                   read.reals(initial_forces);
                   return 0;
                 });
  }

  // Judges what both sides computed and sends the answer.
  IterationRecord answered(const Exchange &exchange, const std::vector<double> &force) {
    if (!exchange.failure.empty() || !fluid_failure_.empty())
      return given_up(exchange, {Verdict::failed});
    if (!settings_.is_implicit())
      return passed_on(exchange, force);
    const IterationRecord record = moved_on(exchange, force);
    if (record.verdict == Verdict::failed)
      return given_up(exchange, record);
    send_answer(exchange, record.verdict);
    return record;
  }

  IterationRecord moved_on(const Exchange &exchange, const std::vector<double> &force) {
    const WindowClock &clock = exchange.clock;
    return scheme_->advance(written_motion(), vector_of(force), clock.window_length(),
                            clock.is_last() ? clock.window_length() : clock.next_window_length());
  }

  // The explicit schemes have nothing to judge: the fluid gets what was written at once, and the
  // scheme takes it over while the fluid computes.
  IterationRecord passed_on(const Exchange &exchange, const std::vector<double> &force) {
    PayloadWriter payload = answer(exchange, Verdict::converged);
    payload.borrowed(writable.find("displacement")->second);
    payload.borrowed(written_velocity());
    exchange.link.send(FrameType::iterate, std::move(payload));
    return moved_on(exchange, force);
  }

  // The window is tried again at half its length or, where it cannot be halved, ends the run.
  IterationRecord given_up(const Exchange &exchange, IterationRecord record) {
    const std::string reason = explanation(exchange, record);
    if (!exchange.clock.can_halve()) {
      log(exchange, record);
      ++exchange.statistics.failed_windows;
      send_answer(exchange, Verdict::failed, reason);
      throw UserError(reason);
    }
    record.verdict = Verdict::retry;
    scheme_->restart_window(exchange.clock.halved_length());
    ++exchange.statistics.halved_windows;
    send_answer(exchange, Verdict::retry, reason);
    return record;
  }

  void receive_forces(const Exchange &exchange, int iteration, std::vector<double> &forces) {
    const long window = exchange.clock.window();
    const std::optional<WindowTotals> totals =
        exchange.link.receive(FrameType::forces, record_limit(n_values_ + 16) + longest_text,
                              Awaited("the forces of", iteration, window, exchange.clock.start()),
                              [&](PayloadReader &read) {
                                check_position(read, window, iteration);
                                fluid_failure_ = read.text();
                                fluid_wants_to_stop_ = read.number() != 0;
                                read.reals(forces);
                                return read_totals(read);
                              });
    if (totals && iteration == 1)
      balance_.add_fluid(*totals, exchange.statistics);
  }

  // The head of the answer; a converged window may be the last for now.
  PayloadWriter answer(const Exchange &exchange, Verdict verdict) {
    PayloadWriter payload;
    write_position(payload, exchange);
    payload.number(static_cast<std::uint64_t>(verdict));
    stops_here = verdict == Verdict::converged && (exchange.wants_to_stop || fluid_wants_to_stop_);
    if (verdict == Verdict::converged)
      payload.number(stops_here);
    return payload;
  }

  void send_answer(const Exchange &exchange, Verdict verdict, const std::string &reason = "") {
    PayloadWriter payload = answer(exchange, verdict);
    if (verdict == Verdict::failed || verdict == Verdict::retry)
      payload.text(reason.substr(0, longest_text / 2));
    if (verdict == Verdict::converged)
      write_motion(payload, scheme_->accepted());
    if (verdict != Verdict::failed)
      write_motion(payload, scheme_->iterate());
    exchange.link.send(FrameType::iterate, std::move(payload));
  }

  std::string explanation(const Exchange &exchange, const IterationRecord &record) const {
    std::string what;
    if (!exchange.failure.empty())
      what = fmt::format("could not be computed by the solid: {}", exchange.failure);
    else if (!fluid_failure_.empty())
      what = fmt::format("could not be computed by the fluid: {}", fluid_failure_);
    else
      what = scheme_->explanation(record);
    if (settings_.max_halvings > 0 && !exchange.clock.can_halve())
      what += fmt::format("; it was halved {} times already (bridge.max_halvings)",
                          settings_.max_halvings);
    return fmt::format("bridge: window {} (t = {:.6g} to {:.6g} s) {}", exchange.clock.window(),
                       exchange.clock.start(),
                       exchange.clock.start() + exchange.clock.window_length(), what);
  }

  void log(const Exchange &exchange, const IterationRecord &record) {
    log_->row(
        {static_cast<double>(exchange.clock.window()), static_cast<double>(exchange.iteration),
         exchange.clock.start() + exchange.clock.window_length(), record.displacement_residual,
         record.force_residual, record.relaxation, static_cast<double>(record.columns),
         record.verdict == Verdict::converged ? 1.0 : 0.0});
  }

  BridgeSettings settings_;
  std::filesystem::path log_file_;
  std::optional<CsvWriter> log_;
  BalanceLog balance_;
  std::optional<Scheme> scheme_;
  MapReport report_;
  std::size_t n_values_ = 0;
  std::vector<double> computed_; // forces that the parallel schemes receive
  const std::vector<double> no_values_;
  std::string fluid_failure_;        // of the forces last received
  bool fluid_wants_to_stop_ = false; // at the end of their window
};

} // namespace

std::unique_ptr<Side> make_solid_side(const BridgeSettings &settings,
                                      const std::filesystem::path &out_dir) {
  auto side = std::make_unique<SolidSide>(settings, out_dir);
  side->readable = {{"force", {}}};
  side->writable = {{"displacement", {}}};
  if (settings.has_velocity())
    side->writable.emplace("velocity", std::vector<double>());
  return side;
}

} // namespace sluice::bridge
