# SPDX-License-Identifier: MIT
"""The cavity: its geometry from three numbers, its references, and what is measured on a run."""

import csv
import dataclasses
import math
import re
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from run_folder import RunError

REFERENCE = Path(__file__).resolve().parent / "reference"
CENTRE_BAND = 0.005
STEADY_BAND = 1e-4           # change of the profiles per unit of time
JUDGED_FROM = 12.0           # before, the flow is still setting in
SIDE_LENGTH = 1.0


@dataclass(frozen=True)
class Cavity:
    """Table [parameters]; side length, lid speed and density are one."""

    angle_deg: float = 60.0
    reynolds: float = 500.0
    exponent: float = 1.5
    points_per_side: int = 100
    courant: float = 0.2
    lid_ramp: float = 2.0

    def __post_init__(self):
        if not 10 <= self.angle_deg <= 170:
            raise ValueError(f"parameters.angle_deg = {self.angle_deg:g} is not in 10 ... 170")
        if min(self.reynolds, self.exponent, self.points_per_side, self.courant) <= 0:
            raise ValueError("reynolds, exponent, points_per_side and courant are above zero")
        if not 0 < self.lid_ramp < self.points_per_side / 2:
            raise ValueError(f"parameters.lid_ramp = {self.lid_ramp:g} is not between 0 and half of "
                             "points_per_side")

    def with_spacing(self, spacing):
        return dataclasses.replace(self, points_per_side=round(math.sqrt(self.sine) / spacing))

    def keys(self):
        """What follows for the case file."""
        c = self.corners
        return {
            "case": {"time_step_s": self.courant / self.points_per_side},
            "fluid": {"spacing_m": self.spacing, "water_m": c},
            "fluid.rheology": {"consistency_pa_s_n": 1 / self.reynolds, "exponent": self.exponent,
                               "highest_shear_rate_1_s": self.highest_shear_rate},
            "fluid.wall.sides": {"points_m": [c[3], c[0], c[1], c[2]]},
            "fluid.wall.lid": {"points_m": [c[2], self.place(1 - self.ramp, 1),
                                            self.place(self.ramp, 1), c[3]]},
            "fluid.probe.ab": {"from_m": self.place(0.5, 0), "to_m": self.place(0.5, 1)},
            "fluid.probe.cd": {"from_m": self.place(0, 0.5), "to_m": self.place(1, 0.5)}}

    @property
    def sine(self):
        return math.sin(math.radians(self.angle_deg))

    @property
    def spacing(self):
        return math.sqrt(self.sine) / self.points_per_side

    @property
    def highest_shear_rate(self):
        """What points resolve: the lid's speed over two spacings along it [1/s].

        Where the lid meets the sides the velocity jumps and the stress of a thickening fluid has no
        bound; there alone the law is cut off.
        """
        return self.points_per_side / 2

    @property
    def ramp(self):
        """Length at either end of the lid over which its speed rises from zero, of the side.

        With a jump the fluid of a corner would have to turn within a spacing, with a pressure and
        a stress without bound.
        """
        return self.lid_ramp / self.points_per_side

    @property
    def corners(self):
        """Counter-clockwise from the lower left one."""
        x, y = math.cos(math.radians(self.angle_deg)), self.sine
        return [(0.0, 0.0), (1.0, 0.0), (1.0 + x, y), (x, y)]

    def place(self, xi, eta):
        """Point at the fractions xi along the floor and eta along the side."""
        x, y = self.corners[3]
        return (xi + eta * x, eta * y)

    @property
    def name(self):
        return f"a{self.angle_deg:g}_Re{self.reynolds:g}_n{self.exponent:g}"

    def profile_band(self):
        """Largest error of a profile: 0.5 % of the lid speed at 100 points, 0.15 % at 200."""
        if self.points_per_side >= 200:
            return 0.0015
        return 0.005 * max(1.0, (100 / self.points_per_side) ** 2)


@dataclass(frozen=True)
class Profiles:
    """Velocity on the two mid-lines, by the fraction s of their length."""

    s: np.ndarray
    ab: np.ndarray  # (n, 2): from the floor's middle to the lid's
    cd: np.ndarray  # (n, 2): from the left side's middle to the right's


@dataclass(frozen=True)
class Reference:
    profiles: Profiles
    vortices: list  # (x, y), strongest first


def read_reference(cavity):
    """The computed reference of this cavity, or None where there is none."""
    files = sorted(REFERENCE.glob(f"cavity_{cavity.name}_N*.csv"))
    if not files:
        return None
    lines = files[0].read_text().splitlines()
    rows = list(csv.DictReader(line for line in lines if not line.startswith("#")))
    column = {name: np.array([float(row[name]) for row in rows]) for name in rows[0]}
    profiles = Profiles(column["s"], np.column_stack([column["u_AB"], column["v_AB"]]),
                        np.column_stack([column["u_CD"], column["v_CD"]]))
    header = next(line for line in lines if "vortices" in line)
    vortices = [tuple(float(x) for x in group.split(",")) for group in
                re.findall(r"\(([-\d.,e]+)\)", header.split("omega):")[1])]
    strongest = sorted(vortices, key=lambda v: -abs(v[0]))
    return Reference(profiles, [(v[1], v[2]) for v in strongest if abs(v[0]) > 1e-3])


def read_profiles(run):
    """{time: Profiles} of a run."""
    lines = {name: run.series(f"probe_{name}.csv") for name in ("ab", "cd")}
    if len(lines["ab"]["time_s"]) == 0:
        raise RunError(f"{run.path}: no profile was written; the run ended before its first output "
                       "at case.output_interval_s")
    result = {}
    for time in np.unique(lines["ab"]["time_s"]):
        velocity = {}
        for name, line in lines.items():
            now = line["time_s"] == time
            velocity[name] = np.column_stack([line["u_m_s"][now], line["v_m_s"][now]])
        n = len(velocity["ab"])
        result[float(time)] = Profiles(np.linspace(0, 1, n), velocity["ab"], velocity["cd"])
    return result


def largest_difference(profiles, reference):
    """Largest |difference| of either velocity component: (on A-B, on C-D), over the lid speed."""
    def on(line, other):
        return max(np.abs(np.interp(reference.s, profiles.s, line[:, k]) - other[:, k]).max()
                   for k in range(2))
    return on(profiles.ab, reference.ab), on(profiles.cd, reference.cd)


def rate_of_change(history):
    """Largest change of a profile per unit of time between the last two outputs; None without two."""
    times = sorted(history)
    if len(times) < 2:
        return None
    last, before = history[times[-1]], history[times[-2]]
    change = max(np.abs(last.ab - before.ab).max(), np.abs(last.cd - before.cd).max())
    return change / (times[-1] - times[-2])


def local_velocity(position, velocity, place, radius):
    """Value and gradient at `place` by a quadratic fit over the points within `radius`."""
    offset = (position - place) / radius
    near = (offset**2).sum(axis=1) < 1
    q = offset[near]
    basis = np.column_stack([np.ones(len(q)), q, q[:, 0]**2, q[:, 0] * q[:, 1], q[:, 1]**2])
    weight = (1 - np.sqrt((q**2).sum(axis=1)))[:, None]
    solution, *_ = np.linalg.lstsq(basis * weight, velocity[near] * weight, rcond=None)
    return solution[0], solution[1:3].T / radius


def vortex_centre(position, velocity, guess, radius, steps=20):
    """The stagnation point near `guess` by Newton's method on local fits; None without one."""
    place = np.array(guess, float)
    for _ in range(steps):
        value, gradient = local_velocity(position, velocity, place, radius)
        move = np.linalg.solve(gradient, -value)
        length = np.hypot(*move)
        place = place + move * min(1, radius / max(length, 1e-300))
        if length < 1e-6:
            return place if np.linalg.det(gradient) > 0 else None
    return None
