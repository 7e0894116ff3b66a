// SPDX-License-Identifier: MIT
#include "bridge/launcher/summary.hpp"

#include "bridge/base/check.hpp"

#include <nlohmann/json.hpp>

#include <array>
#include <fstream>
#include <string_view>

namespace sluice::launcher {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

namespace {

constexpr std::array promised_keys{"points",
                                   "steps",
                                   "windows",
                                   "failed_windows",
                                   "lost_points",
                                   "outflow_points",
                                   "wall_returns",
                                   "wall_time_s",
                                   "cpu_time_s",
                                   "ms_per_step_fluid",
                                   "ms_per_step_solid",
                                   "ms_per_step_bridge",
                                   "phases_ms",
                                   "coupling_iterations_mean",
                                   "coupling_iterations_max",
                                   "force_balance_max",
                                   "moment_balance_max",
                                   "work_balance_max",
                                   "volume_drift_max",
                                   "energy_drift",
                                   "guarded_rows_per_step",
                                   "outflow_m2"};

// Both ends count these; the worse one counts.
bool takes_the_largest(std::string_view key) {
  return key == "failed_windows" || key == "coupling_iterations_max";
}

// These are measured here, or need a rule of their own.
bool is_not_copied(std::string_view key) {
  return key == "wall_time_s" || key == "cpu_time_s" || key == "phases_ms" || key == "completed" ||
         key == "message" || key == "note";
}

// One that is half written must not hide how the run ended: it counts as incomplete, with a note.
Json read_partial(const fs::path &file) {
  std::ifstream in(file);
  if (!in)
    return Json::object(); // the participant died before it wrote one
  Json partial = Json::parse(in, nullptr, false);
  if (partial.is_object())
    return partial;
  return {
      {"completed", false},
      {"note", fmt::format("{}: is not a JSON object; did the participant die while it wrote it, "
                           "or was the disk full?",
                           file.string())}};
}

void merge_values(Json &summary, const Json &partial) {
  for (const auto &[key, value] : partial.items()) {
    if (is_not_copied(key))
      continue;
    Json &known = summary[key];
    const bool is_larger = takes_the_largest(key) && known.is_number() && value.is_number() &&
                           value.get<double>() > known.get<double>();
    if (known.is_null() || is_larger)
      known = value;
  }
}

// {"pressure": 3.1} of the fluid becomes phases_ms.fluid.pressure; groups keep their name.
void merge_phases(Json &phases, const Json &partial, const std::string &participant) {
  const auto found = partial.find("phases_ms");
  if (found == partial.end() || !found->is_object())
    return;
  for (const auto &[name, value] : found->items())
    if (value.is_object())
      phases[name].update(value);
    else
      phases[participant][name] = value;
}

Json description_of(const Outcome &outcome) {
  return {{"exit_status", outcome.exit_status},
          {"ended", outcome.how_it_ended()},
          {"cpu_time_s", outcome.cpu_time_s},
          {"peak_memory_mb", outcome.peak_memory_mb},
          {"message", outcome.ok() ? "" : outcome.message}};
}

std::string processor() {
  std::ifstream in("/proc/cpuinfo");
  for (std::string line; std::getline(in, line);)
    if (line.starts_with("model name"))
      return line.substr(line.find(':') + 2);
  return "unknown";
}

} // namespace

bool write_summary(const fs::path &folder, const RunDescription &description,
                   const RunOutcome &outcome) {
  Json summary{{"case", description.case_name},
               {"case_file", description.case_file},
               {"overrides", description.overrides},
               {"started", description.started},
               {"processor", processor()},
               {"threads", description.threads},
               {"completed", false}};
  for (const char *key : promised_keys)
    summary[key] = nullptr;

  Json phases = Json::object(), participants = Json::object();
  bool completed = outcome.ok();
  double cpu_time_s = 0;
  for (const Outcome &participant : outcome.participants)
    cpu_time_s += participant.cpu_time_s;
  for (const char *name : {"fluid", "solid"})
    for (const Outcome &participant : outcome.participants)
      if (participant.participant == name) {
        const Json partial = read_partial(folder / fmt::format("{}_summary.json", name));
        merge_values(summary, partial);
        merge_phases(phases, partial, name);
        completed = completed && partial.value("completed", true);
        participants[name] = description_of(participant);
        participants[name]["note"] = partial.value("note", "");
      }

  summary["completed"] = completed;
  summary["wall_time_s"] = outcome.wall_time_s;
  summary["cpu_time_s"] = cpu_time_s;
  summary["phases_ms"] = phases;
  summary["participants"] = participants;

  const fs::path file = folder / "summary.json";
  std::ofstream out(file);
  // bytes that are not UTF-8 in a message must not cost the summary
  out << summary.dump(2, ' ', false, Json::error_handler_t::replace) << '\n' << std::flush;
  check(out.good(), "{}: writing failed; is the disk full?", file.string());
  return completed;
}

} // namespace sluice::launcher
