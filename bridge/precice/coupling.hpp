// SPDX-License-Identifier: MIT
// Two participants of a preCICE configuration over a link of the bridge: meshes are exchanged once,
// then in every iteration the first participant sends its fields, the second judges, accelerates
// and answers with the verdict and its own.
//
//   serial     the second reads the first's fields of this iteration, the first the second's of the
//              last; accelerated are fields of the second
//   parallel   each reads the other's fields of the last iteration; accelerated may be all
//
// A window that has not converged after max-iterations, or a value that is not finite, ends both
// participants (preCICE goes on).
#pragma once

#include "bridge/acceleration.hpp"
#include "bridge/base/csv.hpp"
#include "bridge/link.hpp"
#include "bridge/precice/configuration.hpp"
#include "bridge/window_clock.hpp"

#include <memory>
#include <optional>
#include <span>

namespace sluice::precice_layer {

class Coupling {
public:
  /// Throws UserError for a name that the configuration does not have.
  Coupling(Configuration config, std::string name);
  ~Coupling();
  Coupling(const Coupling &) = delete;
  Coupling &operator=(const Coupling &) = delete;

  const Configuration &config() const { return config_; }
  /// An own mesh until initialize: the vertices, dimensions numbers each, and edges or triangles.
  bridge::InterfaceMesh &own_mesh(const std::string &mesh);
  /// An own mesh or, after initialize, a received one.
  const bridge::InterfaceMesh &mesh(const std::string &mesh) const;

  void initialize();
  void advance(double dt);
  void finalize();

  void write(const FieldName &field, std::span<const int> ids, std::span<const double> values);
  void read(const FieldName &field, std::span<const int> ids, double relative_time,
            std::span<double> values) const;

  bool is_ongoing() const { return !clock_.is_over(); }
  bool is_window_complete() const { return is_complete_; }
  double time_left() const { return clock_.left(); }
  bool requires_initial_data() const;
  bool requires_writing_checkpoint() const {
    return config_.is_implicit && iteration_ == 1 && clock_.elapsed() == 0 && is_ongoing();
  }
  bool requires_reading_checkpoint() const { return is_rejected_; }

private:
  /// One exchanged field, with the own field it comes from or goes to.
  struct Way {
    Exchange exchange;
    FieldName own;
    bool goes_out = false;
    int components = 1;
    std::optional<MapConfig> map;
    bridge::Mapping::Matrix matrix; // from what is sent to what is read; empty: the same mesh
    Eigen::VectorXd computed;       // on the exchange's mesh, in this iteration
    Eigen::VectorXd iterate;        // the last one that was read
    Eigen::VectorXd start, end;     // own field that is read; over the window
    double scale = 0;               // in the acceleration; 0: not known yet
  };

  void find_ways();
  void exchange_meshes();
  void send_meshes();
  void receive_meshes();
  void build_map(Way &way);
  Eigen::VectorXd mapped(const Way &way, const Eigen::VectorXd &values) const;
  void compute_out();
  void put(bridge::PayloadWriter &payload, bool iterates) const;
  void get(bridge::PayloadReader &payload, bool iterates);
  std::size_t limit() const;
  void send_fields(bridge::FrameType type);
  void receive_fields(bridge::FrameType type, std::string_view what);
  bool answer();
  bool receive_answer();
  bool has_converged() const;
  void accelerate(bool has_converged);
  bool find_scales();
  void take_over(bool has_converged);
  void record_watch_points();
  void give_up(std::string_view message) noexcept;

  template <class Action> void told(Action &&action) {
    try {
      action();
    } catch (const std::exception &error) {
      give_up(error.what());
      throw;
    }
  }

  Configuration config_;
  std::string name_, partner_;
  const ParticipantConfig &self_;
  bool is_first_;
  bridge::WindowClock clock_;
  std::map<std::string, bridge::InterfaceMesh> meshes_;
  std::map<std::pair<std::string, std::string>, std::vector<double>> written_;
  std::vector<Way> ways_;
  std::optional<bridge::Acceleration> acceleration_;
  std::unique_ptr<bridge::Link> link_;
  /// The nearest vertex of a watch-point and its file.
  struct Watch {
    std::size_t node;
    std::string mesh;
    CsvWriter csv;
  };
  std::vector<Watch> watches_;
  int iteration_ = 1;
  bool is_complete_ = false, is_rejected_ = false, is_silent_ = false;
};

} // namespace sluice::precice_layer
