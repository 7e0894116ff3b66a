# SPDX-License-Identifier: MIT
"""The spinning square: the exact pressure at its start, and what must stay while it deforms."""

import math
from dataclasses import dataclass

import numpy as np

from run_folder import RunError
from vtk_files import read_cloud

SERIES = 60     # odd terms in each direction; the rest is below 1e-6 of the pressure


@dataclass(frozen=True)
class Motion:
    """Momenta of the points at one instant, each of the same mass."""

    time: float
    linear: np.ndarray   # over mass times the first mean speed
    angular: float       # about the centre of mass, over the first one
    kinetic: float       # over the first one


def start_pressure(x, y):
    """Over density, (rate of rotation)^2 and side^2 one: p = 0 on the square of side one about the
    origin and lap p = 2 inside; as in reference/."""
    odd = np.arange(1, 2 * SERIES, 2)
    m, n = odd[:, None, None], odd[None, :, None]
    x, y = np.asarray(x, float) + 0.5, np.asarray(y, float) + 0.5
    terms = 32 / (m * n * math.pi**4 * (m**2 + n**2)) \
        * np.sin(m * math.pi * x) * np.sin(n * math.pi * y)
    return -terms.sum(axis=(0, 1))


def angular_momentum(position, velocity):
    x, u = position - position.mean(axis=0), velocity - velocity.mean(axis=0)
    return float(np.sum(x[:, 0] * u[:, 1] - x[:, 1] * u[:, 0]))


def motions(run):
    """[Motion] of every output."""
    found, first = [], None
    for time, file in run.collection("fluid"):
        cloud = read_cloud(file)
        u = cloud.fields["velocity"][:, :2]
        now = (u.sum(axis=0), angular_momentum(cloud.position, u), float((u**2).sum()))
        first = first or (np.hypot(*u.T).sum(), now[1], now[2])
        found.append(Motion(time, now[0] / first[0], now[1] / first[1], now[2] / first[2]))
    if len(found) < 2 or found[-1].time == 0:
        raise RunError(f"{run.path}: nothing was written after the start; the run ended before its "
                       "first output at case.output_interval_s: let it go on longer")
    return found


def pressure_error(run):
    """(time, rms, largest error) of the pressure at the points of the first output, over the largest
    exact pressure. The patch has turned by its time as a rigid one; what it has deformed by then is
    of the order of the time squared."""
    time, file = run.collection("fluid")[1]   # the first one is before any pressure
    cloud = read_cloud(file)
    c, s = math.cos(time), math.sin(time)     # back: the patch turns clockwise
    x, y = (cloud.position @ np.array([[c, s], [-s, c]])).T
    error = cloud.fields["pressure"].ravel() - start_pressure(x, y)
    largest = -float(start_pressure(0, 0))
    return time, float(np.sqrt(np.mean(error**2))) / largest, float(np.abs(error).max()) / largest
