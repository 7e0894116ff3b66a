# SPDX-License-Identifier: MIT
"""The gate in space: its tip against that of the plane gate."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from compare import Curve
from run_folder import read_columns

REFERENCE = Path(__file__).resolve().parent / "reference" / "plane_5mm.csv"
BAND = 0.02             # of the plane gate's largest displacement
SPACING_M = 0.005       # of the reference: another one is not judged


@dataclass(frozen=True)
class Gate:
    """Table [parameters]: half widths of channel and gate."""

    channel_half_width_m: float
    gate_half_width_m: float

    @property
    def fills_channel(self):
        return self.gate_half_width_m == self.channel_half_width_m


def tip(run):
    columns = run.series("tip.csv")
    return Curve(columns["time_s"], columns["ux_m"])


def plane_tip():
    columns = read_columns(REFERENCE)
    return Curve(columns["time_s"], columns["ux_m"])


def largest_difference(curve, reference, until):
    """Of two tips up to a time, over the reference's largest displacement."""
    times = reference.time[(reference.time <= until) & curve.covers(reference.time)]
    return float(np.abs(curve.at(times) - reference.at(times)).max() / reference.peak()[0])
