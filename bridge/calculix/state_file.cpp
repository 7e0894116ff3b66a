// SPDX-License-Identifier: MIT
#include "bridge/calculix/state_file.hpp"

#include "bridge/base/check.hpp"
#include "bridge/base/hdf5_file.hpp"

#include <hdf5_hl.h>

namespace sluice::calculix {
namespace {

constexpr const char *format_name = "sluice-calculix-state";
constexpr int format_version = 1;

using hdf5::File;
using hdf5::Quiet;

bool write_bytes(hid_t file, const char *name, const std::vector<std::byte> &bytes) {
  const hsize_t size = bytes.size();
  return H5LTmake_dataset(file, name, 1, &size, H5T_NATIVE_UCHAR, bytes.data()) >= 0;
}

bool read_bytes(hid_t file, const char *name, std::vector<std::byte> &bytes) {
  hsize_t size = 0;
  if (H5LTget_dataset_info(file, name, &size, nullptr, nullptr) < 0)
    return false;
  bytes.resize(size);
  return H5LTread_dataset(file, name, H5T_NATIVE_UCHAR, bytes.data()) >= 0;
}

bool write_to(const std::filesystem::path &path, const SavedState &saved) {
  const File file(H5Fcreate(path.c_str(), H5F_ACC_TRUNC, H5P_DEFAULT, H5P_DEFAULT));
  const auto windows = static_cast<long long>(saved.windows);
  return file >= 0 && H5LTset_attribute_string(file, "/", "format", format_name) >= 0 &&
         H5LTset_attribute_int(file, "/", "version", &format_version, 1) >= 0 &&
         H5LTset_attribute_double(file, "/", "time_s", &saved.time, 1) >= 0 &&
         H5LTset_attribute_long_long(file, "/", "windows", &windows, 1) >= 0 &&
         write_bytes(file, "ccx", saved.ccx) && write_bytes(file, "bridge", saved.bridge) &&
         H5Fflush(file, H5F_SCOPE_LOCAL) >= 0;
}

} // namespace

void write_state(const std::filesystem::path &file, const SavedState &saved) {
  const Quiet quiet;
  const std::filesystem::path part = file.string() + ".part";
  check(write_to(part, saved),
        "{}: cannot be written; is the folder writable and the disk not full?", part.string());
  std::filesystem::rename(part, file);
}

SavedState read_state(const std::filesystem::path &path) {
  const Quiet quiet;
  const std::string name = path.string();
  const File file(H5Fopen(name.c_str(), H5F_ACC_RDONLY, H5P_DEFAULT));
  check(file >= 0, "{}: not a readable HDF5 file", name);
  SavedState saved;
  int version = 0;
  long long windows = 0;
  check(H5LTget_attribute_int(file, "/", "version", &version) >= 0 && version == format_version &&
            H5LTget_attribute_double(file, "/", "time_s", &saved.time) >= 0 &&
            H5LTget_attribute_long_long(file, "/", "windows", &windows) >= 0 &&
            read_bytes(file, "ccx", saved.ccx) && read_bytes(file, "bridge", saved.bridge),
        "{}: not a state that this sluice-calculix wrote, or damaged", name);
  saved.windows = static_cast<long>(windows);
  return saved;
}

} // namespace sluice::calculix
