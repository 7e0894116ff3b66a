# SPDX-License-Identifier: MIT
"""The two dam breaks: geometry, what the experiments measured, and what is measured on a run."""

import dataclasses
import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from compare import Curve
from run_folder import RunError, read_columns

REFERENCE = Path(__file__).resolve().parent / "reference"
GRAVITY = 9.81


@dataclass(frozen=True)
class Tank:
    """Lengths [m]; times [s]."""

    width: float          # of the column
    height: float         # of the column
    length: float         # of the tank
    end_time: float
    output_interval: float


TANKS = {
    "koshizuka-oka": Tank(0.146, 0.292, 0.584, 0.27, 0.02),
    "lobovsky": Tank(0.6, 0.3, 1.61, 0.9, 0.004),
}
# The instant of release is uncertain, the speed of the front is not: judged is the time between two places.
CROSSED = (1.5, 3.5)             # widths
CROSSING_UNCERTAINTY = 0.08      # 5 ms of digitising at either end, 14.6 cm wide
ARRIVED = 0.2                    # rho g H
ARRIVAL_BAND = 0.05              # sqrt(H / g): 5 ms of digitising and 4 ms between the run's outputs
PLATEAU = (3.6, 5.0)             # sqrt(H / g): between the peak and the water that falls back
PLATEAU_BAND = 0.1               # the measured pressure at 30 mm varies by a tenth there
SENSORS = {"p1": "lobovsky2014_P1_z3mm", "p3": "lobovsky2014_P3_z30mm",
           "p4": "lobovsky2014_P4_z80mm"}
SENSOR_HEIGHT_M = {"p1": 0.003, "p3": 0.030, "p4": 0.080}


@dataclass(frozen=True)
class Dam:
    """Table [parameters]."""

    experiment: str = "koshizuka-oka"
    points_high: int = 80

    def __post_init__(self):
        if self.experiment not in TANKS:
            raise ValueError(f"parameters.experiment = '{self.experiment}' is not one of "
                             + ", ".join(TANKS))
        if self.points_high < 4:
            raise ValueError(f"parameters.points_high = {self.points_high} is below 4")

    @property
    def tank(self):
        return TANKS[self.experiment]

    @property
    def spacing(self):
        return self.tank.height / self.points_high

    def with_spacing(self, spacing):
        return dataclasses.replace(self, points_high=round(self.tank.height / spacing))

    def keys(self):
        t = self.tank
        lid = 3 * t.height
        probes = {f"fluid.probe.{name}": {"from_m": [t.length, y], "to_m": [t.length, y]}
                  for name, y in SENSOR_HEIGHT_M.items()}
        return {
            "case": {"end_time_s": t.end_time, "output_interval_s": t.output_interval},
            "fluid": {"spacing_m": self.spacing,
                      "water_m": [[0, 0], [t.width, 0], [t.width, t.height], [0, t.height]]},
            "fluid.wall": {"points_m": [[0, lid], [0, 0], [t.length, 0], [t.length, lid]]},
            "fluid.gauge": {"y_m": self.spacing / 2}} | probes


def of_run(run):
    return Dam(**run.case()["parameters"])


def front(run, dam):
    """x / width against t sqrt(2 g / width), until the front is at the far wall."""
    series = run.series("fluid.csv")
    tank, x = dam.tank, series["front_floor_m"]
    free = np.cumsum(x > tank.length - dam.spacing) == 0
    return Curve(series["time_s"][free] * math.sqrt(2 * GRAVITY / tank.width),
                 x[free] / tank.width)


def measured_fronts():
    """{experiment: Curve} of columns twice as high as wide."""
    data = read_columns(REFERENCE / "dambreak_front.csv")
    names = {"martin_moyce1952_a1.125in_n2=2_exp": "Martin and Moyce 1952, 2.9 cm",
             "martin_moyce1952_a2.25in_n2=2_exp": "Martin and Moyce 1952, 5.7 cm",
             "koshizuka_oka1996_exp": "Koshizuka and Oka 1996, 14.6 cm"}
    return {shown: Curve(data["T"][data["source"] == name], data["Z"][data["source"] == name])
            for name, shown in names.items()}


def measured_pressure(sensor):
    """p / (rho g H) against t sqrt(g / H)."""
    data = read_columns(REFERENCE / "dambreak_pressure.csv")
    rows = data["sensor"] == SENSORS[sensor]
    return Curve(data["T"][rows], data["P"][rows])


def pressure(run, dam, sensor):
    """p / (rho g H) against t sqrt(g / H) at the sensor, where enough water is in sight of it."""
    series, height = run.series(f"probe_{sensor}.csv"), dam.tank.height
    scale = run.case()["fluid"]["density_kg_m3"] * GRAVITY * height
    wet = np.isfinite(series["pressure_pa"])
    if not wet.any():
        raise RunError(f"{run.path / f'probe_{sensor}.csv'}: no water reached the sensor")
    return Curve(series["time_s"][wet] * math.sqrt(GRAVITY / height),
                 series["pressure_pa"][wet] / scale)


def time_of_impact(run, dam):
    """When the front comes within a spacing of the far wall [s]; the end where it does not."""
    series = run.series("fluid.csv")
    there = series["front_floor_m"] > dam.tank.length - dam.spacing
    return float(series["time_s"][np.argmax(there)] if there.any() else series["time_s"][-1])


def energy_growth(run, until):
    """Largest rise of kinetic and potential energy before `until`, over the potential energy of the
    column above the floor, which is the energy at the start."""
    series = run.series("fluid.csv")
    total = (series["kinetic_j"] + series["potential_j"])[series["time_s"] <= until]
    return float(total.max() / total[0] - 1)


def energy_split(run, until):
    """{part: change of the energy up to `until`, over that at the start}; the parts sum to the whole."""
    series = run.series("fluid.csv")
    now = np.flatnonzero(series["time_s"] <= until)[-1]
    total = series["kinetic_j"] + series["potential_j"]
    parts = {part: float(series[f"by_{part}_j"][now] / total[0])
             for part in ("correction", "projection", "damping")}
    whole = float(total[now] / total[0] - 1)
    return {"motion": whole - sum(parts.values()), **parts, "whole": whole}


def time_at(curve, value):
    """When a growing curve first reaches `value`, by linear interpolation."""
    k = int(np.argmax(curve.value >= value))
    if curve.value[k] < value or k == 0:
        raise RunError(f"the front does not reach {value:g} widths: it ends at "
                       f"{curve.value[-1]:.3g}")
    before, after = curve.value[k - 1], curve.value[k]
    return float(curve.time[k - 1]
                 + (value - before) / (after - before) * (curve.time[k] - curve.time[k - 1]))


def crossing(curve):
    """Time between the two places of CROSSED."""
    return time_at(curve, CROSSED[1]) - time_at(curve, CROSSED[0])


def arrival(curve):
    """First time at which the pressure is above ARRIVED; infinite when it never is."""
    there = curve.value > ARRIVED
    return float(curve.time[np.argmax(there)]) if there.any() else math.inf


def mean_between(curve, start, end):
    times = np.linspace(start, end, 200)
    return float(np.mean(curve.at(times)))


def crossing_band():
    """Fastest and slowest experiment from one to the other place of CROSSED, and its uncertainty."""
    measured = [crossing(curve) for curve in measured_fronts().values()]
    return min(measured) - CROSSING_UNCERTAINTY, max(measured) + CROSSING_UNCERTAINTY


def simulated_front():
    """Of Koshizuka and Oka's own particle method."""
    data = read_columns(REFERENCE / "dambreak_front.csv")
    rows = data["source"] == "koshizuka_oka1996_mps_sim"
    return Curve(data["T"][rows], data["Z"][rows])
