# SPDX-License-Identifier: MIT
"""The free drop: the exact ellipse that it becomes, and what must stay whatever it does."""

import dataclasses
import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from run_folder import read_columns
from vtk_files import read_cloud

REFERENCE = Path(__file__).resolve().parent / "reference/elliptical_drop_stretch.csv"
CORNERS = 240                 # of the polygon that is filled; its area is 1e-4 below the circle's
FIRST_RATE = 100.0            # [1/s] of the reference, whose drop has a radius of 1 m as well


@dataclass(frozen=True)
class Flow:
    """How a drop starts, and for how long it runs; rates are one."""

    velocity: tuple
    viscosity: float
    holds_tension: bool
    end_time: float


FLOWS = {
    "stretching": Flow(("-x", "y"), 0.0, False, 0.76),
    # so viscous that the pull on its surface, which is unstable, hardly shows within a turn
    "spinning": Flow(("-y", "x"), 1e4, True, 2 * math.pi),
}


@dataclass(frozen=True)
class Drop:
    """Table [parameters]; radius one, density 1000."""

    motion: str = "stretching"
    points_across: int = 120

    def __post_init__(self):
        if self.motion not in FLOWS:
            raise ValueError(f"parameters.motion = '{self.motion}' is not one of "
                             + ", ".join(FLOWS))
        if self.points_across < 8:
            raise ValueError(f"parameters.points_across = {self.points_across} is below 8")

    @property
    def flow(self):
        return FLOWS[self.motion]

    @property
    def spacing(self):
        return 2 / self.points_across

    def with_spacing(self, spacing):
        return dataclasses.replace(self, points_across=round(2 / spacing))

    def keys(self):
        angles = 2 * math.pi * (np.arange(CORNERS) + 0.5) / CORNERS
        return {"case": {"end_time_s": self.flow.end_time, "output_interval_s": self.flow.end_time / 40,
                         "time_step_s": 0.2 * self.spacing},
                "fluid": {"spacing_m": self.spacing, "dynamic_viscosity_pa_s": self.flow.viscosity,
                          "holds_tension": self.flow.holds_tension,
                          "start_velocity_m_s": list(self.flow.velocity),
                          "water_m": [[math.cos(a), math.sin(a)] for a in angles]}}


def of_run(run):
    return Drop(**run.case()["parameters"])


@dataclass(frozen=True)
class State:
    """Of the points at one instant: semi-axes of the ellipse of their second moments [m], rate of
    stretching along y [1/s], momenta."""

    time: float
    a: float
    b: float
    rate: float
    linear: np.ndarray    # mean velocity [m/s]
    angular: float        # mean of x v - y u about the centre of mass [m2/s]
    kinetic: float        # mean of u^2 / 2 [m2/s2]
    swing: float          # mean of |x| |u| about the centre: the scale of the angular momentum


def measure(time, position, velocity):
    x, u = position - position.mean(axis=0), velocity - velocity.mean(axis=0)
    return State(time, 2 * float(np.sqrt(np.mean(x[:, 0]**2))),
                 2 * float(np.sqrt(np.mean(x[:, 1]**2))),
                 float(np.mean(x[:, 1] * u[:, 1]) / np.mean(x[:, 1]**2)), velocity.mean(axis=0),
                 float(np.mean(x[:, 0] * u[:, 1] - x[:, 1] * u[:, 0])),
                 0.5 * float(np.mean((velocity**2).sum(axis=1))),
                 float(np.mean(np.hypot(*x.T) * np.hypot(*u.T))))


def states(run):
    found = []
    for time, file in run.collection("fluid"):
        cloud = read_cloud(file)
        found.append(measure(time, cloud.position, cloud.fields["velocity"][:, :2]))
    return found


def exact_ellipse(times):
    """(a, b, rate) of the stretching drop at `times`, which are in units of 1 / first rate."""
    data = read_columns(REFERENCE)
    scaled = FIRST_RATE * data["t_s"]
    return tuple(np.interp(times, scaled, data[name]) / scale
                 for name, scale in (("a", 1), ("b", 1), ("A", FIRST_RATE)))


def momentum_drifts(found):
    """(linear, angular): largest change over the run, over the mean speed and the mean |x| |u| at
    the start."""
    first = found[0]
    speed = math.sqrt(2 * first.kinetic)
    return (max(float(np.hypot(*(s.linear - first.linear))) for s in found) / speed,
            max(abs(s.angular - first.angular) for s in found) / first.swing)
