// SPDX-License-Identifier: MIT
#include "solid-dealii/state_file.hpp"

#include "bridge/base/check.hpp"

#include <hdf5.h>
#include <hdf5_hl.h>

namespace sluice::solid {
namespace {

constexpr const char *format_name = "sluice-solid-state";
constexpr int format_version = 1;

// body(name, vector) for every vector of the state: the one list that writing and reading share.
template <class State, class Body> void for_each_vector(State &state, Body &&body) {
  body("displacement", state.displacement);
  body("velocity", state.velocity);
  body("acceleration", state.acceleration);
  body("modes", state.modes);
  body("branch", state.branch);
}

// Closed at the end of its scope.
class File {
public:
  explicit File(hid_t id) : id_(id) {}
  File(const File &) = delete;
  File &operator=(const File &) = delete;
  ~File() {
    if (id_ >= 0)
      H5Fclose(id_);
  }
  operator hid_t() const { return id_; }

private:
  hid_t id_;
};

// The library prints every failure by itself unless told not to; ours are in the exceptions.
class Quiet {
public:
  Quiet() {
    H5Eget_auto2(H5E_DEFAULT, &print_, &stream_);
    H5Eset_auto2(H5E_DEFAULT, nullptr, nullptr);
  }
  Quiet(const Quiet &) = delete;
  Quiet &operator=(const Quiet &) = delete;
  ~Quiet() { H5Eset_auto2(H5E_DEFAULT, print_, stream_); }

private:
  H5E_auto2_t print_ = nullptr;
  void *stream_ = nullptr;
};

void write_to(const std::filesystem::path &path, const SavedState &saved) {
  const File file(H5Fcreate(path.c_str(), H5F_ACC_TRUNC, H5P_DEFAULT, H5P_DEFAULT));
  bool is_written = file >= 0;
  const auto step = static_cast<long long>(saved.state.step);
  is_written = is_written && H5LTset_attribute_string(file, "/", "format", format_name) >= 0 &&
               H5LTset_attribute_int(file, "/", "version", &format_version, 1) >= 0 &&
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

} // namespace

std::filesystem::path state_file(const std::filesystem::path &whole, const Ranks &ranks) {
  if (ranks.is_one())
    return whole;
  auto part = whole;
  return part.replace_extension(
      fmt::format("{}of{}{}", ranks.rank() + 1, ranks.size(), whole.extension().string()));
}

void write_state(const std::filesystem::path &file, const SavedState &saved) {
  const Quiet quiet;
  const std::filesystem::path part = file.string() + ".part";
  write_to(part, saved);
  std::filesystem::rename(part, file);
}

SavedState read_state(const std::filesystem::path &path, const SolidState &like) {
  const Quiet quiet;
  const std::string name = path.string();
  const File file(H5Fopen(name.c_str(), H5F_ACC_RDONLY, H5P_DEFAULT));
  check(file >= 0, "{}: not a readable HDF5 file", name);
  SavedState saved{like, 0, {}};
  int version = 0;
  long long step = 0;
  check(H5LTget_attribute_int(file, "/", "version", &version) >= 0 &&
            H5LTget_attribute_double(file, "/", "time_s", &saved.time) >= 0 &&
            H5LTget_attribute_long_long(file, "/", "step", &step) >= 0 &&
            H5LTget_attribute_double(file, "/", "load_work_j", &saved.state.load_work) >= 0,
        "{}: not a state that sluice-solid wrote", name);
  check(version == format_version,
        "{}: written in version {} of the format, this program reads version {}", name, version,
        format_version);
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

} // namespace sluice::solid
