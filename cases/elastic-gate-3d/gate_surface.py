# SPDX-License-Identifier: MIT
"""The wetted surface of half a gate: triangles on four sides of a box, as a text STL file."""

import numpy as np

X, Y = (0.1, 0.105), (0.0, 0.079)


def pieces(length, longest):
    return max(1, int(np.ceil(length / longest - 1e-9)))


def side(origin, along, across, longest):
    """Triangles of a parallelogram; along x across points out of the gate."""
    origin, along, across = (np.asarray(v, float) for v in (origin, along, across))
    n, m = (pieces(np.linalg.norm(v), longest) for v in (along, across))
    corner = [[origin + i / n * along + j / m * across for j in range(m + 1)] for i in range(n + 1)]
    triangles = []
    for i in range(n):
        for j in range(m):
            a, b = corner[i][j], corner[i + 1][j]
            c, d = corner[i + 1][j + 1], corner[i][j + 1]
            triangles += [(a, b, c), (a, c, d)]
    return triangles


def triangles(half_width, longest):
    """The sides that water can touch: all but the clamped one and the plane of symmetry z = 0."""
    width, height = X[1] - X[0], Y[1] - Y[0]
    x, y, z = [width, 0, 0], [0, height, 0], [0, 0, half_width]
    return (side([X[0], Y[0], 0], z, y, longest) + side([X[1], Y[0], 0], y, z, longest)
            + side([X[0], Y[0], 0], x, z, longest) + side([X[0], Y[0], half_width], x, y, longest))


def write(path, half_width, longest):
    lines = ["solid gate"]
    for corners in triangles(half_width, longest):
        a, b, c = corners
        normal = np.cross(b - a, c - a)
        normal /= np.linalg.norm(normal)
        lines += ["facet normal {:.9g} {:.9g} {:.9g}".format(*normal), "outer loop"]
        lines += ["vertex {:.9g} {:.9g} {:.9g}".format(*corner) for corner in corners]
        lines += ["endloop", "endfacet"]
    path.write_text("\n".join(lines + ["endsolid gate"]) + "\n")
