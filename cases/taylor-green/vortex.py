# SPDX-License-Identifier: MIT
"""The decaying vortex: its exact solution, the errors of one run and the order of several."""

import math
from dataclasses import dataclass

import numpy as np

from vtk_files import read_cloud


@dataclass(frozen=True)
class Errors:
    """At the end of a run: rms of the velocity over the exact rms, and of the kinetic energy,
    relative."""

    velocity: float
    energy: float


def decay(case, time):
    """Of the velocity: exp(-2 nu pi^2 t)."""
    fluid = case["fluid"]
    nu = fluid["dynamic_viscosity_pa_s"] / fluid["density_kg_m3"]
    return math.exp(-2 * nu * math.pi**2 * time)


def exact_velocity(case, position, time):
    x, y = math.pi * position[:, 0], math.pi * position[:, 1]
    return decay(case, time) * np.column_stack([np.sin(x) * np.cos(y), -np.cos(x) * np.sin(y)])


def exact_energy(case, time):
    """Of the box, per metre of depth [J/m]."""
    return 0.25 * case["fluid"]["density_kg_m3"] * decay(case, time)**2


def errors(run, name):
    case = run.case()
    time, file = run.collection(f"{name}/fluid")[-1]
    cloud = read_cloud(file)
    exact = exact_velocity(case, cloud.position, time)
    difference = cloud.fields["velocity"][:, :2] - exact
    series = run.series(f"{name}/fluid.csv")
    energy = series["kinetic_j"][-1] / exact_energy(case, series["time_s"][-1])
    return Errors(float(np.sqrt((difference**2).sum() / (exact**2).sum())), float(abs(energy - 1)))


def name_of(points):
    return f"n{points}"


def order(points, values):
    """Slope of log(error) over log(spacing) by least squares."""
    return float(-np.polyfit(np.log(points), np.log(values), 1)[0])
