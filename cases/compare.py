# SPDX-License-Identifier: MIT
"""Curve against curve: peaks, values at given instants, rms of the difference, tables of text."""

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Curve:
    """A sampled function of time [s], sorted by time."""

    time: np.ndarray
    value: np.ndarray

    def __post_init__(self):
        if len(self.time) == 0:
            raise ValueError("a curve needs at least one sample")
        order = np.argsort(self.time, kind="stable")
        object.__setattr__(self, "time", np.asarray(self.time, float)[order])
        object.__setattr__(self, "value", np.asarray(self.value, float)[order])

    @property
    def end(self):
        return self.time[-1]

    def peak(self):
        """Largest sample and its time: (value, time)."""
        k = int(np.argmax(self.value))
        return self.value[k], self.time[k]

    def minimum_after(self, time):
        """Smallest sample after `time`, or None when there is none."""
        later = self.value[self.time > time]
        return later.min() if len(later) else None

    def covers(self, times, slack=1e-9):
        """Which of `times` lie inside the curve."""
        times = np.asarray(times, float)
        return (times >= self.time[0] - slack) & (times <= self.end + slack)

    def at(self, times):
        """Values at `times` by linear interpolation; use `covers` first."""
        return np.interp(times, self.time, self.value)


def rms_difference(curve, reference):
    """rms of curve minus reference over the reference's instants that the curve covers.

    Returns (rms, number of instants); (None, 0) when there is none.
    """
    covered = curve.covers(reference.time)
    if not covered.any():
        return None, 0
    difference = curve.at(reference.time[covered]) - reference.value[covered]
    return float(np.sqrt(np.mean(difference**2))), int(covered.sum())


def text_table(header, rows):
    """A plain table: first column to the left, the others to the right; None shows as a dash."""
    cells = [[str(c) for c in header]]
    cells += [["-" if c is None else str(c) for c in row] for row in rows]
    widths = [max(len(row[k]) for row in cells) for k in range(len(header))]
    lines = ["  ".join(c.ljust(w) if k == 0 else c.rjust(w)
                       for k, (c, w) in enumerate(zip(row, widths))).rstrip() for row in cells]
    return "\n".join([lines[0], "  ".join("-" * w for w in widths)] + lines[1:])


def markdown_table(header, rows):
    """The same as a Markdown table."""
    lines = ["| " + " | ".join(header) + " |",
             "|" + "|".join(["---"] + ["---:"] * (len(header) - 1)) + "|"]
    for row in rows:
        lines.append("| " + " | ".join("-" if c is None else str(c) for c in row) + " |")
    return "\n".join(lines)
