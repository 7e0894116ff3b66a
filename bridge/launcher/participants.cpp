// SPDX-License-Identifier: MIT
#include "bridge/launcher/participants.hpp"

#include "bridge/settings.hpp"

#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <unistd.h>

namespace sluice::launcher {

namespace fs = std::filesystem;

namespace {

/// A participant's table and the program that plays it unless the table names another.
struct Role {
  std::string_view table;
  std::string_view program;
};

// The first one listed shows its progress on the terminal.
constexpr std::array roles{Role{"fluid", "sluice-fluid"}, Role{"solid", "sluice-solid"}};

// Where the build puts programs, relative to its root.
constexpr std::array build_folders{"fluid", "solid-dealii", "bridge/calculix", "bridge"};

struct ProgramChoice {
  std::string program;
  template <class Reader> void describe(Reader &read) {
    read("program", program, "which program plays this participant")
        .check(program.find('/') == std::string::npos,
               "must be a name; --programs gives the folder");
  }
};

std::string program_of(const Role &role, const Config &config) {
  const std::string chosen = config.peek<ProgramChoice>(role.table).program;
  return chosen.empty() ? std::string(role.program) : chosen;
}

// The fluid's own rule for having a partner: a coupled wall, and walls that move.
struct FluidWalls {
  std::string coupled_walls = "move";
  template <class Reader> void describe(Reader &read) {
    read("coupled_walls", coupled_walls, "what coupled walls do");
  }
};
struct Wall {
  bool coupled = false;
  template <class Reader> void describe(Reader &read) {
    read("coupled", coupled, "moves with the partner of the bridge");
  }
};

bool walls_are_held(const Config &config) {
  return config.peek<FluidWalls>("fluid").coupled_walls != "move";
}

bool fluid_has_partner(const Config &config) {
  const auto walls = config.peek_all<Wall>("fluid.wall");
  return !walls_are_held(config) &&
         std::any_of(walls.begin(), walls.end(), [](const Wall &wall) { return wall.coupled; });
}

fs::path own_folder() {
  std::error_code error;
  const fs::path self = fs::read_symlink("/proc/self/exe", error);
  check(!error, "cannot tell where this program lies (/proc/self/exe: {}); give --programs",
        error.message());
  return self.parent_path();
}

std::vector<fs::path> folders_to_search(const fs::path &given) {
  if (!given.empty())
    return {fs::absolute(given)};
  const fs::path own = own_folder();
  std::vector<fs::path> folders{own};
  // <build>/bridge/launcher/sluice, when it runs from the build tree
  for (const fs::path folder : build_folders)
    folders.push_back(own.parent_path().parent_path() / folder);
  return folders;
}

fs::path find_program(std::string_view table, const std::string &program, const fs::path &given) {
  std::vector<std::string> tried;
  for (const fs::path &folder : folders_to_search(given)) {
    const fs::path candidate = folder / program;
    if (access(candidate.c_str(), X_OK) == 0 && fs::is_regular_file(candidate))
      return candidate;
    tried.push_back(folder.string());
  }
  fail("[{}] needs the program {}, which is not there (looked in {}); build it "
       "(CMake's summary says what was skipped and why) or give its folder with --programs",
       table, program, fmt::join(tried, ", "));
}

} // namespace

Case read_case(const Config &config) {
  // Each participant knows its own sub-tables.
  config.allow_tables({"case", "parameters", "bridge", "fluid", "fluid.*", "solid", "solid.*"});
  const std::string name = config.read<bridge::CaseSettings>("case").name;
  check(!name.empty() && name.find('/') == std::string::npos,
        "{}: [case] needs a name without a slash, for the run folder and the ParaView file",
        config.file_name());
  return {name};
}

std::vector<Participant> participants_of(const Config &config, const fs::path &folder) {
  check(config.has_table("fluid"),
        "{}: the case has no [fluid] table, and a solid would wait for it in vain; give it one, or "
        "run sluice-solid --alone",
        config.file_name());
  const bool is_coupled = fluid_has_partner(config);
  check(!is_coupled || config.has_table("solid"),
        "{}: a wall is coupled, but there is no [solid] table; give it one, or hold the walls with "
        "fluid.coupled_walls = \"stay\"",
        config.file_name());
  check(
      is_coupled || !config.has_table("solid") || walls_are_held(config),
      "{}: there is a [solid] table, but no [[fluid.wall]] has coupled = true: nothing would move "
      "with it",
      config.file_name());
  std::vector<Participant> found;
  for (const Role &role : roles)
    if (config.has_table(role.table) && (role.table == "fluid" || is_coupled))
      found.push_back(
          {std::string(role.table), find_program(role.table, program_of(role, config), folder)});
  return found;
}

} // namespace sluice::launcher
