// SPDX-License-Identifier: MIT
// The solid's end: receives mapped forces, runs the scheme, sends the verdict and the next motion.
#include "bridge/base/check.hpp"
#include "bridge/side.hpp"

namespace sluice::bridge {

namespace {

Eigen::VectorXd vector_of(const std::vector<double> &values) {
  return Eigen::Map<const Eigen::VectorXd>(values.data(), static_cast<Eigen::Index>(values.size()));
}

std::span<const double> values_of(const Eigen::VectorXd &vector) {
  return {vector.data(), static_cast<std::size_t>(vector.size())};
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
    scheme_.emplace(settings_, written_motion(), extent(own), own.n_nodes());
    PayloadWriter payload;
    write_motion(payload, scheme_->accepted());
    link.send(FrameType::initial, payload);
    // Only now: a partner that never comes must not cost the log of an earlier run.
    log_.emplace(log_file_, "window,iteration,time_s,displacement_residual,force_residual,"
                            "relaxation,columns,converged");
    return fluid;
  }

  void await_window(const Exchange &exchange) override { receive_forces(exchange, 1); }

  Verdict advance(const Exchange &exchange) override {
    WindowField &force = readable.find("force")->second;
    const WindowClock &clock = exchange.clock;
    const IterationRecord record =
        scheme_->advance(written_motion(), vector_of(force.end), clock.window_length(),
                         clock.is_last() ? clock.window_length() : clock.next_window_length());
    log(exchange, record);
    send_answer(exchange, record);
    if (record.verdict == Verdict::converged)
      force.start = force.end;
    if (record.verdict == Verdict::iterate)
      receive_forces(exchange, exchange.iteration + 1);
    return record.verdict;
  }

  void finalize(const Exchange &exchange) override {
    const auto totals = exchange.link.receive(FrameType::goodbye, record_limit(16),
                                              "the fluid's goodbye", read_totals);
    if (totals)
      balance_.add_fluid(*totals, exchange.statistics);
    exchange.link.send(FrameType::goodbye, PayloadWriter());
  }

  void add_totals(const WindowTotals &totals, Statistics &statistics) override {
    balance_.add_solid(totals, statistics);
  }
  const MapReport &map_report() const override { return report_; }

private:
  InterfaceState written_motion() const {
    return {vector_of(writable.find("displacement")->second),
            vector_of(writable.find("velocity")->second)};
  }

  void receive_report(Link &link) {
    readable.find("force")->second.start =
        link.receive(FrameType::map_report, record_limit(n_values_), "the fluid's map",
                     [&](PayloadReader &read) {
                       report_ = read_report(read);
                       return read_values(read, n_values_);
                     });
  }

  void receive_forces(const Exchange &exchange, int iteration) {
    const long window = exchange.clock.window();
    std::optional<WindowTotals> totals;
    readable.find("force")->second.end =
        exchange.link.receive(FrameType::forces, record_limit(n_values_ + 16),
                              fmt::format("the forces of iteration {} of window {} (t = {:.6g} s)",
                                          iteration, window, exchange.clock.start()),
                              [&](PayloadReader &read) {
                                check_position(read, window, iteration);
                                auto values = read_values(read, n_values_);
                                totals = read_totals(read);
                                return values;
                              });
    if (totals && iteration == 1)
      balance_.add_fluid(*totals, exchange.statistics);
  }

  void send_answer(const Exchange &exchange, const IterationRecord &record) {
    PayloadWriter payload;
    write_position(payload, exchange);
    payload.number(static_cast<std::uint64_t>(record.verdict));
    if (record.verdict == Verdict::failed)
      payload.text(explanation(exchange, record));
    else
      write_iterate(payload, record.verdict);
    exchange.link.send(FrameType::iterate, payload);
    if (record.verdict != Verdict::failed)
      return;
    ++exchange.statistics.failed_windows;
    throw UserError(explanation(exchange, record));
  }

  void write_iterate(PayloadWriter &payload, Verdict verdict) const {
    if (verdict == Verdict::converged)
      write_motion(payload, scheme_->accepted());
    write_motion(payload, scheme_->iterate());
  }

  std::string explanation(const Exchange &exchange, const IterationRecord &record) const {
    return fmt::format("bridge: window {} (t = {:.6g} to {:.6g} s) {}", exchange.clock.window(),
                       exchange.clock.start(),
                       exchange.clock.start() + exchange.clock.window_length(),
                       scheme_->explanation(record));
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
};

} // namespace

std::unique_ptr<Side> make_solid_side(const BridgeSettings &settings,
                                      const std::filesystem::path &out_dir) {
  auto side = std::make_unique<SolidSide>(settings, out_dir);
  side->readable = {{"force", {}}};
  side->writable = {{"displacement", {}}, {"velocity", {}}};
  return side;
}

} // namespace sluice::bridge
