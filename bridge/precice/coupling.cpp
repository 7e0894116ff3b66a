// SPDX-License-Identifier: MIT
#include "bridge/precice/coupling.hpp"

#include "bridge/base/check.hpp"
#include "bridge/node_tree.hpp"
#include "bridge/precice/meeting.hpp"
#include "bridge/side.hpp"

#include <algorithm>
#include <cmath>

namespace sluice::precice_layer {

using bridge::FrameType;
using bridge::PayloadReader;
using bridge::PayloadWriter;

namespace {

using Table = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

bool has(const std::vector<std::string> &names, const std::string &name) {
  return std::find(names.begin(), names.end(), name) != names.end();
}

const ParticipantConfig &participant(const Configuration &config, const std::string &name) {
  const auto found = config.participants.find(name);
  check(found != config.participants.end(), "precice: the configuration has no participant '{}'",
        name);
  check(name == config.first || name == config.second,
        "precice: the participant '{}' is not in the coupling scheme", name);
  return found->second;
}

bridge::CaseSettings case_settings(const Configuration &config) {
  bridge::CaseSettings settings;
  settings.end_time = config.end_time;
  settings.time_step = config.window;
  return settings;
}

} // namespace

Coupling::Coupling(Configuration config, std::string name)
    : config_(std::move(config)), name_(std::move(name)), self_(participant(config_, name_)),
      is_first_(name_ == config_.first), clock_(case_settings(config_)) {
  partner_ = is_first_ ? config_.second : config_.first;
  for (const std::string &mesh : self_.provided) {
    const int dim = config_.meshes.at(mesh).dimensions;
    meshes_[mesh] = {dim, dim, {}, {}};
  }
  find_ways();
  const AccelerationConfig &a = config_.acceleration;
  if (!is_first_ && !a.kind.empty()) {
    bridge::BridgeSettings settings;
    settings.acceleration = a.kind;
    settings.initial_relaxation = a.relaxation;
    settings.windows_reused = a.windows_reused;
    settings.filter = a.filter;
    acceleration_ = bridge::make_acceleration(settings);
  }
}

Coupling::~Coupling() { give_up(fmt::format("{} ended before the run was complete", name_)); }

void Coupling::give_up(std::string_view message) noexcept {
  if (link_ && !is_silent_)
    link_->send_abort(message);
  is_silent_ = true;
}

// Of every exchange, the own field at this end and the map between.
void Coupling::find_ways() {
  for (const Exchange &e : config_.exchanges) {
    if (e.from != name_ && e.to != name_)
      continue;
    Way way;
    way.exchange = e;
    way.goes_out = e.from == name_;
    way.components = config_.components(e.field);
    for (const FieldName &own : way.goes_out ? self_.written : self_.read)
      if (own.data == e.field.data)
        way.own = own;
    check(!way.own.data.empty(), "precice: '{}' is exchanged, but {} does not {} it", e.field.data,
          name_, way.goes_out ? "write" : "read");
    const auto &from = way.goes_out ? way.own.mesh : e.field.mesh;
    const auto &to = way.goes_out ? e.field.mesh : way.own.mesh;
    for (const MapConfig &map : self_.maps)
      if (map.from == from && map.to == to && map.is_write == way.goes_out)
        way.map = map;
    check(way.map || from == to, "precice: {} has no mapping of '{}' from {} to {}", name_,
          e.field.data, from, to);
    ways_.push_back(std::move(way));
  }
}

bridge::InterfaceMesh &Coupling::own_mesh(const std::string &name) {
  const auto found = meshes_.find(name);
  check(found != meshes_.end() && has(self_.provided, name),
        "precice: {} does not provide a mesh '{}'", name_, name);
  check(!link_, "precice: the mesh '{}' is changed after initialize", name);
  return found->second;
}

const bridge::InterfaceMesh &Coupling::mesh(const std::string &name) const {
  const auto found = meshes_.find(name);
  check(found != meshes_.end(), "precice: {} has no mesh '{}'", name_, name);
  return found->second;
}

bool Coupling::requires_initial_data() const {
  return std::any_of(ways_.begin(), ways_.end(),
                     [](const Way &way) { return way.goes_out && way.exchange.has_initial; });
}

// ---- meeting ------------------------------------------------------------------------------------

void Coupling::exchange_meshes() {
  if (is_first_)
    send_meshes();
  receive_meshes();
  if (!is_first_)
    send_meshes();
}

void Coupling::send_meshes() {
  for (const auto &[mesh, from] : participant(config_, partner_).received)
    if (from == name_)
      bridge::send_mesh(*link_, meshes_.at(mesh));
}

void Coupling::receive_meshes() {
  for (const auto &[mesh, from] : self_.received)
    if (from == partner_)
      meshes_[mesh] = bridge::receive_mesh(*link_);
}

void Coupling::build_map(Way &way) {
  if (!way.map)
    return;
  const bridge::InterfaceMesh &from = mesh(way.map->from), &to = mesh(way.map->to);
  if (way.map->is_conservative)
    way.matrix = bridge::make_mapping(way.map->kind, from, to).matrix().transpose();
  else
    way.matrix = bridge::make_mapping(way.map->kind, to, from).matrix();
}

Eigen::VectorXd Coupling::mapped(const Way &way, const Eigen::VectorXd &values) const {
  if (!way.map)
    return values;
  const Eigen::Map<const Table> table(values.data(), values.size() / way.components,
                                      way.components);
  const Table result = way.matrix * table;
  return Eigen::Map<const Eigen::VectorXd>(result.data(), result.size());
}

void Coupling::initialize() {
  check(!link_, "precice: initialize comes once");
  for (const std::string &own : self_.provided)
    bridge::check_mesh(meshes_.at(own), name_);
  link_ = meet(config_, name_, partner_);
  told([&] {
    compare_texts(*link_, config_, name_, partner_);
    exchange_meshes();
    for (Way &way : ways_) {
      build_map(way);
      const auto zeros = [&](const std::string &on) -> Eigen::VectorXd {
        return Eigen::VectorXd::Zero(static_cast<Eigen::Index>(mesh(on).n_nodes()) *
                                     way.components);
      };
      way.computed = zeros(way.exchange.field.mesh);
      if (way.goes_out)
        written_.try_emplace({way.own.mesh, way.own.data}, zeros(way.own.mesh).size(), 0.0);
    }
    compute_out();
    if (is_first_)
      send_fields(FrameType::initial);
    receive_fields(FrameType::initial, "the initial data");
    if (!is_first_)
      send_fields(FrameType::initial);
    take_over(true);
    if (!is_first_ && !config_.is_parallel)
      receive_fields(FrameType::forces, "the first iteration's data");
  });
}

// ---- fields -------------------------------------------------------------------------------------

void Coupling::write(const FieldName &field, std::span<const int> ids,
                     std::span<const double> values) {
  told([&] {
    check(std::find(self_.written.begin(), self_.written.end(), field) != self_.written.end(),
          "precice: {} does not write '{}' on '{}'", name_, field.data, field.mesh);
    const auto n = static_cast<std::size_t>(config_.components(field));
    const std::size_t nodes = mesh(field.mesh).n_nodes();
    check(values.size() == n * ids.size(), "precice: '{}' needs {} values for {} vertices, {} came",
          field.data, n * ids.size(), ids.size(), values.size());
    std::vector<double> &all = written_[{field.mesh, field.data}];
    all.resize(n * nodes);
    for (std::size_t k = 0; k < values.size(); ++k) {
      const auto id = static_cast<std::size_t>(ids[k / n]);
      check(id < nodes, "precice: vertex {} of '{}', which has {}", ids[k / n], field.mesh, nodes);
      check(std::isfinite(values[k]), "precice: {} wrote {} for '{}' at vertex {}, t = {:.6g} s",
            name_, values[k], field.data, ids[k / n], clock_.time());
      all[n * id + k % n] = values[k];
    }
  });
}

// Linear over the window.
void Coupling::read(const FieldName &field, std::span<const int> ids, double relative_time,
                    std::span<double> values) const {
  const auto way = std::find_if(ways_.begin(), ways_.end(),
                                [&](const Way &w) { return !w.goes_out && w.own == field; });
  check(way != ways_.end(), "precice: {} does not read '{}' on '{}', or nobody sends it", name_,
        field.data, field.mesh);
  check(link_ != nullptr, "precice: data are read after initialize");
  const auto n = static_cast<std::size_t>(way->components);
  check(values.size() == n * ids.size(), "precice: '{}' has {} values for {} vertices, not {}",
        field.data, n * ids.size(), ids.size(), values.size());
  const double length = clock_.is_over() ? 1 : clock_.window_length();
  const double s = clock_.is_over() ? 0 : (clock_.elapsed() + relative_time) / length;
  check(s >= -1e-9 && s <= 1 + 1e-9, "precice: '{}' read {} s from now, outside the window",
        field.data, relative_time);
  for (std::size_t k = 0; k < values.size(); ++k) {
    const auto at = static_cast<Eigen::Index>(n * static_cast<std::size_t>(ids[k / n]) + k % n);
    check(ids[k / n] >= 0 && at < way->end.size(), "precice: '{}' has no vertex {}", field.mesh,
          ids[k / n]);
    values[k] = s >= 1 ? way->end[at] : way->start[at] + s * (way->end[at] - way->start[at]);
  }
}

void Coupling::compute_out() {
  for (Way &way : ways_)
    if (way.goes_out) {
      const std::vector<double> &own = written_.at({way.own.mesh, way.own.data});
      way.computed = mapped(way, Eigen::Map<const Eigen::VectorXd>(
                                     own.data(), static_cast<Eigen::Index>(own.size())));
    }
}

void Coupling::put(PayloadWriter &payload, bool iterates) const {
  for (const Way &way : ways_)
    if (way.goes_out) {
      const Eigen::VectorXd &v = iterates ? way.iterate : way.computed;
      payload.reals({v.data(), static_cast<std::size_t>(v.size())});
    }
}

void Coupling::get(PayloadReader &payload, bool iterates) {
  for (Way &way : ways_)
    if (!way.goes_out) {
      const std::size_t n =
          mesh(way.exchange.field.mesh).n_nodes() * static_cast<std::size_t>(way.components);
      Eigen::VectorXd &values = iterates ? way.iterate : way.computed;
      values.resize(static_cast<Eigen::Index>(n));
      payload.reals(std::span(values.data(), n));
    }
}

std::size_t Coupling::limit() const {
  std::size_t n = 16;
  for (const Way &way : ways_)
    n += 1 + mesh(way.exchange.field.mesh).n_nodes() * static_cast<std::size_t>(way.components);
  return bridge::record_limit(n);
}

void Coupling::send_fields(FrameType type) {
  PayloadWriter payload;
  payload.number(static_cast<std::uint64_t>(clock_.window()));
  payload.number(static_cast<std::uint64_t>(iteration_));
  put(payload, false);
  link_->send(type, std::move(payload));
}

void Coupling::receive_fields(FrameType type, std::string_view what) {
  link_->receive(type, limit(),
                 fmt::format("{} (window {}, iteration {})", what, clock_.window(), iteration_),
                 [&](PayloadReader &read) {
                   bridge::check_position(read, clock_.window(), iteration_);
                   get(read, false);
                   return 0;
                 });
  if (type == FrameType::forces && !config_.is_parallel)
    for (Way &way : ways_)
      if (!way.goes_out)
        way.end = mapped(way, way.computed);
}

// ---- windows ------------------------------------------------------------------------------------

void Coupling::advance(double dt) {
  told([&] {
    check(link_ && is_ongoing(), "precice: advance outside the coupled run");
    check(dt > 0 && dt <= clock_.left() * (1 + 1e-9),
          "precice: a step of {} s, where {} s of the window are left", dt, clock_.left());
    is_complete_ = is_rejected_ = false;
    if (!clock_.step(dt))
      return;
    clock_.restart_window();
    compute_out();
    const bool converged = is_first_ ? receive_answer() : answer();
    take_over(converged);
    is_complete_ = converged;
    is_rejected_ = !converged;
    iteration_ = converged ? 1 : iteration_ + 1;
    if (converged) {
      clock_.next_window();
      record_watch_points();
    }
    if (!is_first_ && !config_.is_parallel && is_ongoing())
      receive_fields(FrameType::forces, "the data of the next iteration");
  });
}

bool Coupling::receive_answer() {
  send_fields(FrameType::forces);
  return link_->receive(
      FrameType::iterate, limit(),
      fmt::format("the answer to iteration {} of window {}", iteration_, clock_.window()),
      [&](PayloadReader &read) {
        bridge::check_position(read, clock_.window(), iteration_);
        const bool converged = read.number() != 0;
        get(read, true);
        return converged;
      });
}

bool Coupling::answer() {
  if (config_.is_parallel)
    receive_fields(FrameType::forces, "the data of the partner");
  const bool converged = has_converged();
  accelerate(converged);
  PayloadWriter payload;
  payload.number(static_cast<std::uint64_t>(clock_.window()));
  payload.number(static_cast<std::uint64_t>(iteration_));
  payload.number(converged);
  put(payload, true);
  link_->send(FrameType::iterate, std::move(payload));
  return converged;
}

bool Coupling::has_converged() const {
  if (!config_.is_implicit)
    return true;
  const bool is_last = iteration_ >= config_.max_iterations;
  if (config_.measures.empty())
    return is_last;
  bool converged = iteration_ >= config_.min_iterations;
  std::string report;
  for (const Measure &measure : config_.measures) {
    const auto way = std::find_if(ways_.begin(), ways_.end(),
                                  [&](const Way &w) { return w.exchange.field == measure.field; });
    check(way != ways_.end(),
          "precice: convergence is measured by '{}' on '{}', which is not "
          "exchanged",
          measure.field.data, measure.field.mesh);
    const double change = (way->computed - way->iterate).norm();
    const double size = measure.is_relative ? way->computed.norm() : 1;
    converged = converged && change <= measure.limit * size;
    report += fmt::format("; {}: {:.3g} of {:.3g} allowed", measure.field.data, change,
                          measure.limit * size);
  }
  check(converged || !is_last,
        "precice: window {} (t = {:.6g} s) did not converge in {} iterations{}", clock_.window(),
        clock_.start(), iteration_, report);
  return converged;
}

// Fields count by their first change, so that none drowns another; true where a scale is new.
bool Coupling::find_scales() {
  bool is_new = false;
  for (Way &way : ways_)
    if (const double change = (way.computed - way.iterate).norm(); way.scale == 0 && change > 0) {
      way.scale = 1 / change;
      is_new = true;
    }
  return is_new;
}

// Leaves what the partners read next in `iterate`.
void Coupling::accelerate(bool has_converged) {
  std::vector<Way *> chosen;
  for (const FieldName &field : config_.acceleration.fields)
    for (Way &way : ways_)
      if (way.exchange.field == field)
        chosen.push_back(&way);
  Eigen::Index n = 0;
  for (const Way *way : chosen)
    n += way->computed.size();
  const bool is_used = acceleration_ && config_.is_implicit && n > 0;
  Eigen::VectorXd next;
  if (is_used) {
    if (find_scales())
      bridge::forget_window(*acceleration_);
    const auto stacked = [&](auto &&field) {
      Eigen::VectorXd all(n);
      Eigen::Index at = 0;
      for (const Way *way : chosen) {
        const Eigen::VectorXd &v = field(*way);
        all.segment(at, v.size()) = way->scale * v;
        at += v.size();
      }
      return all;
    };
    const Eigen::VectorXd x = stacked([](const Way &w) -> auto & { return w.iterate; });
    const Eigen::VectorXd solved = stacked([](const Way &w) -> auto & { return w.computed; });
    if (has_converged)
      bridge::finish_window(*acceleration_, x, solved, 0);
    else
      next = bridge::accelerate(*acceleration_, x, solved, 0).next;
    check(has_converged || next.allFinite(),
          "precice: window {} has no finite iterate to follow iteration {}", clock_.window(),
          iteration_);
  }
  for (Way &way : ways_)
    way.iterate = way.computed;
  Eigen::Index at = 0;
  if (next.size() > 0)
    for (Way *way : chosen) {
      if (way->scale > 0)
        way->iterate = next.segment(at, way->iterate.size()) / way->scale;
      at += way->iterate.size();
    }
}

// What this side reads from now on. The first's `iterate` came with the answer; in a serial scheme
// the second reads what the first computes.
void Coupling::take_over(bool has_converged) {
  for (Way &way : ways_) {
    if (way.iterate.size() == 0)
      way.iterate = way.computed;
    if (way.goes_out)
      continue;
    way.end = mapped(way, way.iterate);
    if (has_converged)
      way.start = way.end;
  }
}

// precice-NAME-watchpoint-POINT.log in the current folder: the time, then the fields of the mesh at
// the vertex that is nearest to the point.
void Coupling::record_watch_points() {
  if (watches_.empty())
    for (const WatchPoint &point : self_.watch_points) {
      bridge::InterfaceMesh place{mesh(point.mesh).dim, mesh(point.mesh).dim, point.coordinate, {}};
      std::string header = "time_s";
      for (const Way &way : ways_)
        for (int c = 0; way.own.mesh == point.mesh && c < way.components; ++c)
          header += fmt::format(",{}_{}", way.own.data, c);
      const bridge::NodeTree nodes(mesh(point.mesh));
      watches_.push_back(
          {static_cast<std::size_t>(nodes.nearest(place.point(0), 1).front().node), point.mesh,
           CsvWriter(fmt::format("precice-{}-watchpoint-{}.log", name_, point.name), header)});
    }
  for (Watch &watch : watches_) {
    std::vector<double> row{clock_.time()};
    for (const Way &way : ways_)
      for (int c = 0; way.own.mesh == watch.mesh && c < way.components; ++c) {
        const std::size_t k =
            watch.node * static_cast<std::size_t>(way.components) + static_cast<std::size_t>(c);
        row.push_back(way.goes_out ? written_.at({watch.mesh, way.own.data})[k]
                                   : way.start[static_cast<Eigen::Index>(k)]);
      }
    watch.csv.row(row);
  }
}

void Coupling::finalize() {
  told([&] {
    check(link_ && !is_ongoing(), "precice: {} called finalize at t = {:.6g} s, before the end",
          name_, clock_.time());
    const auto listen = [&] {
      link_->receive(FrameType::goodbye, bridge::record_limit(0), "the goodbye",
                     [](PayloadReader &) { return 0; });
    };
    if (is_first_)
      link_->send(FrameType::goodbye, PayloadWriter());
    listen();
    if (!is_first_)
      link_->send(FrameType::goodbye, PayloadWriter());
  });
  link_->stop_heartbeat();
  is_silent_ = true;
}

} // namespace sluice::precice_layer
