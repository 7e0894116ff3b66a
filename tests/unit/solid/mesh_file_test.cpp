// SPDX-License-Identifier: MIT
// The same strip of two quadrilaterals in every format, and the gate from a file.
#include "gate.hpp"

#include "solid-dealii/interface.hpp"

#include <gtest/gtest.h>

#include <fstream>

namespace sluice::solid {
namespace {

namespace fs = std::filesystem;

fs::path write(const std::string &name, const std::string &text) {
  const fs::path file = fs::path(testing::TempDir()) / name;
  std::ofstream(file) << text;
  return file;
}

// Corners (0,0) (1,0) (2,0) / (0,1) (1,1) (2,1); the second cell is written clockwise. Node 99 is
// of no cell. Boundaries: clamp, the left edge; top, the upper edge.
constexpr const char *gmsh_41 = R"($MeshFormat
4.1 0 8
$EndMeshFormat
$PhysicalNames
3
1 7 "clamp"
1 8 "the top"
2 9 "rubber"
$EndPhysicalNames
$Entities
0 2 1 0
1 0 0 0 0 1 0 1 7 2 1 2
2 0 1 0 2 1 0 1 8 2 1 2
1 0 0 0 2 1 0 1 9 2 1 2
$EndEntities
$Nodes
1 7 11 99
2 1 0 7
11
12
13
14
15
16
99
0 0 0
1 0 0
2 0 0
0 1 0
1 1 0
2 1 0
5 5 0
$EndNodes
$Elements
3 5 1 5
1 1 1 1
1 11 14
1 2 1 2
2 14 15
3 15 16
2 1 3 2
4 11 12 15 14
5 12 15 16 13
$EndElements
)";

constexpr const char *gmsh_22 = R"($MeshFormat
2.2 0 8
$EndMeshFormat
$PhysicalNames
2
1 7 "clamp"
1 8 "the top"
$EndPhysicalNames
$Nodes
6
11 0 0 0
12 1 0 0
13 2 0 0
14 0 1 0
15 1 1 0
16 2 1 0
$EndNodes
$Elements
5
1 1 2 7 1 11 14
2 1 2 8 2 14 15
3 1 2 8 2 15 16
4 3 2 9 1 11 12 15 14
5 3 2 9 1 12 15 16 13
$EndElements
)";

constexpr const char *abaqus = R"(** a strip
*NODE, NSET=all
11, 0, 0
12, 1., 0.
13, 2, 0
14, 0, 1
15, 1, 1
16, 2, 1
99, 5, 5
*ELEMENT, TYPE=CPE4, ELSET=rubber
4, 11, 12, 15, 14
5, 12, 15, 16, 13
*NSET, NSET=clamp
11, 14
*ELSET, ELSET=both, GENERATE
4, 5
*SURFACE, NAME=the top, TYPE=ELEMENT
4, S3
5, S2
)";

constexpr const char *vtk = R"(<?xml version="1.0"?>
<VTKFile type="UnstructuredGrid" version="0.1" byte_order="LittleEndian">
<UnstructuredGrid><Piece NumberOfPoints="6" NumberOfCells="2">
<PointData>
<DataArray type="Int32" Name="clamp" format="ascii">1 0 0 1 0 0</DataArray>
<DataArray type="Int32" Name="the top" format="ascii">0 0 0 1 1 1</DataArray>
</PointData>
<Points><DataArray type="Float64" NumberOfComponents="3" format="ascii">
0 0 0  1 0 0  2 0 0  0 1 0  1 1 0  2 1 0</DataArray></Points>
<Cells>
<DataArray type="Int32" Name="connectivity" format="ascii">0 1 4 3  1 4 5 2</DataArray>
<DataArray type="Int32" Name="offsets" format="ascii">4 8</DataArray>
<DataArray type="UInt8" Name="types" format="ascii">9 9</DataArray>
</Cells>
</Piece></UnstructuredGrid></VTKFile>
)";

double length_of(const Discretisation<2> &d, const std::string &name) {
  double length = 0;
  for (const int f : d.boundary(name))
    for (int q = 0; q < d.points_per_face; ++q)
      length += d.boundary_points[static_cast<std::size_t>(f * d.points_per_face + q)].weight;
  return length;
}

TEST(MeshFile, every_format_gives_the_same_cells_and_named_boundaries) {
  for (const auto &[name, text] : {std::pair{"strip41.msh", gmsh_41},
                                   {"strip22.msh", gmsh_22},
                                   {"strip.inp", abaqus},
                                   {"strip.vtu", vtk}}) {
    SCOPED_TRACE(name);
    const auto d = discretise<2>(read_mesh(write(name, text), 2), ElementKind::incompatible_modes);
    EXPECT_EQ(d.n_cells(), 2);
    EXPECT_EQ(d.n_nodes(), 6) << "a node without a cell is left out";
    double area = 0;
    for (const double w : d.weights)
      area += w;
    EXPECT_NEAR(area, 2, 1e-15);
    EXPECT_NEAR(length_of(d, "clamp"), 1, 1e-15);
    EXPECT_NEAR(length_of(d, "the top"), 2, 1e-15);
    for (const int node : d.nodes_of(d.boundary("clamp")))
      EXPECT_EQ(d.nodes[static_cast<std::size_t>(node)].x(), 0);
  }
}

std::string error_of(const std::function<void()> &action) {
  try {
    action();
  } catch (const UserError &error) {
    return error.what();
  }
  return "no error";
}

void expect_parts(const std::string &text, std::initializer_list<const char *> parts) {
  for (const auto *part : parts)
    EXPECT_NE(text.find(part), std::string::npos) << "'" << part << "' in: " << text;
}

TEST(MeshFile, an_unknown_boundary_is_answered_with_those_there_are) {
  const auto d = discretise<2>(read_mesh(write("names.inp", abaqus), 2), ElementKind::q1);
  expect_parts(error_of([&] { d.boundary("clmap"); }),
               {"'clmap'", "clamp (1 faces)", "the top (2 faces)"});
}

TEST(MeshFile, what_cannot_be_used_is_refused_where_it_stands) {
  expect_parts(error_of([] { read_mesh("/nowhere/gate.msh", 2); }), {"/nowhere/gate.msh"});
  expect_parts(error_of([] { read_mesh(write("mesh.stl", ""), 2); }), {".msh", ".inp", ".vtu"});
  expect_parts(error_of([] { read_mesh(write("plane.inp", abaqus), 3); }),
               {"plane.inp:10", "CPE4", "C3D8"});
  std::string triangle = gmsh_22;
  triangle.replace(triangle.find("5 3 2 9 1 12 15 16 13"), 21, "5 2 2 9 1 12 15 16   ");
  expect_parts(error_of([&] { read_mesh(write("triangle.msh", triangle), 2); }),
               {"triangle.msh:24", "type 2", "recombine"});
  std::string missing = abaqus;
  missing.replace(missing.find("5, 12, 15, 16, 13"), 17, "5, 12, 15, 16, 17");
  expect_parts(error_of([&] { read_mesh(write("missing.inp", missing), 2); }), {"node 17"});
  std::string doubled = abaqus;
  doubled.replace(doubled.find("13, 2, 0"), 8, "13, 2, 1");
  EXPECT_NE(error_of([&] {
              discretise<2>(read_mesh(write("doubled.inp", doubled), 2), ElementKind::q1);
            }),
            "no error");
}

// The gate as CalculiX would be given it: nodes and C3D8 or CPE4 with node sets.
std::string gate_as_abaqus(int along, int dim) {
  std::string nodes = "*NODE\n", cells, top = "*NSET, NSET=clamp\n", z0 = "*NSET, NSET=near\n",
              z1 = "*NSET, NSET=far\n", wet = "*NSET, NSET=wet\n";
  const int layers = dim == 2 ? 1 : 2;
  const auto number = [&](int i, int j, int k) { return 1 + i + 2 * j + 2 * (along + 1) * k; };
  for (int k = 0; k < layers; ++k)
    for (int j = 0; j <= along; ++j)
      for (int i = 0; i < 2; ++i) {
        nodes += fmt::format("{}, {:.17g}, {:.17g}, {:.17g}\n", number(i, j, k), 0.1 + 0.005 * i,
                             0.079 * j / along, 0.005 * k);
        if (j == along)
          top += fmt::format("{},\n", number(i, j, k));
        wet += fmt::format("{},\n", number(i, j, k));
        (k == 0 ? z0 : z1) += fmt::format("{},\n", number(i, j, k));
      }
  cells = fmt::format("*ELEMENT, TYPE={}, ELSET=gate\n", dim == 2 ? "CPE4" : "C3D8I");
  for (int j = 0; j < along; ++j) {
    cells += fmt::format("{}", j + 1);
    for (int k = 0; k < layers; ++k)
      for (const int c : {0, 1, 3, 2})
        cells += fmt::format(", {}", number(c % 2, j + c / 2, k));
    cells += "\n";
  }
  std::string left =
      fmt::format("*ELSET, ELSET=gate2, GENERATE\n1, {}\n"
                  "*SURFACE, TYPE=ELEMENT, NAME=front\ngate2, {}\n"
                  "*SURFACE, TYPE=ELEMENT, NAME=back\ngate2, {}\n"
                  "*SURFACE, TYPE=ELEMENT, NAME=tip\n1, {}\n",
                  along, dim == 2 ? "S4" : "S6", dim == 2 ? "S2" : "S4", dim == 2 ? "S1" : "S3");
  return nodes + cells + top + (dim == 3 ? z0 + z1 : "") + wet + left;
}

template <int dim> SolidParams gate_from_file() {
  auto params = gate_params();
  params.dimension = dim;
  params.mesh = write(fmt::format("gate{}.inp", dim), gate_as_abaqus(28, dim)).string();
  params.boundaries = {{"clamp", "clamped", {}},
                       {"front", "wetted", {}},
                       {"back", "wetted", {}},
                       {"tip", "wetted", {}}};
  if (dim == 3)
    params.boundaries.insert(params.boundaries.end(),
                             {{"near", "symmetry", {}}, {"far", "symmetry", {}}});
  return params;
}

template <int dim> void expect_same_gate() {
  auto box_params = gate_params();
  box_params.dimension = dim;
  SolidSolver<dim> box(box_params), file(gate_from_file<dim>());
  const auto water = [&](const SolidSolver<dim> &s, const std::vector<int> &faces) {
    return pressure_forces(s.discretisation(), faces, gate_water, s.initial_state().displacement);
  };
  const auto a = box.solve_static(water(box, box.discretisation().boundary("left")));
  const auto b = file.solve_static(water(file, file.discretisation().boundary("front")));
  Vec<dim> corner = Vec<dim>::Zero();
  corner.x() = 0.1;
  const auto u = [&](const SolidSolver<dim> &s, const SolidState &state) {
    return state.displacement[dim * s.discretisation().nearest_node(corner)];
  };
  EXPECT_NEAR(u(file, b) / u(box, a), 1, 1e-8) << "Newton's tolerance, 1e-9 of the force";
  const auto ours = wetted_interface(file.discretisation(), file.supports().wetted);
  const auto theirs = wetted_interface(box.discretisation(), box.supports().wetted);
  EXPECT_EQ(ours.nodes.size(), theirs.nodes.size());
  EXPECT_EQ(ours.mesh.n_faces(), theirs.mesh.n_faces());
  EXPECT_EQ(file.supports().held.size(), box.supports().held.size());
}

TEST(MeshFile, the_gate_from_a_file_is_the_gate_from_the_box) {
  expect_same_gate<2>();
  expect_same_gate<3>();
}

TEST(Supports, a_curved_symmetry_plane_and_a_body_without_support_are_refused) {
  auto params = gate_from_file<3>();
  params.boundaries[1].kind = "symmetry";
  params.boundaries[1].name = "wet"; // all outer faces: normals along every axis
  expect_parts(error_of([&] { SolidSolver<3> solver(params); }), {"'wet'", "normal"});
  auto dry = gate_from_file<2>();
  dry.boundaries.resize(1);
  const SolidSolver<2> solver(dry);
  expect_parts(
      error_of([&] { wetted_interface(solver.discretisation(), solver.supports().wetted); }),
      {"wetted"});
}

} // namespace
} // namespace sluice::solid
