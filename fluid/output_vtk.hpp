// SPDX-License-Identifier: MIT
// Fields for ParaView: points and walls as .vtp files with a .pvd index each.
#pragma once

#include "fluid/step.hpp"

#include <filesystem>
#include <string>
#include <vector>

namespace sluice::fluid {

/// Writes numbered .vtp files of one kind and keeps their .pvd index complete after each.
class VtkSeries {
public:
  VtkSeries(std::filesystem::path folder, std::string name)
      : folder_(std::move(folder)), name_(std::move(name)) {}

protected:
  /// Path of the next file; its time is entered in the index by `written`.
  std::filesystem::path next_file(std::int64_t step) const;
  void written(const std::filesystem::path &file, double time);

private:
  std::filesystem::path folder_;
  std::string name_;
  std::vector<std::pair<double, std::string>> entries_;
};

/// fluid_*.vtp: points with those of pressure [Pa], its gradient [Pa/m], velocity [m/s], kind (0
/// interior, 1 surface, 2 thin), id, volume [m^dim], viscosity [Pa s] and shear rate [1/s] that the
/// case asks for; the last two where the viscosity varies.
class PointOutput : VtkSeries {
public:
  explicit PointOutput(const std::filesystem::path &folder) : VtkSeries(folder, "fluid") {}
  template <int dim> void write(const FluidSolver<dim> &solver, double time);
};

/// wall_*.vtp: segments or triangles with velocity [m/s] and the number of their wall.
class WallOutput : VtkSeries {
public:
  explicit WallOutput(const std::filesystem::path &folder) : VtkSeries(folder, "wall") {}
  template <int dim> void write(const Walls<dim> &walls, std::int64_t step, double time);
};

} // namespace sluice::fluid
