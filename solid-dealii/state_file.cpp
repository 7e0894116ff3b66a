// SPDX-License-Identifier: MIT
#include "solid-dealii/state_file.hpp"

#include "bridge/base/check.hpp"
#include "bridge/base/hdf5_file.hpp"

#include <hdf5_hl.h>

namespace sluice::solid {
namespace {

constexpr const char *format_name = "sluice-solid-state";
constexpr int format_version = 2;

// body(name, vector) for every vector of the state: the one list that writing and reading share.
template <class State, class Body> void for_each_vector(State &state, Body &&body) {
  body("displacement", state.displacement);
  body("velocity", state.velocity);
  body("acceleration", state.acceleration);
  body("modes", state.modes);
  body("branch", state.branch);
}

using hdf5::File;
using hdf5::Quiet;

// The parts of all ranks one after the other, on the root.
SolidState gathered(const SolidState &part, const Ranks &ranks) {
  SolidState whole = part;
  for_each_vector(whole, [&](const char *, Eigen::VectorXd &v) {
    std::vector<double> all;
    for (const auto &list : ranks.gather({v.begin(), v.end()}))
      all.insert(all.end(), list.begin(), list.end());
    v = Eigen::Map<const Eigen::VectorXd>(all.data(), std::ssize(all));
  });
  return whole;
}

// The root's `all` in parts of the sizes that `part` has on every rank.
void scatter(const Eigen::VectorXd &all, Eigen::VectorXd &part, const Ranks &ranks) {
  Ranks::Lists lists;
  const double *from = all.data();
  for (const auto &size : ranks.gather({static_cast<double>(part.size())})) {
    const auto n = static_cast<std::ptrdiff_t>(size.front());
    lists.emplace_back(from, from + n);
    from += n;
  }
  const std::vector<double> mine = ranks.scatter(lists);
  part = Eigen::Map<const Eigen::VectorXd>(mine.data(), std::ssize(mine));
}

void scatter(const SolidState &whole, SolidState &part, const Ranks &ranks) {
  std::vector<const Eigen::VectorXd *> wholes;
  for_each_vector(whole, [&](const char *, const Eigen::VectorXd &v) { wholes.push_back(&v); });
  auto all = wholes.begin();
  for_each_vector(part, [&](const char *, Eigen::VectorXd &v) { scatter(**all++, v, ranks); });
  part.step = static_cast<long>(ranks.from_root(static_cast<double>(whole.step)));
  part.load_work = ranks.from_root(whole.load_work);
}

void write_to(const std::filesystem::path &path, const SavedState &saved, int n_ranks) {
  const File file(H5Fcreate(path.c_str(), H5F_ACC_TRUNC, H5P_DEFAULT, H5P_DEFAULT));
  bool is_written = file >= 0;
  const auto step = static_cast<long long>(saved.state.step);
  is_written = is_written && H5LTset_attribute_string(file, "/", "format", format_name) >= 0 &&
               H5LTset_attribute_int(file, "/", "version", &format_version, 1) >= 0 &&
               H5LTset_attribute_int(file, "/", "ranks", &n_ranks, 1) >= 0 &&
               H5LTset_attribute_double(file, "/", "time_s", &saved.time, 1) >= 0 &&
               H5LTset_attribute_long_long(file, "/", "step", &step, 1) >= 0 &&
               H5LTset_attribute_double(file, "/", "load_work_j", &saved.state.load_work, 1) >= 0;
  const hid_t group =
      is_written ? H5Gcreate2(file, "state", H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT) : -1;
  for_each_vector(saved.state, [&](const char *name, const Eigen::VectorXd &v) {
    const auto size = static_cast<hsize_t>(v.size());
    const double none = 0; // an empty vector still needs an address
    is_written = is_written && group >= 0 &&
                 H5LTmake_dataset_double(group, name, 1, &size, v.size() ? v.data() : &none) >= 0;
  });
  if (group >= 0)
    H5Gclose(group);
  if (const hsize_t size = saved.bridge.size(); is_written && size > 0)
    is_written =
        H5LTmake_dataset(file, "bridge", 1, &size, H5T_NATIVE_UCHAR, saved.bridge.data()) >= 0;
  is_written = is_written && H5Fflush(file, H5F_SCOPE_LOCAL) >= 0;
  check(is_written, "{}: cannot be written; is the folder writable and the disk not full?",
        path.string());
}

SavedState read_whole(const std::filesystem::path &path, const SolidState &like, int n_ranks) {
  const Quiet quiet;
  const std::string name = path.string();
  const File file(H5Fopen(name.c_str(), H5F_ACC_RDONLY, H5P_DEFAULT));
  check(file >= 0, "{}: not a readable HDF5 file", name);
  SavedState saved{like, 0, {}};
  int version = 0, n_ranks_then = 0;
  long long step = 0;
  check(H5LTget_attribute_int(file, "/", "version", &version) >= 0 &&
            H5LTget_attribute_double(file, "/", "time_s", &saved.time) >= 0 &&
            H5LTget_attribute_long_long(file, "/", "step", &step) >= 0 &&
            H5LTget_attribute_double(file, "/", "load_work_j", &saved.state.load_work) >= 0,
        "{}: not a state that sluice-solid wrote", name);
  check(version == format_version,
        "{}: written in version {} of the format, this program reads version {}", name, version,
        format_version);
  check(H5LTget_attribute_int(file, "/", "ranks", &n_ranks_then) >= 0 && n_ranks_then == n_ranks,
        "{}: written by a body on {} ranks, this one is on {}", name, n_ranks_then, n_ranks);
  saved.state.step = static_cast<long>(step);
  for_each_vector(saved.state, [&](const char *vector, Eigen::VectorXd &v) {
    const std::string place = std::string("state/") + vector;
    hsize_t size = 0;
    check(H5LTget_dataset_info(file, place.c_str(), &size, nullptr, nullptr) >= 0,
          "{}: '{}' is missing", name, place);
    check(
        size == static_cast<hsize_t>(v.size()),
        "{}: '{}' holds {} numbers, this body has {}; mesh, element and material must be those of "
        "the run that wrote it",
        name, place, size, v.size());
    check(size == 0 || H5LTread_dataset_double(file, place.c_str(), v.data()) >= 0,
          "{}: '{}' is damaged", name, place);
  });
  if (H5LTfind_dataset(file, "bridge") > 0) {
    hsize_t size = 0;
    check(H5LTget_dataset_info(file, "bridge", &size, nullptr, nullptr) >= 0,
          "{}: 'bridge' is damaged", name);
    saved.bridge.resize(size);
    check(H5LTread_dataset(file, "bridge", H5T_NATIVE_UCHAR, saved.bridge.data()) >= 0,
          "{}: 'bridge' is damaged", name);
  }
  return saved;
}

} // namespace

void write_state(const std::filesystem::path &file, const SavedState &saved, const Ranks &ranks) {
  const SavedState whole{gathered(saved.state, ranks), saved.time, saved.bridge};
  if (!ranks.is_root())
    return;
  const Quiet quiet;
  const std::filesystem::path part = file.string() + ".part";
  write_to(part, whole, ranks.size());
  std::filesystem::rename(part, file);
}

SavedState read_state(const std::filesystem::path &file, const SolidState &like,
                      const Ranks &ranks) {
  const SolidState sizes = gathered(like, ranks);
  SavedState part{like, 0, {}}, whole;
  std::string problem = "the root cannot read " + file.string();
  try {
    if (ranks.is_root())
      whole = read_whole(file, sizes, ranks.size());
    problem = ranks.is_root() ? "" : problem;
  } catch (const UserError &error) {
    problem = error.what();
  }
  check(ranks.from_root(problem.empty()) != 0, "{}", problem);
  scatter(whole.state, part.state, ranks);
  part.time = ranks.from_root(whole.time);
  part.bridge = std::move(whole.bridge);
  return part;
}

} // namespace sluice::solid
