# SPDX-License-Identifier: MIT
"""Fields of a run for drawing: point clouds (.vtp) and the plane outline of a solid (.vtu)."""

from dataclasses import dataclass

import numpy as np
from vtkmodules.util.numpy_support import vtk_to_numpy
from vtkmodules.vtkFiltersGeometry import vtkGeometryFilter
from vtkmodules.vtkIOXML import vtkXMLPolyDataReader, vtkXMLUnstructuredGridReader


@dataclass(frozen=True)
class Cloud:
    position: np.ndarray  # (n, 2) or (n, 3) [m]
    fields: dict          # name -> (n, ...) array


@dataclass(frozen=True)
class Outline:
    polygons: list  # of (k, 2) arrays [m]: the faces in the plane
    edges: list     # of (2, 2) arrays [m]: sides that belong to one face only


def read_cloud(path, dimension=2):
    """Points of a run; `dimension` 3 keeps their z."""
    reader = vtkXMLPolyDataReader()
    reader.SetFileName(str(path))
    reader.Update()
    data = reader.GetOutput()
    if data.GetNumberOfPoints() == 0:
        return Cloud(np.empty((0, dimension)), {})
    arrays = data.GetPointData()
    fields = {arrays.GetArrayName(k): vtk_to_numpy(arrays.GetArray(k))
              for k in range(arrays.GetNumberOfArrays())}
    return Cloud(vtk_to_numpy(data.GetPoints().GetData())[:, :dimension], fields)


def read_outline(path):
    """The solid's faces in its lowest z plane; a plane mesh is all of it."""
    reader = vtkXMLUnstructuredGridReader()
    reader.SetFileName(str(path))
    surface = vtkGeometryFilter()
    surface.SetInputConnection(reader.GetOutputPort())
    surface.Update()
    return plane_outline(surface.GetOutput())


def plane_outline(surface):
    points = vtk_to_numpy(surface.GetPoints().GetData())
    depth = np.ptp(points[:, 2])
    in_plane = points[:, 2] <= points[:, 2].min() + 1e-6 * depth
    faces = [face for face in faces_of(surface) if in_plane[face].all()]
    return Outline([points[face, :2] for face in faces], single_edges(points, faces))


def faces_of(surface):
    flat = vtk_to_numpy(surface.GetPolys().GetData())
    faces, k = [], 0
    while k < len(flat):
        faces.append(flat[k + 1:k + 1 + flat[k]])
        k += 1 + flat[k]
    return faces


def single_edges(points, faces):
    # Writers may repeat a node for every cell: nodes at one place are one node.
    size = np.ptp(points[:, :2], axis=0).max()
    place = np.round(points[:, :2] / (1e-7 * size)).astype(np.int64)
    count, ends = {}, {}
    for face in faces:
        for a, b in zip(face, np.roll(face, -1)):
            key = tuple(sorted((tuple(place[a]), tuple(place[b]))))
            count[key] = count.get(key, 0) + 1
            ends[key] = points[[a, b], :2]
    return [ends[key] for key, n in count.items() if n == 1]
