# SPDX-License-Identifier: MIT
"""Pictures of the points of a run: one, or a strip of instants over one colour scale."""

import numpy as np
from matplotlib.cm import ScalarMappable
from matplotlib.collections import EllipseCollection
from matplotlib.colors import Normalize

import figures
from vtk_files import read_cloud

WALL = "#4D4D4D"


def draw_points(ax, position, values, spacing, limits, colours="viridis", size=1.1):
    """Discs of the points' size coloured by `values`; `limits` is a range or a norm."""
    norm = limits if isinstance(limits, Normalize) else Normalize(*limits)
    drawn = ax.add_collection(EllipseCollection(
        [size * spacing], [size * spacing], [0], units="xy", offsets=position,
        transOffset=ax.transData, array=values, cmap=colours, norm=norm, linewidths=0, zorder=2))
    ax.set_aspect("equal")
    ax.autoscale_view()
    ax.grid(False)
    return drawn


def draw_walls(ax, case):
    """The walls that the case file gives as polylines."""
    for wall in case["fluid"].get("wall", []):
        points = np.array(wall.get("points_m", np.empty((0, 2))))
        ax.plot(points[:, 0], points[:, 1], color=WALL, linewidth=1.1, zorder=3,
                solid_joinstyle="miter")


def nearest_frames(run, times):
    """[(time, file)] of the outputs nearest to `times`, each once."""
    clouds = run.collection("fluid")
    return sorted({min(clouds, key=lambda entry: abs(entry[0] - t)) for t in times})


def draw_strip(run, name, frames, value, limits, label, view, columns=3, width_in=2.4,
               colours="viridis", title=lambda t: f"{t:.2f} s"):
    """A picture NAME of the `frames` of a run. `value(cloud)` is what is coloured; `view` is
    ((x, x), (y, y)) in metres."""
    case = run.case()
    rows = -(-len(frames) // columns)
    aspect = np.ptp(view[1]) / np.ptp(view[0])
    figure, axes = figures.new_figure(columns * width_in, rows * (width_in * aspect + 0.25) + 0.5,
                                      rows, columns, layout="constrained", squeeze=False)
    norm = limits if isinstance(limits, Normalize) else Normalize(*limits)
    for ax in axes.ravel():
        ax.set_axis_off()
    for ax, (time, file) in zip(axes.ravel(), frames):
        cloud = read_cloud(file)
        draw_walls(ax, case)
        draw_points(ax, cloud.position, value(cloud), case["fluid"]["spacing_m"], norm, colours)
        ax.set(xlim=view[0], ylim=view[1])
        ax.set_title(title(time), loc="left", pad=2)
    figure.colorbar(ScalarMappable(norm, colours), ax=axes, orientation="horizontal", label=label,
                    shrink=0.5, aspect=40, pad=0.03)
    return figures.save(figure, run.path / name)
