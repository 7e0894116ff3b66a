# SPDX-License-Identifier: MIT
"""The strip of pictures: water coloured by pressure, or another field, and the deformed gate, every 0.04 s."""

from dataclasses import dataclass

import numpy as np
from matplotlib.cm import ScalarMappable
from matplotlib.collections import EllipseCollection, LineCollection, PolyCollection
from matplotlib.colors import Normalize

from figures import new_figure, save
from vtk_files import read_cloud, read_outline

INTERVAL_S = 0.04
VIEW_MM = ((-4.0, 330.0), (-5.0, 158.0))
COLUMNS, PICTURE_IN = 3, 3.2
WALL = "#4D4D4D"
GATE_FACE, GATE_EDGE = "#D9D9D9", "#000000"


@dataclass(frozen=True)
class Colouring:
    """Which field of the points is shown, and how."""

    field: str
    label: str
    norm: Normalize
    colours: str = "viridis"


def frames(run):
    """[(time, cloud file, solid file or None)] at the strip's instants, as far as the run went."""
    clouds, solids = run.collection("fluid"), run.collection("solid")
    chosen = []
    for k in range(int(round(clouds[-1][0] / INTERVAL_S)) + 1):
        time, file = min(clouds, key=lambda entry: abs(entry[0] - k * INTERVAL_S))
        if abs(time - k * INTERVAL_S) < 0.25 * INTERVAL_S:
            chosen.append((time, file, solid_at(solids, time)))
    last, file = clouds[-1]
    if last - chosen[-1][0] > 0.5 * INTERVAL_S:  # a run that ended between two instants
        chosen.append((last, file, solid_at(solids, last)))
    return chosen


def solid_at(solids, time):
    """The gate nearest to the cloud's instant, None when it is not near; the first pictures of the
    two may be one window apart."""
    near = [(abs(t - time), file) for t, file in solids if abs(t - time) < 0.05 * INTERVAL_S]
    return min(near)[1] if near else None


def draw(run, name="strip.png", colouring=None):
    case = run.case()
    colouring = colouring or Colouring("pressure", "pressure [Pa]",
                                       Normalize(0, hydrostatic_pressure(case)))
    shown = frames(run)
    columns = min(COLUMNS, len(shown) + 1)   # one cell for the colour bar
    rows = -(-(len(shown) + 1) // columns)
    aspect = np.ptp(VIEW_MM[1]) / np.ptp(VIEW_MM[0])
    figure, axes = new_figure(columns * PICTURE_IN, rows * PICTURE_IN * aspect * 1.03,
                              rows, columns, gridspec_kw={"wspace": 0.04, "hspace": 0.03})
    axes = axes.ravel()
    for k, (ax, (time, cloud, solid)) in enumerate(zip(axes, shown)):
        draw_frame(ax, case, time, cloud, solid, colouring)
        label_axes(ax, left=k % columns == 0, below=k + columns >= len(shown))
    for ax in axes[len(shown):]:
        ax.set_axis_off()
    draw_colour_bar(figure, axes[len(shown)], colouring)
    return save(figure, run.path / name)


def hydrostatic_pressure(case):
    """Under the water at rest [Pa]: the colour scale of every picture."""
    fluid = case["fluid"]
    depth = np.ptp(np.array(fluid["water_m"])[:, 1])
    return fluid["density_kg_m3"] * np.linalg.norm(fluid["gravity_m_s2"]) * depth


def draw_frame(ax, case, time, cloud_file, solid_file, colouring):
    draw_walls(ax, case)
    cloud = read_cloud(cloud_file)
    size = 1e3 * case["fluid"]["spacing_m"]
    nothing_yet = np.full(len(cloud.position), colouring.norm.vmin)   # before the first step
    ax.add_collection(EllipseCollection(
        [size], [size], [0], units="xy", offsets=1e3 * cloud.position,
        transOffset=ax.transData, array=np.ravel(cloud.fields.get(colouring.field, nothing_yet)),
        cmap=colouring.colours, norm=colouring.norm, linewidths=0, zorder=2))
    if solid_file is not None:
        draw_gate(ax, read_outline(solid_file))
    ax.set(xlim=VIEW_MM[0], ylim=VIEW_MM[1], aspect="equal")
    ax.grid(False)
    ax.spines[["top", "right", "left", "bottom"]].set_visible(False)
    ax.text(0.97, 0.93, f"{time:.2f} s", transform=ax.transAxes, ha="right", va="top", zorder=6,
            bbox={"facecolor": "white", "edgecolor": "none", "alpha": 0.85, "pad": 1.5})


def draw_walls(ax, case):
    for wall in case["fluid"].get("wall", []):
        points = 1e3 * np.array(wall["points_m"])
        if wall.get("coupled"):
            continue
        is_closed_body = np.ptp(points[:, 0]) < 10  # the thin wall above the clamp
        if is_closed_body:
            ax.fill(points[:, 0], points[:, 1], color=WALL, linewidth=0, zorder=3)
        else:
            ax.plot(points[:, 0], points[:, 1], color=WALL, linewidth=1.1, zorder=3,
                    solid_joinstyle="miter")


def draw_gate(ax, outline):
    ax.add_collection(PolyCollection([1e3 * p for p in outline.polygons], facecolors=GATE_FACE,
                                     edgecolors=GATE_FACE, linewidths=0.2, zorder=4))
    ax.add_collection(LineCollection([1e3 * e for e in outline.edges], colors=GATE_EDGE,
                                     linewidths=0.7, capstyle="round", zorder=5))


def label_axes(ax, left, below):
    ax.set_xticks([0, 100, 200, 300])
    ax.set_yticks([0, 50, 100, 150])
    ax.tick_params(length=2.5, labelleft=left, labelbottom=below, left=left, bottom=below)
    if left:
        ax.set_ylabel("y [mm]")
    if below:
        ax.set_xlabel("x [mm]")


def draw_colour_bar(figure, ax, colouring):
    bar = ax.inset_axes([0.08, 0.5, 0.84, 0.09])
    figure.colorbar(ScalarMappable(colouring.norm, colouring.colours), cax=bar,
                    orientation="horizontal", extend="both", label=colouring.label)
