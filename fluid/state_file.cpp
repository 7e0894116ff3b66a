// SPDX-License-Identifier: MIT
#include "fluid/state_file.hpp"

#include "bridge/base/check.hpp"
#include "bridge/base/hdf5_file.hpp"

#include <array>
#include <cmath>
#include <string>
#include <type_traits>

namespace sluice::fluid {

namespace {

constexpr const char *format_name = "sluice-fluid-state";
constexpr int format_version = 2;

// A handle of the library, closed at the end of its scope.
class Handle {
public:
  Handle(hid_t id, herr_t (*close)(hid_t)) : id_(id), close_(close) {}
  Handle(const Handle &) = delete;
  Handle &operator=(const Handle &) = delete;
  ~Handle() {
    if (id_ >= 0)
      close_(id_);
  }
  operator hid_t() const { return id_; }
  bool is_valid() const { return id_ >= 0; }

private:
  hid_t id_;
  herr_t (*close_)(hid_t);
};

template <class T> hid_t type_of() {
  if constexpr (std::is_same_v<T, double>)
    return H5T_NATIVE_DOUBLE;
  else if constexpr (std::is_same_v<T, std::int64_t>)
    return H5T_NATIVE_INT64;
  else if constexpr (std::is_same_v<T, std::int32_t>)
    return H5T_NATIVE_INT32;
  else
    return H5T_NATIVE_UINT8;
}

// The parts of a point's value as the file holds them.
template <class T> struct Layout {
  using Number = std::conditional_t<std::is_enum_v<T>, std::uint8_t, T>;
  static constexpr int components = 1;
};
template <int dim> struct Layout<Vec<dim>> {
  using Number = double;
  static constexpr int components = dim;
};

// body(name, number) for every number of a state: the one list that writing and reading share.
template <class Saved, class Body> void for_each_number(Saved &saved, Body &&body) {
  auto &state = saved.state;
  body("spacing_m", saved.spacing);
  body("time_s", saved.time);
  body("step", state.step);
  body("step_size_s", state.step_size);
  body("wall_returns", state.wall_returns);
  body("outflow_points", state.outflow_points);
  body("lost_points", state.lost_points);
  body("outlet_energy_j", state.outlet_energy);
  constexpr std::array names{"outlet_momentum_x_n_s", "outlet_momentum_y_n_s",
                             "outlet_momentum_z_n_s"};
  for (int d = 0; d < state.outlet_momentum.size(); ++d)
    body(names[d], state.outlet_momentum[d]);
}

class Writer {
public:
  explicit Writer(const std::filesystem::path &file)
      : name_(file.string()),
        file_(H5Fcreate(name_.c_str(), H5F_ACC_TRUNC, H5P_DEFAULT, H5P_DEFAULT), H5Fclose) {
    expect(file_.is_valid());
  }

  template <int dim> void write(const SavedState<dim> &saved) {
    write_text("format", format_name);
    write_number("version", std::int32_t{format_version});
    for_each_number(saved, [&](const char *name, const auto &x) { write_number(name, x); });
    const Handle group(H5Gcreate2(file_, "points", H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT),
                       H5Gclose);
    expect(group.is_valid());
    for_each_array(saved.state.points,
                   [&](const char *name, const auto &x) { write_array(group, name, x); });
    if (!saved.bridge.empty())
      write_array(file_, "bridge", saved.bridge);
    expect(H5Fflush(file_, H5F_SCOPE_LOCAL) >= 0);
  }

private:
  void expect(bool success) const {
    check(success, "{}: cannot be written; is the folder writable and the disk not full?", name_);
  }

  void write_text(const char *name, const std::string &text) {
    const Handle type(H5Tcopy(H5T_C_S1), H5Tclose);
    expect(H5Tset_size(type, text.size()) >= 0);
    write_attribute(name, type, text.data());
  }
  template <class T> void write_number(const char *name, const T &x) {
    write_attribute(name, type_of<T>(), &x);
  }
  void write_attribute(const char *name, hid_t type, const void *value) {
    const Handle space(H5Screate(H5S_SCALAR), H5Sclose);
    const Handle attribute(H5Acreate2(file_, name, type, space, H5P_DEFAULT, H5P_DEFAULT),
                           H5Aclose);
    expect(attribute.is_valid() && H5Awrite(attribute, type, value) >= 0);
  }

  template <class T> void write_array(hid_t group, const char *name, const std::vector<T> &values) {
    const std::array<hsize_t, 2> size{values.size(), Layout<T>::components};
    const Handle space(H5Screate_simple(Layout<T>::components > 1 ? 2 : 1, size.data(), nullptr),
                       H5Sclose);
    const hid_t type = type_of<typename Layout<T>::Number>();
    const Handle data(H5Dcreate2(group, name, type, space, H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT),
                      H5Dclose);
    expect(data.is_valid() &&
           H5Dwrite(data, type, H5S_ALL, H5S_ALL, H5P_DEFAULT, values.data()) >= 0);
  }

  std::string name_;
  Handle file_;
};

class Reader {
public:
  explicit Reader(const std::filesystem::path &file)
      : name_(file.string()), file_(H5Fopen(name_.c_str(), H5F_ACC_RDONLY, H5P_DEFAULT), H5Fclose) {
    check(file_.is_valid(), "{}: not a readable HDF5 file", name_);
  }

  template <int dim> SavedState<dim> read() {
    check(read_text("format") == format_name, "{}: not a state that sluice-fluid wrote", name_);
    std::int32_t version = 0;
    read_number("version", version);
    check(version == format_version,
          "{}: written in version {} of the format, this program reads "
          "version {}",
          name_, version, format_version);
    SavedState<dim> saved;
    for_each_number(saved, [&](const char *name, auto &x) { read_number(name, x); });
    const Handle group(H5Gopen2(file_, "points", H5P_DEFAULT), H5Gclose);
    check(group.is_valid(), "{}: holds no points", name_);
    for_each_array(saved.state.points,
                   [&](const char *name, auto &x) { read_array(group, name, x); });
    check_values(saved.state.points);
    if (H5Lexists(file_, "bridge", H5P_DEFAULT) > 0)
      read_bytes("bridge", saved.bridge);
    return saved;
  }

private:
  // The text of an attribute, "" where there is none.
  std::string read_text(const char *name) const {
    if (H5Aexists(file_, name) <= 0)
      return "";
    const Handle attribute(H5Aopen(file_, name, H5P_DEFAULT), H5Aclose);
    const Handle type(H5Aget_type(attribute), H5Tclose);
    if (H5Tget_class(type) != H5T_STRING || H5Tis_variable_str(type) > 0)
      return "";
    std::string text(H5Tget_size(type), '\0');
    return H5Aread(attribute, type, text.data()) >= 0 ? text : "";
  }

  template <class T> void read_number(const char *name, T &x) {
    const Handle attribute(H5Aopen(file_, name, H5P_DEFAULT), H5Aclose);
    check(attribute.is_valid() && H5Aread(attribute, type_of<T>(), &x) >= 0,
          "{}: the attribute '{}' is missing or damaged", name_, name);
  }

  template <int dim> void check_values(const Points<dim> &points) const {
    for (int i = 0; i < points.size(); ++i) {
      check(points.position[i].allFinite() && points.velocity[i].allFinite() &&
                points.previous_velocity[i].allFinite() && std::isfinite(points.pressure[i]) &&
                points.shift[i].allFinite() && points.shift_velocity[i].allFinite() &&
                points.pressure_gradient[i].allFinite() &&
                std::isfinite(points.surface_pressure[i]) && std::isfinite(points.strain_rate[i]),
            "{}: point {} has a value that is not finite", name_, i);
      constexpr std::int32_t largest_id = 1 << 30;
      check(points.id[i] >= 0 && points.id[i] < largest_id, "{}: point {} has the number {}", name_,
            i, points.id[i]);
      check(points.at_surface[i] <= SurfaceMemory::released,
            "{}: point {} has the surface mark {}, which does not exist", name_, i,
            static_cast<int>(points.at_surface[i]));
    }
  }

  void read_bytes(const char *name, std::vector<std::byte> &bytes) {
    const Handle data(H5Dopen2(file_, name, H5P_DEFAULT), H5Dclose);
    const Handle space(H5Dget_space(data), H5Sclose);
    const hssize_t size = space.is_valid() ? H5Sget_simple_extent_npoints(space) : -1;
    check(size >= 0, "{}: '{}' is damaged", name_, name);
    bytes.resize(static_cast<std::size_t>(size));
    check(H5Dread(data, H5T_NATIVE_UINT8, H5S_ALL, H5S_ALL, H5P_DEFAULT, bytes.data()) >= 0,
          "{}: '{}' is damaged", name_, name);
  }

  template <class T> void read_array(hid_t group, const char *name, std::vector<T> &values) {
    const Handle data(H5Dopen2(group, name, H5P_DEFAULT), H5Dclose);
    check(data.is_valid(), "{}: the array 'points/{}' is missing", name_, name);
    const Handle space(H5Dget_space(data), H5Sclose);
    std::array<hsize_t, 2> size{0, 1};
    const int rank = H5Sget_simple_extent_ndims(space);
    const int expected = Layout<T>::components > 1 ? 2 : 1;
    if (rank == expected)
      H5Sget_simple_extent_dims(space, size.data(), nullptr);
    check(rank == expected && size[1] == Layout<T>::components,
          "{}: the array 'points/{}' does not hold {} numbers per point", name_, name,
          static_cast<int>(Layout<T>::components));
    if (n_points_ == unknown)
      n_points_ = size[0];
    check(size[0] == n_points_, "{}: the array 'points/{}' has {} entries, the first one has {}",
          name_, name, size[0], n_points_);
    values.resize(size[0]);
    check(H5Dread(data, type_of<typename Layout<T>::Number>(), H5S_ALL, H5S_ALL, H5P_DEFAULT,
                  values.data()) >= 0,
          "{}: the array 'points/{}' is damaged", name_, name);
  }

  static constexpr hsize_t unknown = ~hsize_t{0};
  std::string name_;
  Handle file_;
  hsize_t n_points_ = unknown;
};

} // namespace

template <int dim>
void write_state(const std::filesystem::path &file, const SavedState<dim> &saved) {
  const hdf5::Quiet quiet;
  std::filesystem::path unfinished = file;
  unfinished += ".part";
  std::error_code error;
  try {
    Writer(unfinished).write(saved);
  } catch (const UserError &) {
    std::filesystem::remove(unfinished, error);
    throw;
  }
  std::filesystem::rename(unfinished, file, error);
  check(!error, "{}: cannot be replaced: {}", file.string(), error.message());
}

template <int dim> SavedState<dim> read_state(const std::filesystem::path &file) {
  const hdf5::Quiet quiet;
  check(std::filesystem::exists(file), "{}: there is no such file", file.string());
  return Reader(file).read<dim>();
}

template void write_state(const std::filesystem::path &, const SavedState<2> &);
template SavedState<2> read_state(const std::filesystem::path &);
template void write_state(const std::filesystem::path &, const SavedState<3> &);
template SavedState<3> read_state(const std::filesystem::path &);

} // namespace sluice::fluid
