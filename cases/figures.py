# SPDX-License-Identifier: MIT
"""The look of every figure: one type size, one palette that colour-blind readers can tell apart."""

import matplotlib

matplotlib.use("Agg")

import matplotlib.pyplot as plt  # noqa: E402  (the backend is chosen first)

# Okabe and Ito's palette.
BLUE, ORANGE, GREEN, RED = "#0072B2", "#E69F00", "#009E73", "#D55E00"
PURPLE, SKY, BLACK, GREY = "#CC79A7", "#56B4E9", "#000000", "#7F7F7F"

STYLE = {
    "font.family": "DejaVu Sans",
    "font.size": 9,
    "axes.labelsize": 9,
    "axes.titlesize": 9,
    "axes.titlelocation": "left",
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.linewidth": 0.7,
    "axes.grid": True,
    "grid.color": "#E6E6E6",
    "grid.linewidth": 0.6,
    "axes.axisbelow": True,
    "xtick.labelsize": 8,
    "ytick.labelsize": 8,
    "xtick.direction": "out",
    "ytick.direction": "out",
    "xtick.major.width": 0.7,
    "ytick.major.width": 0.7,
    "legend.frameon": False,
    "legend.fontsize": 8,
    "lines.linewidth": 1.5,
    "savefig.dpi": 200,
    "figure.facecolor": "white",
}
plt.rcParams.update(STYLE)


def new_figure(width_in, height_in, rows=1, columns=1, **options):
    return plt.subplots(rows, columns, figsize=(width_in, height_in), **options)


def save(figure, path):
    figure.savefig(path, bbox_inches="tight", pad_inches=0.05)
    plt.close(figure)
    return path


def spread(values, least_distance):
    """Label positions as near to `values` as a least distance between neighbours allows."""
    order = sorted(range(len(values)), key=lambda k: values[k])
    groups = []  # [centre, members]: neighbours that touch move as one
    for k in order:
        groups.append([values[k], [k]])
        while len(groups) > 1 and touches(groups[-2], groups[-1], least_distance):
            last = groups.pop()
            members = groups[-1][1] + last[1]
            groups[-1] = [sum(values[m] for m in members) / len(members), members]
    placed = [0.0] * len(values)
    for centre, members in groups:
        for n, m in enumerate(members):
            placed[m] = centre + (n - (len(members) - 1) / 2) * least_distance
    return placed


def touches(below, above, least_distance):
    reach = (len(below[1]) + len(above[1])) / 2 * least_distance
    return above[0] - below[0] < reach


def label_ends(axes, curves, x_label, least_distance, **text_options):
    """Writes each curve's label to the right of the axes, joined to the curve's end by a hairline.

    `curves` is [(x_end, y_end, label, colour)] in data units.
    """
    places = spread([y for _, y, _, _ in curves], least_distance)
    for (x, y, label, colour), y_label in zip(curves, places):
        axes.annotate(label, xy=(x, y), xytext=(x_label, y_label), va="center", ha="left",
                      color=colour, annotation_clip=False,
                      arrowprops={"arrowstyle": "-", "linewidth": 0.5, "color": colour,
                                  "relpos": (0, 0.5), "shrinkA": 0, "shrinkB": 0}, **text_options)
