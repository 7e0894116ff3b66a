// SPDX-License-Identifier: MIT
#include "fluid/surface_file.hpp"

#include "bridge/base/check.hpp"

#include <vtkCellArray.h>
#include <vtkNew.h>
#include <vtkOBJReader.h>
#include <vtkPLYReader.h>
#include <vtkPoints.h>
#include <vtkPolyData.h>
#include <vtkSTLReader.h>
#include <vtkSmartPointer.h>
#include <vtkXMLPolyDataReader.h>

namespace sluice::fluid {

namespace {

template <class Reader> vtkSmartPointer<vtkPolyData> read_by(const std::filesystem::path &file) {
  vtkNew<Reader> reader;
  reader->SetFileName(file.c_str());
  reader->Update();
  return reader->GetOutput();
}

vtkSmartPointer<vtkPolyData> read_poly_data(const std::filesystem::path &file) {
  check(std::filesystem::exists(file), "{}: there is no such file", file.string());
  const std::string kind = file.extension().string();
  if (kind == ".stl" || kind == ".STL")
    return read_by<vtkSTLReader>(file);
  if (kind == ".obj")
    return read_by<vtkOBJReader>(file);
  if (kind == ".ply")
    return read_by<vtkPLYReader>(file);
  check(kind == ".vtp", "{}: a surface must be a .stl, .obj, .ply or .vtp file", file.string());
  return read_by<vtkXMLPolyDataReader>(file);
}

} // namespace

SurfaceMesh read_surface_file(const std::filesystem::path &file) {
  const vtkSmartPointer<vtkPolyData> data = read_poly_data(file);
  SurfaceMesh mesh;
  for (vtkIdType i = 0; i < data->GetNumberOfPoints(); ++i)
    mesh.position.emplace_back(data->GetPoint(i));
  vtkCellArray *faces = data->GetPolys();
  for (vtkIdType f = 0; f < faces->GetNumberOfCells(); ++f) {
    vtkIdType n = 0;
    const vtkIdType *corner = nullptr;
    faces->GetCellAtId(f, n, corner);
    check(n == 3 || n == 4, "{}: face {} has {} corners, three or four are handled", file.string(),
          f, n);
    for (int k = 2; k < n; ++k) {
      mesh.triangles.push_back({static_cast<int>(corner[0]), static_cast<int>(corner[k - 1]),
                                static_cast<int>(corner[k])});
      mesh.face.push_back(static_cast<int>(f));
    }
  }
  check(!mesh.triangles.empty(), "{}: holds no faces, or is damaged", file.string());
  return mesh;
}

} // namespace sluice::fluid
