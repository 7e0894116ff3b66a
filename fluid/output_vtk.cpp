// SPDX-License-Identifier: MIT
#include "fluid/output_vtk.hpp"

#include "bridge/base/check.hpp"

#include <fstream>
#include <vtkCellArray.h>
#include <vtkCellData.h>
#include <vtkDoubleArray.h>
#include <vtkFloatArray.h>
#include <vtkIntArray.h>
#include <vtkNew.h>
#include <vtkPointData.h>
#include <vtkPoints.h>
#include <vtkPolyData.h>
#include <vtkUnsignedCharArray.h>
#include <vtkXMLPolyDataWriter.h>

namespace sluice::fluid {

std::filesystem::path VtkSeries::next_file(std::int64_t step) const {
  return folder_ / fmt::format("{}_{:06d}.vtp", name_, step);
}

void VtkSeries::written(const std::filesystem::path &file, double time) {
  entries_.emplace_back(time, file.filename().string());
  std::ofstream out(folder_ / (name_ + ".pvd"));
  out << "<?xml version=\"1.0\"?>\n<VTKFile type=\"Collection\" version=\"0.1\">\n<Collection>\n";
  for (const auto &[t, name] : entries_)
    out << fmt::format("<DataSet timestep=\"{:.9g}\" file=\"{}\"/>\n", t, name);
  out << "</Collection>\n</VTKFile>\n";
  check(out.good(), "{}: cannot be written; is the disk full?", (folder_ / name_).string());
}

namespace {

void write_file(const std::filesystem::path &file, vtkPolyData *data) {
  vtkNew<vtkXMLPolyDataWriter> writer;
  writer->SetFileName(file.c_str());
  writer->SetInputData(data);
  writer->SetDataModeToAppended();
  writer->EncodeAppendedDataOff();
  check(writer->Write() == 1, "{}: cannot be written; is the disk full?", file.string());
}

Vec<3> in_space(const Vec<2> &x) { return {x.x(), x.y(), 0}; }
const Vec<3> &in_space(const Vec<3> &x) { return x; }

template <int dim> vtkNew<vtkPoints> to_vtk_points(const std::vector<Vec<dim>> &positions) {
  vtkNew<vtkPoints> points;
  points->SetDataTypeToDouble();
  points->SetNumberOfPoints(static_cast<vtkIdType>(positions.size()));
  for (std::size_t i = 0; i < positions.size(); ++i)
    points->SetPoint(static_cast<vtkIdType>(i), in_space(positions[i]).data());
  return points;
}

template <class Array, class Value>
void add_array(vtkDataSetAttributes *data, const char *name, std::size_t n, Value &&value) {
  vtkNew<Array> array;
  array->SetName(name);
  array->SetNumberOfTuples(static_cast<vtkIdType>(n));
  for (std::size_t i = 0; i < n; ++i)
    array->SetTuple1(static_cast<vtkIdType>(i), static_cast<double>(value(i)));
  data->AddArray(array);
}

template <int dim>
void add_vectors(vtkDataSetAttributes *data, const char *name,
                 const std::vector<Vec<dim>> &vectors) {
  vtkNew<vtkFloatArray> array;
  array->SetName(name);
  array->SetNumberOfComponents(3);
  array->SetNumberOfTuples(static_cast<vtkIdType>(vectors.size()));
  for (std::size_t i = 0; i < vectors.size(); ++i)
    array->SetTuple(static_cast<vtkIdType>(i), in_space(vectors[i]).data());
  data->AddArray(array);
}

/// Adds the fields of the points that the case asks for.
template <int dim> class ChosenFields {
public:
  ChosenFields(const FluidParams<dim> &params, vtkPointData *data, std::size_t n)
      : params_(params), data_(data), n_(n) {}
  template <class Array, class Value> void add(const char *name, Value &&value) const {
    if (params_.writes(name))
      add_array<Array>(data_, name, n_, value);
  }
  void add_vectors(const char *name, const std::vector<Vec<dim>> &vectors) const {
    if (params_.writes(name))
      fluid::add_vectors(data_, name, vectors);
  }

private:
  const FluidParams<dim> &params_;
  vtkPointData *data_;
  std::size_t n_;
};

vtkNew<vtkCellArray> one_vertex_per_point(std::size_t n) {
  vtkNew<vtkCellArray> cells;
  for (std::size_t i = 0; i < n; ++i) {
    const vtkIdType id = static_cast<vtkIdType>(i);
    cells->InsertNextCell(1, &id);
  }
  return cells;
}

} // namespace

template <int dim> void PointOutput::write(const FluidSolver<dim> &solver, double time) {
  const Points<dim> &points = solver.state.points;
  const Cloud<dim> &cloud = solver.cloud();
  vtkNew<vtkPolyData> data;
  const std::size_t n = points.position.size();
  const bool is_frozen = cloud.kind.size() == n; // not before the first step
  data->SetPoints(to_vtk_points(points.position));
  data->SetVerts(one_vertex_per_point(n));
  const ChosenFields<dim> fields(solver.params(), data->GetPointData(), n);
  fields.template add<vtkFloatArray>("pressure", [&](std::size_t i) { return points.pressure[i]; });
  fields.add_vectors("pressure_gradient", points.pressure_gradient);
  fields.add_vectors("velocity", points.velocity);
  fields.template add<vtkUnsignedCharArray>(
      "kind", [&](std::size_t i) { return is_frozen ? static_cast<int>(cloud.kind[i]) : 0; });
  fields.template add<vtkIntArray>("id", [&](std::size_t i) { return points.id[i]; });
  fields.template add<vtkFloatArray>(
      "volume", [&](std::size_t i) { return is_frozen ? cloud.cell_volume[i] : 0.0; });
  const ViscousProblem<dim> &viscous = solver.viscous();
  if (viscous.viscosity.size() == n && !solver.params().rheology.is_newtonian()) {
    fields.template add<vtkFloatArray>("viscosity",
                                       [&](std::size_t i) { return viscous.viscosity[i]; });
    fields.template add<vtkFloatArray>(
        "shear_rate", [&](std::size_t i) { return shear_rate(viscous.velocity_gradient[i]); });
  }
  const auto file = next_file(solver.state.step);
  write_file(file, data);
  written(file, time);
}

template <int dim> void WallOutput::write(const Walls<dim> &walls, std::int64_t step, double time) {
  vtkNew<vtkPolyData> data;
  data->SetPoints(to_vtk_points(walls.position));
  vtkNew<vtkCellArray> cells;
  for (const WallFace<dim> &face : walls.faces) {
    std::array<vtkIdType, dim> corners;
    std::copy(face.vertex.begin(), face.vertex.end(), corners.begin());
    cells->InsertNextCell(dim, corners.data());
  }
  if constexpr (dim == 2)
    data->SetLines(cells);
  else
    data->SetPolys(cells);
  add_vectors(data->GetPointData(), "velocity", walls.velocity);
  add_array<vtkIntArray>(data->GetCellData(), "wall", walls.faces.size(),
                         [&](std::size_t k) { return walls.faces[k].wall; });
  const auto file = next_file(step);
  write_file(file, data);
  written(file, time);
}

template void PointOutput::write(const FluidSolver<2> &, double);
template void WallOutput::write(const Walls<2> &, std::int64_t, double);
template void PointOutput::write(const FluidSolver<3> &, double);
template void WallOutput::write(const Walls<3> &, std::int64_t, double);

} // namespace sluice::fluid
