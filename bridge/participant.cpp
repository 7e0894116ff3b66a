// SPDX-License-Identifier: MIT
#include "bridge/participant.hpp"

#include "bridge/base/timer.hpp"
#include "bridge/side.hpp"
#include "bridge/transport.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <optional>
#include <sstream>
#include <utility>

namespace sluice::bridge {

namespace {

// The lines of the case that the saved state rests on: not where the two meet, nor how long one
// waits, nor when the run ends.
std::string text_that_must_stay(const std::string &case_text) {
  std::istringstream in(case_text);
  std::string kept;
  for (std::string line; std::getline(in, line);) {
    const std::string key = line.substr(0, line.find(' '));
    constexpr std::array free{"bridge.transport", "bridge.address", "bridge.connect_deadline_s",
                              "bridge.silence_deadline_s", "bridge.restart_every_windows"};
    if ((key.starts_with("bridge.") || key == "case.time_step_s") &&
        std::find(free.begin(), free.end(), key) == free.end())
      kept += line + '\n';
  }
  return kept;
}

void check_same_coupling(const std::string &before, const std::string &now) {
  std::istringstream a(before), b(now);
  while (true) {
    std::string was, is;
    const bool was_there = static_cast<bool>(std::getline(a, was));
    const bool is_there = static_cast<bool>(std::getline(b, is));
    if (!was_there && !is_there)
      return;
    check(was == is,
          "bridge: the restart file was written by a run with '{}', this one has '{}'; a run goes "
          "on with the coupling that it began with",
          was.empty() ? "nothing more" : was, is.empty() ? "nothing more" : is);
  }
}

} // namespace

class Participant::Impl {
public:
  Impl(const std::string &name, const Config &config, std::filesystem::path folder,
       std::unique_ptr<Transport> connected)
      : role(role_of(name)), case_text(config.canonical_text("bridge.token")),
        settings(config.read<BridgeSettings>("bridge")),
        case_settings(config.read<CaseSettings>("case")),
        clock(case_settings, settings.max_halvings, settings.windows_to_grow),
        out_dir(std::move(folder)), transport(std::move(connected)) {
    std::filesystem::create_directories(out_dir);
    side = role == Role::fluid ? make_fluid_side(settings) : make_solid_side(settings, out_dir);
  }

  // Runs one of the participant's calls; a failure is told to the partner before it goes on.
  template <class Action> void told(Action &&action) {
    try {
      action();
    } catch (const std::exception &error) {
      give_up(error.what());
      throw;
    }
  }
  void give_up(std::string_view message) noexcept {
    if (link && !is_silent)
      link->send_abort(message);
    is_silent = true;
  }

  void set_mesh(InterfaceMesh new_mesh) {
    check(!link, "bridge: set_mesh comes before initialize");
    check_mesh(new_mesh, name_of(role));
    mesh = std::move(new_mesh);
    for (auto &[field, values] : side->writable)
      values.assign(mesh.positions.size(), 0.0);
  }

  void initialize() {
    check(!mesh.positions.empty(), "bridge: the {} must set_mesh before initialize", name_of(role));
    check(!link, "bridge: initialize comes once");
    link = transport ? greet_partner(role, settings, std::move(transport))
                     : connect_to_partner(role, settings, out_dir);
    link->start_heartbeat();
    compare_cases(role, *link, case_text + start_line());
    partner_mesh = side->initialize(*link, mesh);
    if (!saved.empty())
      restore_side();
    side->await_window(exchange());
  }

  // Last in what the two sides compare at connect.
  std::string start_line() const {
    return saved.empty() ? "start = first window"
                         : fmt::format("start = after window {} of run {:016x} (restart)",
                                       clock.window() - 1, saved_run);
  }

  /// Beside what the two sides of the bridge save by themselves.
  template <class Archive> void archive(Archive &state) {
    state(clock, statistics, totals, length_before);
  }
  std::vector<std::byte> saved_state() {
    StateWriter state;
    std::string name = name_of(role), text = text_that_must_stay(case_text);
    state(name, text, side->run);
    archive(state);
    side->save(state);
    return state.bytes();
  }
  void restore(std::span<const std::byte> bytes) {
    check(!link, "bridge: restore comes before initialize");
    saved.assign(bytes.begin(), bytes.end());
    StateReader state = begin_reading(saved_run);
    archive(state);
  }
  void restore_side() {
    StateReader state = begin_reading(saved_run);
    archive(state);
    side->restore(state);
    state.finish();
  }
  // `run`: the number of the run that saved the state.
  StateReader begin_reading(std::uint64_t &run) const {
    StateReader state(saved);
    std::string name, text;
    state(name, text, run);
    check(name == name_of(role), "bridge: the {} was given the {}'s restart file", name_of(role),
          name);
    check_same_coupling(text, text_that_must_stay(case_text));
    return state;
  }

  void advance(double dt) {
    check(link && is_ongoing(), "bridge: advance outside the coupled run");
    check(std::isfinite(dt) && dt > 0 && dt <= clock.left() * (1 + 1e-9),
          "bridge: a step of {} s, where {} s of window {} are left", dt, clock.left(),
          clock.window());
    enter_window();
    is_complete = is_rejected = must_write_restart = false;
    if (!clock.step(dt))
      return;
    clock.restart_window();
    const Verdict verdict = side->advance(exchange());
    failure.clear();
    if (verdict == Verdict::converged)
      complete_window();
    else if (verdict == Verdict::retry)
      halve_window();
    else
      repeat_window();
  }

  void complete_window() {
    ++statistics.windows;
    statistics.iterations += iteration;
    statistics.iterations_max = std::max<long>(statistics.iterations_max, iteration);
    is_complete = true;
    iteration = 1;
    length_before = clock.window_length();
    clock.next_window();
    is_stopped = side->stops_here && !clock.is_over();
    must_enter_window = is_ongoing();
    const bool is_due = settings.restart_every > 0 &&
                        ((clock.window() - 1) % settings.restart_every == 0 || clock.is_over());
    must_write_restart = is_stopped || is_due;
  }
  // Not in the advance before: a partner that dies in this window must not cost the last one, which
  // the caller has not seen as complete yet.
  void enter_window() {
    if (std::exchange(must_enter_window, false))
      side->await_window(exchange());
  }
  // Ends the run where windows are not tried again.
  void fail_window(const std::string &reason) {
    check(settings.max_halvings > 0, "{}", reason);
    failure = reason.empty() ? "no reason was given" : reason;
  }
  void halve_window() {
    clock.halve();
    is_rejected = true;
    iteration = 1;
    must_enter_window = true;
  }
  void repeat_window() {
    is_rejected = true;
    ++iteration;
  }

  bool is_ongoing() const { return !clock.is_over() && !is_stopped; }
  Exchange exchange() {
    return {*link, clock, statistics, iteration, totals, failure, wants_to_stop};
  }

  Role role;
  std::string case_text;
  BridgeSettings settings;
  CaseSettings case_settings;
  WindowClock clock;
  std::filesystem::path out_dir;
  std::unique_ptr<Transport> transport; // until it becomes the link's
  std::unique_ptr<Side> side;
  InterfaceMesh mesh, partner_mesh;
  std::unique_ptr<Link> link;
  std::optional<WindowTotals> totals;
  mutable Statistics statistics;
  std::string failure;      // why this side could not do the window
  double length_before = 0; // [s] of the window before
  int iteration = 1;
  bool is_complete = false;
  bool is_rejected = false;
  bool must_enter_window = false;
  std::vector<std::byte> saved; // of the run that this one goes on from
  std::uint64_t saved_run = 0;  // its number
  bool must_write_restart = false;
  bool wants_to_stop = false, is_stopped = false;
  bool is_silent = false; // goodbye or abort said
};

Participant::Participant(std::string name, const Config &config,
                         const std::filesystem::path &out_dir)
    : impl_(std::make_unique<Impl>(name, config, out_dir, nullptr)) {}

Participant::Participant(std::string name, const Config &config,
                         const std::filesystem::path &out_dir, std::unique_ptr<Transport> transport)
    : impl_(std::make_unique<Impl>(name, config, out_dir, std::move(transport))) {}

Participant::~Participant() {
  impl_->give_up(fmt::format("the {} ended before the run was complete; its own output says why",
                             name_of(impl_->role)));
}

void Participant::set_mesh(InterfaceMesh mesh) { impl_->set_mesh(std::move(mesh)); }

void Participant::initialize() {
  const Stopwatch watch;
  impl_->told([&] { impl_->initialize(); });
  impl_->statistics.initialize_s = watch.seconds();
}

bool Participant::is_coupling_ongoing() const { return impl_->is_ongoing(); }
bool Participant::is_stopped() const { return impl_->is_stopped; }
bool Participant::requires_writing_restart() const { return impl_->must_write_restart; }
void Participant::request_stop() { impl_->wants_to_stop = true; }

std::vector<std::byte> Participant::saved_state() const {
  check(impl_->is_complete, "bridge: saved_state follows an advance that completed a window");
  return impl_->saved_state();
}

void Participant::restore(std::span<const std::byte> saved) {
  try {
    impl_->restore(saved);
  } catch (const MalformedMessage &error) {
    fail("bridge: the state of the bridge in the restart file is damaged: {}", error.what());
  }
}
bool Participant::is_time_window_complete() const { return impl_->is_complete; }
double Participant::max_time_step_size() const { return impl_->clock.left(); }

bool Participant::requires_writing_checkpoint() const {
  const BridgeSettings &settings = impl_->settings;
  return (settings.is_implicit() || settings.max_halvings > 0) && impl_->iteration == 1 &&
         impl_->clock.elapsed() == 0 && is_coupling_ongoing();
}
bool Participant::requires_reading_checkpoint() const { return impl_->is_rejected; }

namespace {

template <class Fields>
auto &field_of(Fields &fields, std::string_view name, Role role, std::string_view verb) {
  const auto found = fields.find(name);
  if (found != fields.end())
    return found->second;
  std::vector<std::string> names;
  for (const auto &[known, values] : fields)
    names.push_back(known);
  fail("bridge: the {} {} {}, not '{}'", name_of(role), verb, fmt::join(names, " and "), name);
}

void check_size(std::string_view field, std::size_t got, const InterfaceMesh &mesh) {
  check(got == mesh.positions.size(),
        "bridge: {} needs {} values ({} nodes with {} components), {} were given", field,
        mesh.positions.size(), mesh.n_nodes(), mesh.dim, got);
}

// True when all values are finite. One pass that neither branches nor leaves early, as it costs as
// much as the transport of the values otherwise.
bool copy_finite(std::span<const double> values, std::span<double> copy) {
  constexpr std::uint64_t exponent = 0x7ff0000000000000u; // all of it set: infinity or no number
  std::uint64_t bad = 0;
  for (std::size_t k = 0; k < values.size(); ++k) {
    bad |= (std::bit_cast<std::uint64_t>(values[k]) & exponent) == exponent;
    copy[k] = values[k];
  }
  return bad == 0;
}

// What is wrong with the first value that is not finite.
std::string not_finite(std::string_view field, std::span<const double> values,
                       const InterfaceMesh &mesh, Role role, double time) {
  const auto bad =
      std::find_if_not(values.begin(), values.end(), [](double v) { return std::isfinite(v); });
  const auto node =
      static_cast<std::size_t>(bad - values.begin()) / static_cast<std::size_t>(mesh.dim);
  return fmt::format("bridge: the {}'s {} at t = {:.6g} s is not finite: {} at node {}, reference "
                     "position ({:.6g}) m",
                     name_of(role), field, time, *bad, node, fmt::join(mesh.position(node), ", "));
}

// At the part `s` of the window: linear, or on the parabola through the start of the window before,
// `before` window lengths earlier (0: linear).
void interpolate(const WindowField &window, double s, double before, std::span<double> values) {
  if (s >= 1 || s <= 0) {
    const std::vector<double> &known = s >= 1 ? window.end : window.start;
    std::copy(known.begin(), known.end(), values.begin());
    return;
  }
  for (std::size_t k = 0; k < values.size(); ++k) {
    const double rise = window.end[k] - window.start[k];
    values[k] = window.start[k] + s * rise;
    if (before > 0) {
      const double bend = (rise - (window.start[k] - window.before[k]) / before) / (1 + before);
      values[k] += s * (s - 1) * bend;
    }
  }
}

} // namespace

void Participant::write_data(std::string_view field, std::span<const double> values) {
  impl_->told([&] {
    auto &written = field_of(impl_->side->writable, field, impl_->role, "writes");
    check_size(field, values.size(), impl_->mesh);
    if (copy_finite(values, written))
      return;
    std::fill(written.begin(), written.end(), 0);
    impl_->fail_window(not_finite(field, values, impl_->mesh, impl_->role, time()));
  });
}

void Participant::report_failure(std::string_view reason) {
  impl_->told([&] {
    check(impl_->link && impl_->is_ongoing(), "bridge: report_failure outside the coupled run");
    impl_->fail_window(std::string(reason));
  });
}

void Participant::read_data(std::string_view field, double relative_time,
                            std::span<double> values) const {
  impl_->told([&] {
    const WindowField &window = field_of(impl_->side->readable, field, impl_->role, "reads");
    check(impl_->link != nullptr, "bridge: read_data follows initialize");
    check_size(field, values.size(), impl_->mesh);
    impl_->enter_window();
    const WindowClock &clock = impl_->clock;
    const double length = clock.is_over() ? 1 : clock.window_length();
    const double s = clock.is_over() ? 0 : (clock.elapsed() + relative_time) / length;
    check(s >= -1e-9 && s <= 1 + 1e-9,
          "bridge: {} read at {} s after t = {} s, outside the window of {} s", field,
          relative_time, time(), length);
    const bool is_parabola = impl_->settings.interpolation == "quadratic" && !window.before.empty();
    interpolate(window, s, is_parabola ? impl_->length_before / length : 0, values);
  });
}

void Participant::advance(double dt) {
  const Stopwatch watch;
  const double waited = impl_->link ? impl_->link->wait_s() : 0;
  impl_->told([&] { impl_->advance(dt); });
  impl_->statistics.bridge_s += watch.seconds() - (impl_->link->wait_s() - waited);
}

void Participant::finalize() {
  impl_->told([&] {
    check(impl_->link != nullptr, "bridge: finalize without initialize");
    check(!impl_->is_ongoing(), "bridge: the {} ended its run at t = {:.6g} s, before the end",
          name_of(impl_->role), time());
    impl_->side->finalize(impl_->exchange());
  });
  impl_->link->stop_heartbeat();
  impl_->is_silent = true;
}

void Participant::abort(std::string_view message) noexcept { impl_->give_up(message); }

void Participant::report_totals(const InterfaceTotals &totals) {
  check(impl_->is_complete, "bridge: report_totals follows an advance that completed a window");
  impl_->totals = WindowTotals{impl_->clock.window() - 1, totals};
  impl_->side->add_totals(*impl_->totals, impl_->statistics);
}

const InterfaceMesh &Participant::mesh() const { return impl_->mesh; }
const InterfaceMesh &Participant::partner_mesh() const { return impl_->partner_mesh; }
const MapReport &Participant::map_report() const { return impl_->side->map_report(); }
const BridgeSettings &Participant::settings() const { return impl_->settings; }
const CaseSettings &Participant::case_settings() const { return impl_->case_settings; }
long Participant::time_window() const { return impl_->clock.window(); }
int Participant::iteration() const { return impl_->iteration; }
double Participant::time() const { return impl_->clock.time(); }

const Statistics &Participant::statistics() const {
  if (impl_->link) {
    impl_->statistics.wait_s = impl_->link->wait_s();
    impl_->statistics.bytes_sent = impl_->link->bytes_sent();
    impl_->statistics.bytes_received = impl_->link->bytes_received();
  }
  return impl_->statistics;
}

} // namespace sluice::bridge
