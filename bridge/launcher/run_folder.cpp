// SPDX-License-Identifier: MIT
#include "bridge/launcher/run_folder.hpp"

#include "bridge/base/check.hpp"

#include <array>
#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <fcntl.h>
#include <fstream>
#include <regex>
#include <sstream>
#include <string_view>
#include <sys/file.h>
#include <unistd.h>
#include <utility>
#include <vector>

namespace sluice::launcher {

namespace fs = std::filesystem;

namespace {

constexpr std::array<std::string_view, 3> parts{"fluid", "wall", "solid"};
constexpr const char *lock_name = ".sluice-lock";

bool belongs_to_a_run(const std::string &file) {
  static const std::regex names(
      R"((fluid|wall|solid)_\d+\.(vtp|vtu))"
      R"(|(fluid|wall|solid)\.(log|pvd|pvd\.part)|summary\.(json|md)|(fluid|solid)_summary\.json)"
      R"(|(tip|fluid|coupling|balance|solid_energy|solid_loads|fluid_loads)\.csv)"
      R"(|restart_(fluid|solid)_\d+\.h5(\.part)?|probe_[\w-]+\.csv|(tip|levels|strip|energy|profiles|streamlines)\.png|case\.toml)");
  return std::regex_match(file, names);
}

std::string text_of(const fs::path &file) {
  std::ifstream in(file, std::ios::binary);
  std::stringstream text;
  text << in.rdbuf();
  return text.str();
}

// The case file may lie in the very folder that it is run into.
std::vector<fs::path> files_of_a_run(const fs::path &folder, const std::string &name,
                                     const fs::path &case_file) {
  std::vector<fs::path> files;
  for (const auto &entry : fs::directory_iterator(folder)) {
    const std::string file = entry.path().filename().string();
    const bool has_our_name = belongs_to_a_run(file) || file == name + ".pvd";
    if (entry.is_regular_file() && has_our_name && !fs::equivalent(entry.path(), case_file))
      files.push_back(entry.path());
  }
  return files;
}

void check_is_ours(const fs::path &folder, const std::string &name, const fs::path &case_file) {
  if (fs::exists(folder / lock_name) || fs::exists(folder / "summary.json"))
    return;
  const auto files = files_of_a_run(folder, name, case_file);
  check(files.empty(),
        "{}: has the name of a run's file, but no run has made this folder; it would be deleted: "
        "move it away or give another --out folder",
        files.empty() ? "" : files.front().string());
  for (const auto &entry : fs::directory_iterator(folder))
    check(fs::equivalent(entry.path(), case_file),
          "{}: holds files that no run has made ('{}'), and a run's would lie among them; give a "
          "new folder as --out",
          folder.string(), entry.path().filename().string());
}

void copy_case(const fs::path &from, const fs::path &to) {
  if (fs::exists(to)) // what an earlier run left is gone: this is the case file itself
    return;
  std::ofstream copy(to, std::ios::binary);
  copy << text_of(from) << std::flush;
  check(copy.good(), "{}: cannot be written; give another --out folder", to.string());
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

FolderLock::FolderLock(const fs::path &folder) {
  const fs::path file = folder / lock_name;
  file_ = ::open(file.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0644);
  check(file_ >= 0, "{}: cannot be written ({}); give another --out folder", file.string(),
        std::strerror(errno));
  if (::flock(file_, LOCK_EX | LOCK_NB) == 0)
    return;
  const int error = errno;
  ::close(file_);
  check(error != EWOULDBLOCK,
        "{}: another sluice run writes into this folder; wait for its end or give another --out "
        "folder",
        folder.string());
  fail("{}: cannot be locked ({}); give another --out folder", file.string(), std::strerror(error));
}

FolderLock::FolderLock(FolderLock &&other) noexcept : file_(std::exchange(other.file_, -1)) {}

FolderLock::~FolderLock() {
  if (file_ >= 0)
    ::close(file_);
}

FolderLock prepare_run_folder(const fs::path &folder, const std::string &name,
                              const fs::path &case_file) {
  std::error_code error;
  fs::create_directories(folder, error);
  check(!error && fs::is_directory(folder), "{}: cannot be made ({}); give another --out folder",
        folder.string(), error.message());
  check_is_ours(folder, name, case_file);
  FolderLock lock(folder);
  for (const fs::path &file : files_of_a_run(folder, name, case_file))
    fs::remove(file);
  copy_case(case_file, folder / "case.toml");
  return lock;
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
