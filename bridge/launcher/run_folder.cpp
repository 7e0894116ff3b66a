// SPDX-License-Identifier: MIT
#include "bridge/launcher/run_folder.hpp"

#include "bridge/base/check.hpp"

#include <array>
#include <cstdlib>
#include <fstream>
#include <regex>
#include <sstream>
#include <string_view>

namespace sluice::launcher {

namespace fs = std::filesystem;

namespace {

constexpr std::array<std::string_view, 3> parts{"fluid", "wall", "solid"};

bool belongs_to_a_run(const std::string &file) {
  static const std::regex names(
      R"((fluid|wall|solid)_\d+\.(vtp|vtu))"
      R"(|(fluid|wall|solid)\.(log|pvd)|summary\.(json|md)|(fluid|solid)_summary\.json)"
      R"(|(tip|fluid|coupling|balance|solid_energy|solid_loads|fluid_loads)\.csv)"
      R"(|(tip|levels|strip|energy)\.png|case\.toml)");
  return std::regex_match(file, names);
}

std::string text_of(const fs::path &file) {
  std::ifstream in(file, std::ios::binary);
  std::stringstream text;
  text << in.rdbuf();
  return text.str();
}

std::string attribute(const std::string &element, const std::string &name) {
  std::smatch match;
  return std::regex_search(element, match, std::regex("\\b" + name + R"re(\s*=\s*"([^"]*)")re"))
             ? match[1].str()
             : "";
}

std::string entries_of(const std::string &collection, std::string_view part, std::size_t number) {
  static const std::regex data_set(R"(<DataSet\b[^>]*>)");
  std::string entries;
  for (auto it = std::sregex_iterator(collection.begin(), collection.end(), data_set);
       it != std::sregex_iterator(); ++it)
    // ParaView takes 0.04 and 0.040000000000000001 for two instants: one spelling for all parts
    entries +=
        fmt::format("    <DataSet timestep=\"{:.9g}\" part=\"{}\" name=\"{}\" file=\"{}\"/>\n",
                    std::strtod(attribute(it->str(), "timestep").c_str(), nullptr), number, part,
                    attribute(it->str(), "file"));
  return entries;
}

} // namespace

void prepare_run_folder(const fs::path &folder, const std::string &name,
                        const fs::path &case_file) {
  std::error_code error;
  fs::create_directories(folder, error);
  check(!error && fs::is_directory(folder), "{}: cannot be made ({}); give another --out folder",
        folder.string(), error.message());
  const std::string case_text = text_of(case_file); // it may lie in this very folder
  for (const auto &entry : fs::directory_iterator(folder)) {
    const std::string file = entry.path().filename().string();
    if (entry.is_regular_file() && (belongs_to_a_run(file) || file == name + ".pvd"))
      fs::remove(entry.path());
  }
  std::ofstream copy(folder / "case.toml", std::ios::binary);
  copy << case_text << std::flush;
  check(copy.good(), "{}: cannot be written; give another --out folder",
        (folder / "case.toml").string());
}

fs::path combine_collections(const fs::path &folder, const std::string &name) {
  std::string entries;
  for (std::size_t part = 0; part < parts.size(); ++part)
    entries += entries_of(text_of(folder / fmt::format("{}.pvd", parts[part])), parts[part], part);
  if (entries.empty())
    return {};
  const fs::path file = folder / (name + ".pvd");
  std::ofstream out(file, std::ios::binary);
  out << "<?xml version=\"1.0\"?>\n"
         "<VTKFile type=\"Collection\" version=\"0.1\">\n  <Collection>\n"
      << entries << "  </Collection>\n</VTKFile>\n"
      << std::flush;
  check(out.good(), "{}: writing failed; is the disk full?", file.string());
  return file;
}

} // namespace sluice::launcher
