# SPDX-License-Identifier: MIT
"""A film of power-law fluid that spreads on a floor: the similarity law, and the front of a run.

    x(t) = eta (rho g / k)^(1 / (2n+3)) q^((n+2) / (2n+3)) t^(n / (2n+3)),
    h(x, t) = h0 (1 - (x / x(t))^(n+1))^(1 / (n+2))

with q the area of the film on one side of its middle; see reference/.
"""

import dataclasses
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from compare import Curve
from run_folder import RunError, read_columns
from vtk_files import read_cloud

REFERENCE = Path(__file__).resolve().parent / "reference/powerlaw_gravity_current_2d.csv"
GRAVITY, DENSITY, AREA = 9.81, 1000.0, 1.0
FIRST_TIME = 5.0       # [s] of the similarity law at the start: long against inertia and viscous decay
CORNERS = 120
COURANT = 0.2          # of the front at the start, where it is fastest
SETTLED = 1.1          # the exponent is taken once the front is so far, in units of its start


@dataclass(frozen=True)
class Current:
    """Table [parameters]: the film starts as the similarity law has it when its front is at
    `front_start_m` and spreads by the factor `spread`."""

    exponent: float = 1.0
    front_start_m: float = 3.0
    spread: float = 1.6
    spacing_m: float = 0.025

    def __post_init__(self):
        if self.exponent not in known_exponents():
            raise ValueError(f"parameters.exponent = {self.exponent:g} is not one of "
                             + ", ".join(f"{n:g}" for n in known_exponents()))
        if not 1.2 <= self.spread <= 4:
            raise ValueError(f"parameters.spread = {self.spread:g} is not in 1.2 ... 4")

    def with_spacing(self, spacing):
        return dataclasses.replace(self, spacing_m=spacing)

    @property
    def time_exponent(self):
        return self.exponent / (2 * self.exponent + 3)

    @property
    def consistency(self):
        """k [Pa s^n] for which the front is at its start at FIRST_TIME."""
        n = self.exponent
        reach = self.front_start_m / (factor(n) * AREA**((n + 2) / (2 * n + 3)))
        return DENSITY * GRAVITY * FIRST_TIME**n / reach**(2 * n + 3)

    @property
    def end_time(self):
        """Of the run, which starts at FIRST_TIME of the law [s]."""
        return FIRST_TIME * (self.spread**(1 / self.time_exponent) - 1)

    def front(self, time):
        """Of the law [m], `time` after the start of the run [s]."""
        return self.front_start_m * (1 + np.asarray(time) / FIRST_TIME)**self.time_exponent

    def profile(self, front):
        """Corners of the film's surface from its front to its middle [m]."""
        n = self.exponent
        s = np.sin(0.5 * np.pi * np.linspace(1, 0, CORNERS))   # dense at the steep front
        shape = (1 - s**(n + 1))**(1 / (n + 2))
        area = -np.trapezoid(shape, s) if hasattr(np, "trapezoid") else -np.trapz(shape, s)
        return np.column_stack([front * s, AREA / (front * area) * shape])

    def keys(self):
        surface = self.profile(self.front_start_m)
        speed = self.time_exponent * self.front_start_m / FIRST_TIME
        length = self.front_start_m * self.spread + 1
        return {"case": {"end_time_s": self.end_time, "output_interval_s": self.end_time / 100,
                         "time_step_s": COURANT * self.spacing_m / speed},
                "fluid": {"spacing_m": self.spacing_m, "water_m": [[0, 0], *surface.tolist()]},
                "fluid.rheology": {"consistency_pa_s_n": self.consistency,
                                   "exponent": self.exponent},
                "fluid.wall.floor": {"points_m": [[0, 0], [length, 0]]}}


def known_exponents():
    return read_columns(REFERENCE)["n"].tolist()


def factor(exponent):
    """eta of the law."""
    data = read_columns(REFERENCE)
    return float(data["eta_N"][data["n"] == exponent][0])


def of_run(run):
    return Current(**run.case()["parameters"])


def farthest_connected(x, spacing):
    """Largest x before the first gap of more than two spacings, half a spacing added: single points
    ahead of the film are not its front."""
    x = np.sort(x)
    gaps = np.flatnonzero(np.diff(x) > 2 * spacing)
    return float(x[gaps[0]] if len(gaps) else x[-1]) + 0.5 * spacing


def front(run, current):
    places = [(time, farthest_connected(read_cloud(file).position[:, 0], current.spacing_m))
              for time, file in run.collection("fluid")]
    return Curve(*np.array(places).T)


def fitted_exponent(current, curve):
    """Slope of log(front) over log(time of the law) once the front has settled."""
    later = curve.value > SETTLED * current.front_start_m
    if np.count_nonzero(later) < 2:
        raise RunError(f"the front has not come to {SETTLED:g} times its start twice: the run is too short for its "
                       "exponent, let it go on longer (case.end_time_s)")
    return float(np.polyfit(np.log(FIRST_TIME + curve.time[later]), np.log(curve.value[later]), 1)[0])
