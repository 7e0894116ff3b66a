// SPDX-License-Identifier: MIT
// The solid's end: receives mapped forces, runs the scheme, sends the verdict and the next motion.
#include "bridge/base/check.hpp"
#include "bridge/side.hpp"

namespace sluice::bridge {

namespace {

Eigen::VectorXd vector_of(const std::vector<double> &values) {
  return Eigen::Map<const Eigen::VectorXd>(values.data(), static_cast<Eigen::Index>(values.size()));
}

std::vector<double> values_of(const Eigen::VectorXd &vector) {
  return {vector.begin(), vector.end()};
}

void write_motion(PayloadWriter &write, const InterfaceState &state) {
  write.reals(values_of(state.displacement)).reals(values_of(state.velocity));
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
    receive_report(link);
    WindowField &force = readable.find("force")->second;
    force.end = force.start;
    scheme_.emplace(settings_, written_motion(), extent(own), own.n_nodes(),
                    settings_.is_parallel() ? vector_of(force.start) : Eigen::VectorXd());
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
      readable.find("force")->second.end = receive_forces(exchange, 1);
  }

  Verdict advance(const Exchange &exchange) override {
    WindowField &force = readable.find("force")->second;
    const std::vector<double> computed =
        settings_.is_parallel() ? receive_forces(exchange, exchange.iteration) : force.end;
    IterationRecord record = judged(exchange, computed);
    const std::string reason =
        record.verdict == Verdict::failed ? explanation(exchange, record) : std::string();
    if (record.verdict == Verdict::failed && exchange.clock.can_halve()) {
      record.verdict = Verdict::retry;
      scheme_->restart_window(exchange.clock.halved_length());
      ++exchange.statistics.halved_windows;
    }
    log(exchange, record);
    send_answer(exchange, record.verdict, reason);
    if (record.verdict == Verdict::converged)
      force.move_on(computed);
    if (settings_.is_parallel())
      force.end = values_of(scheme_->force());
    else if (record.verdict == Verdict::iterate)
      force.end = receive_forces(exchange, exchange.iteration + 1);
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
    check_restored(force.start.size(), n_values_);
  }

  void add_totals(const WindowTotals &totals, Statistics &statistics) override {
    balance_.add_solid(totals, statistics);
  }
  const MapReport &map_report() const override { return report_; }

private:
  InterfaceState written_motion() const {
    return {vector_of(writable.find("displacement")->second),
            settings_.has_velocity() ? vector_of(writable.find("velocity")->second)
                                     : Eigen::VectorXd()};
  }

  void receive_report(Link &link) {
    readable.find("force")->second.start =
        link.receive(FrameType::map_report, record_limit(n_values_), "the fluid's map",
                     [&](PayloadReader &read) {
                       report_ = read_report(read);
                       return read_values(read, n_values_);
                     });
  }

  // The verdict on what both sides computed; failed where one of them could not.
  IterationRecord judged(const Exchange &exchange, const std::vector<double> &force) {
    if (!exchange.failure.empty() || !fluid_failure_.empty())
      return {Verdict::failed};
    const WindowClock &clock = exchange.clock;
    return scheme_->advance(written_motion(), vector_of(force), clock.window_length(),
                            clock.is_last() ? clock.window_length() : clock.next_window_length());
  }

  std::vector<double> receive_forces(const Exchange &exchange, int iteration) {
    const long window = exchange.clock.window();
    std::optional<WindowTotals> totals;
    std::vector<double> forces =
        exchange.link.receive(FrameType::forces, record_limit(n_values_ + 16) + longest_text,
                              fmt::format("the forces of iteration {} of window {} (t = {:.6g} s)",
                                          iteration, window, exchange.clock.start()),
                              [&](PayloadReader &read) {
                                check_position(read, window, iteration);
                                fluid_failure_ = read.text();
                                fluid_wants_to_stop_ = read.number() != 0;
                                auto values = read_values(read, n_values_);
                                totals = read_totals(read);
                                return values;
                              });
    if (totals && iteration == 1)
      balance_.add_fluid(*totals, exchange.statistics);
    return forces;
  }

  void send_answer(const Exchange &exchange, Verdict verdict, const std::string &reason) {
    PayloadWriter payload;
    write_position(payload, exchange);
    payload.number(static_cast<std::uint64_t>(verdict));
    if (verdict == Verdict::failed || verdict == Verdict::retry)
      payload.text(reason.substr(0, longest_text / 2));
    stops_here = verdict == Verdict::converged && (exchange.wants_to_stop || fluid_wants_to_stop_);
    if (verdict == Verdict::converged)
      payload.number(stops_here);
    if (verdict != Verdict::failed)
      write_iterate(payload, verdict);
    exchange.link.send(FrameType::iterate, std::move(payload));
    if (verdict != Verdict::failed)
      return;
    ++exchange.statistics.failed_windows;
    throw UserError(reason);
  }

  void write_iterate(PayloadWriter &payload, Verdict verdict) const {
    if (verdict == Verdict::converged && settings_.is_implicit())
      write_motion(payload, scheme_->accepted());
    write_motion(payload, scheme_->iterate());
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
