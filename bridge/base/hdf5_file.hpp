// SPDX-License-Identifier: MIT
// What every reader and writer of HDF5 files needs: closing, and silence. Include it in .cpp files
// of programs that link HDF5.
#pragma once

#include <hdf5.h>

namespace sluice::hdf5 {

/// A file, closed at the end of its scope; negative: it could not be opened.
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

/// In its scope the library prints nothing; else it reports every failure by itself.
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

} // namespace sluice::hdf5
