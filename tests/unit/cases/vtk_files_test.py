# SPDX-License-Identifier: MIT
import tempfile
import unittest
from pathlib import Path

import paths  # noqa: F401
import numpy as np
import synthetic_gate_run as made_up
from vtk_files import read_cloud, read_outline
from vtkmodules.vtkCommonDataModel import VTK_HEXAHEDRON, vtkUnstructuredGrid
from vtkmodules.vtkCommonCore import vtkPoints
from vtkmodules.vtkIOXML import vtkXMLPolyDataWriter, vtkXMLUnstructuredGridWriter


def length_of(edges):
    return sum(np.linalg.norm(b - a) for a, b in edges)


def column_of_hexahedra(cells, width, height, depth):
    """Cells on top of each other, every one with its own nodes."""
    grid, points = vtkUnstructuredGrid(), vtkPoints()
    for k in range(cells):
        low, high = height * k / cells, height * (k + 1) / cells
        for z in (0, depth):
            for x, y in ((0, low), (width, low), (width, high), (0, high)):
                points.InsertNextPoint(x, y, z)
    grid.SetPoints(points)
    for k in range(cells):
        grid.InsertNextCell(VTK_HEXAHEDRON, 8, list(range(8 * k, 8 * k + 8)))
    return grid


class OutlineTest(unittest.TestCase):
    def setUp(self):
        temporary = tempfile.TemporaryDirectory()
        self.addCleanup(temporary.cleanup)
        self.file = Path(temporary.name) / "data"

    def write(self, writer, data):
        writer.SetFileName(str(self.file))
        writer.SetInputData(data)
        writer.Write()

    def test_nodes_repeated_by_every_cell_leave_no_inner_edge(self):
        self.write(vtkXMLUnstructuredGridWriter(), made_up.gate_data(0.0, 0.04, along=7))
        outline = read_outline(self.file)
        self.assertEqual(len(outline.polygons), 7)
        self.assertEqual(len(outline.edges), 2 * 7 + 2)
        self.assertAlmostEqual(length_of(outline.edges), 2 * (0.005 + 0.079))

    def test_hexahedra_show_their_lowest_plane_only(self):
        self.write(vtkXMLUnstructuredGridWriter(), column_of_hexahedra(3, 0.005, 0.079, 0.01))
        outline = read_outline(self.file)
        self.assertEqual(len(outline.polygons), 3)
        self.assertAlmostEqual(length_of(outline.edges), 2 * (0.005 + 0.079))

    def test_cloud_keeps_positions_and_fields(self):
        position, pressure = made_up.fluid_points(0.0, 0.01, 0.04)
        self.write(vtkXMLPolyDataWriter(), made_up.cloud_data(0.0, 0.01, 0.04))
        cloud = read_cloud(self.file)
        np.testing.assert_allclose(cloud.position, position)
        np.testing.assert_allclose(cloud.fields["pressure"], pressure)


if __name__ == "__main__":
    unittest.main()
