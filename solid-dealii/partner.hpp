// SPDX-License-Identifier: MIT
// The bridge as the ranks of a body see it: the root speaks, and all others hear what it was told.
// The verbs are those of bridge::Participant.
#pragma once

#include "bridge/participant.hpp"
#include "solid-dealii/ranks.hpp"

namespace sluice::solid {

class Partner {
public:
  /// `bridge` is null but on the root.
  Partner(bridge::Participant *bridge, const Ranks &ranks) : bridge_(bridge), ranks_(ranks) {}

  void set_mesh(const bridge::InterfaceMesh &mesh) {
    if (bridge_)
      bridge_->set_mesh(mesh);
  }
  void initialize() {
    if (bridge_)
      bridge_->initialize();
    ranks_.from_root(0); // nobody goes on before the partner was met
  }
  bool is_coupling_ongoing() const {
    return told([](auto &bridge) { return bridge.is_coupling_ongoing(); }) != 0;
  }
  bool requires_reading_checkpoint() const {
    return told([](auto &bridge) { return bridge.requires_reading_checkpoint(); }) != 0;
  }
  bool is_time_window_complete() const {
    return told([](auto &bridge) { return bridge.is_time_window_complete(); }) != 0;
  }
  int iteration() const {
    return static_cast<int>(told([](auto &bridge) { return bridge.iteration(); }));
  }
  double max_time_step_size() const {
    return told([](auto &bridge) { return bridge.max_time_step_size(); });
  }
  double time() const {
    return told([](auto &bridge) { return bridge.time(); });
  }
  /// Values on the root only.
  void read_data(std::string_view field, double relative_time, std::span<double> values) const {
    if (bridge_)
      bridge_->read_data(field, relative_time, values);
  }
  void write_data(std::string_view field, std::span<const double> values) {
    if (bridge_)
      bridge_->write_data(field, values);
  }
  void report_failure(std::string_view reason) {
    if (bridge_)
      bridge_->report_failure(reason);
  }
  void report_totals(const bridge::InterfaceTotals &totals) {
    if (bridge_)
      bridge_->report_totals(totals);
  }
  void advance(double dt) {
    if (bridge_)
      bridge_->advance(dt);
  }
  /// Asks for an end at the next accepted window.
  void request_stop() {
    if (bridge_)
      bridge_->request_stop();
  }
  bool is_stopped() const {
    return told([](auto &bridge) { return bridge.is_stopped(); }) != 0;
  }
  bool requires_writing_restart() const {
    return told([](auto &bridge) { return bridge.requires_writing_restart(); }) != 0;
  }
  long time_window() const {
    return static_cast<long>(told([](auto &bridge) { return bridge.time_window(); }));
  }
  /// What the participant needs to go on; empty but on the root.
  std::vector<std::byte> saved_state() const {
    return bridge_ ? bridge_->saved_state() : std::vector<std::byte>();
  }
  void restore(std::span<const std::byte> saved) {
    if (bridge_)
      bridge_->restore(saved);
  }
  bool speaks() const { return bridge_ != nullptr; }
  void finalize() {
    if (bridge_)
      bridge_->finalize();
  }

private:
  // The root's answer on every rank; times and counts fit a double.
  template <class Question> double told(Question &&question) const {
    return ranks_.from_root(bridge_ ? static_cast<double>(question(*bridge_)) : 0);
  }

  bridge::Participant *bridge_;
  Ranks ranks_;
};

} // namespace sluice::solid
