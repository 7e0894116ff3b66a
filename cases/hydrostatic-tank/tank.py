# SPDX-License-Identifier: MIT
"""The tank: its geometry from three numbers, and how far from rest a run is."""

import dataclasses
import math
from dataclasses import dataclass

import numpy as np

from vtk_files import read_cloud

GRAVITY, DEPTH, WIDTH, WALL_LENGTH = 9.81, 1.0, 0.5, 1.3
JITTER = {"regular": 0.0, "jittered": 0.2}   # of the start, in spacings
LAST_PART = 0.1                              # of the run, over which the state at its end is taken


@dataclass(frozen=True)
class Tank:
    """Table [parameters]."""

    start: str = "jittered"
    tilt_deg: float = 0.0
    points_deep: int = 56

    def __post_init__(self):
        if self.start not in JITTER:
            raise ValueError(f"parameters.start = '{self.start}' is not one of " + ", ".join(JITTER))
        if not 0 <= self.tilt_deg <= 20:
            raise ValueError(f"parameters.tilt_deg = {self.tilt_deg:g} is not in 0 ... 20")
        if self.points_deep < 4:
            raise ValueError(f"parameters.points_deep = {self.points_deep} is below 4")

    @property
    def spacing(self):
        return DEPTH / self.points_deep

    def with_spacing(self, spacing):
        return dataclasses.replace(self, points_deep=round(DEPTH / spacing))

    @property
    def time_unit(self):
        return math.sqrt(DEPTH / GRAVITY)

    def place(self, along, up):
        """From the tank's own axes; its left lower corner is the origin and the lowest place."""
        angle = math.radians(self.tilt_deg)
        c, s = math.cos(angle), math.sin(angle)
        return [along * c - up * s, along * s + up * c]

    def wet_length(self, along):
        """Of the wall that starts there on the floor, up to the surface."""
        angle = math.radians(self.tilt_deg)
        return (DEPTH - along * math.sin(angle)) / math.cos(angle)

    def keys(self):
        water = [self.place(0, 0), self.place(WIDTH, 0),
                 self.place(WIDTH, self.wet_length(WIDTH)), self.place(0, self.wet_length(0))]
        walls = [self.place(0, WALL_LENGTH), self.place(0, 0), self.place(WIDTH, 0),
                 self.place(WIDTH, WALL_LENGTH)]
        end = 100 * self.time_unit
        return {"case": {"end_time_s": end, "output_interval_s": end / 100},
                "fluid": {"spacing_m": self.spacing, "start_jitter": JITTER[self.start],
                          "water_m": water},
                "fluid.wall": {"points_m": walls},
                "fluid.gauge": {"x_m": 0.5 * (water[2][0] + water[3][0])}}


def of_run(run):
    return Tank(**run.case()["parameters"])


def is_late(time):
    return time >= (1 - LAST_PART) * np.max(time)


def speed(series):
    """Of the fastest point over sqrt(g depth): (over the run, in its last part)."""
    relative = series["max_speed_m_s"] / math.sqrt(GRAVITY * DEPTH)
    return float(relative.max()), float(relative[is_late(series["time_s"])].max())


def volume_error(series):
    """Of the area inside the envelope over that of the points, at the end."""
    late = is_late(series["time_s"])
    return float(np.mean(series["volume_m2"][late] / series["point_volume_m2"][late] - 1))


def pressure_errors(run):
    """(rms, largest) over the points of p - rho g depth below y = DEPTH, over rho g DEPTH; the
    worst of the outputs in the last part of the run."""
    clouds = run.collection("fluid")
    density = run.case()["fluid"]["density_kg_m3"]
    late = is_late(np.array([time for time, _ in clouds]))
    found = []
    for (_, file), is_judged in zip(clouds, late):
        if is_judged:
            cloud = read_cloud(file)
            scaled = cloud.fields["pressure"].ravel() / (density * GRAVITY * DEPTH)
            error = scaled - (DEPTH - cloud.position[:, 1]) / DEPTH
            found.append((float(np.sqrt(np.mean(error**2))), float(np.abs(error).max())))
    return tuple(np.max(found, axis=0))
