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

vtkNew<vtkPoints> to_vtk_points(const std::vector<Vec<2>> &positions) {
  vtkNew<vtkPoints> points;
  points->SetDataTypeToDouble();
  points->SetNumberOfPoints(static_cast<vtkIdType>(positions.size()));
  for (std::size_t i = 0; i < positions.size(); ++i)
    points->SetPoint(static_cast<vtkIdType>(i), positions[i].x(), positions[i].y(), 0);
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

void add_vectors(vtkDataSetAttributes *data, const char *name,
                 const std::vector<Vec<2>> &vectors) {
  vtkNew<vtkFloatArray> array;
  array->SetName(name);
  array->SetNumberOfComponents(3);
  array->SetNumberOfTuples(static_cast<vtkIdType>(vectors.size()));
  for (std::size_t i = 0; i < vectors.size(); ++i)
    array->SetTuple3(static_cast<vtkIdType>(i), vectors[i].x(), vectors[i].y(), 0);
  data->AddArray(array);
}

vtkNew<vtkCellArray> one_vertex_per_point(std::size_t n) {
  vtkNew<vtkCellArray> cells;
  for (std::size_t i = 0; i < n; ++i) {
    const vtkIdType id = static_cast<vtkIdType>(i);
    cells->InsertNextCell(1, &id);
  }
  return cells;
}

} // namespace

void PointOutput::write(const FluidSolver &solver, double time) {
  const Points &points = solver.state.points;
  const Cloud &cloud = solver.cloud();
  vtkNew<vtkPolyData> data;
  const std::size_t n = points.position.size();
  const bool is_frozen = cloud.kind.size() == n; // not before the first step
  data->SetPoints(to_vtk_points(points.position));
  data->SetVerts(one_vertex_per_point(n));
  add_array<vtkFloatArray>(data->GetPointData(), "pressure", n,
                           [&](std::size_t i) { return points.pressure[i]; });
  add_array<vtkUnsignedCharArray>(data->GetPointData(), "kind", n,
                                  [&](std::size_t i) { return is_frozen ? static_cast<int>(cloud.kind[i]) : 0; });
  add_array<vtkIntArray>(data->GetPointData(), "id", n,
                         [&](std::size_t i) { return points.id[i]; });
  add_array<vtkFloatArray>(data->GetPointData(), "volume", n,
                           [&](std::size_t i) { return is_frozen ? cloud.cell_area[i] : 0.0; });
  add_vectors(data->GetPointData(), "velocity", points.velocity);
  if (const auto viscosity = solver.viscosity();
      viscosity.size() == n && !solver.params().rheology.is_newtonian())
    add_array<vtkFloatArray>(data->GetPointData(), "viscosity", n,
                             [&](std::size_t i) { return viscosity[i]; });
  const auto file = next_file(solver.state.step);
  write_file(file, data);
  written(file, time);
}

void WallOutput::write(const Walls &walls, std::int64_t step, double time) {
  vtkNew<vtkPolyData> data;
  data->SetPoints(to_vtk_points(walls.position));
  vtkNew<vtkCellArray> lines;
  for (const WallSegment &s : walls.segments) {
    const vtkIdType ends[2] = {s.a, s.b};
    lines->InsertNextCell(2, ends);
  }
  data->SetLines(lines);
  add_vectors(data->GetPointData(), "velocity", walls.velocity);
  add_array<vtkIntArray>(data->GetCellData(), "wall", walls.segments.size(),
                         [&](std::size_t k) { return walls.segments[k].wall; });
  const auto file = next_file(step);
  write_file(file, data);
  written(file, time);
}

} // namespace sluice::fluid
