# SPDX-License-Identifier: MIT
"""The benchmark's reference values, what is measured on a run, and the bands it is held to."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from compare import Curve
from run_folder import RunError, read_columns
from verdict import Check

REFERENCE = Path(__file__).resolve().parent / "reference"
STATIC_BANDS = {"csm1": 0.002, "csm2": 0.003}  # relative, both components
FREQUENCY_BAND, UY_AMPLITUDE_BAND, UX_BAND = 0.005, 0.005, 0.025
CSM3_LEVEL, CSM3_STEP_S = "4+0", 0.005
STATIC_LEVEL = "5+1"


@dataclass(frozen=True)
class Swing:
    """Mean and amplitude between the extrema of the last period, and its frequency."""

    ux_mean_m: float
    ux_amplitude_m: float
    uy_mean_m: float
    uy_amplitude_m: float
    frequency_hz: float


def static_reference(test):
    """(ux, uy) of A [m] on the finest level."""
    data = read_columns(REFERENCE / "turek_hron_csm_static.csv")
    row = (data["case"] == test.upper()) & (data["level"] == STATIC_LEVEL)
    return float(data["ux_A_mm"][row][0]) * 1e-3, float(data["uy_A_mm"][row][0]) * 1e-3


def swing_reference():
    data = read_columns(REFERENCE / "turek_hron_periodic.csv")
    rows = {q: (data["level"] == CSM3_LEVEL) & (data["dt_s"] == CSM3_STEP_S)
            & (data["quantity"] == q) for q in ("ux_mm", "uy_mm")}
    value = {(q, name): float(data[name][rows[q]][0]) for q in rows
             for name in ("mean", "amplitude", "freq_Hz")}
    return Swing(1e-3 * value["ux_mm", "mean"], 1e-3 * value["ux_mm", "amplitude"],
                 1e-3 * value["uy_mm", "mean"], 1e-3 * value["uy_mm", "amplitude"],
                 value["uy_mm", "freq_Hz"])


def reference_history():
    data = read_columns(REFERENCE / "turek_hron_csm3_history.csv")
    return Curve(data["time_s"], data["ux_A_m"]), Curve(data["time_s"], data["uy_A_m"])


def read_probe(run, test):
    """(ux, uy) of A against time."""
    data = run.series(f"{test}/probes.csv")
    if len(data["time_s"]) == 0:
        raise RunError(f"{run.path / test / 'probes.csv'}: has no row")
    return Curve(data["time_s"], data["A_ux_m"]), Curve(data["time_s"], data["A_uy_m"])


def vertex(time, value, k):
    """Extremum of the parabola through samples k-1, k, k+1: (time, value)."""
    before, here, after = value[k - 1:k + 2]
    curvature = before - 2 * here + after
    if curvature == 0:
        return time[k], here
    shift = 0.5 * (before - after) / curvature
    return time[k] + shift * (time[k + 1] - time[k]), here - 0.25 * (before - after) * shift


def extrema(curve, sign):
    """Local maxima (sign 1) or minima (-1) that lie beyond the mean: [(time, value)]."""
    value = sign * curve.value
    beyond = value > 0.5 * (value.max() + value.min())
    found = [k for k in range(1, len(value) - 1)
             if beyond[k] and value[k] >= value[k - 1] and value[k] > value[k + 1]]
    # one for every excursion beyond the mean: the largest
    groups = []
    for k in found:
        if groups and beyond[groups[-1][-1]:k + 1].all():
            groups[-1].append(k)
        else:
            groups.append([k])
    peaks = [max(group, key=lambda k: value[k]) for group in groups]
    return [vertex(curve.time, curve.value, k) for k in peaks]


def mean_crossings(curve):
    """Times at which the curve falls through the middle of its range, by linear interpolation."""
    value = curve.value - 0.5 * (curve.value.max() + curve.value.min())
    falls = np.flatnonzero((value[:-1] > 0) & (value[1:] <= 0))
    part = value[falls] / (value[falls] - value[falls + 1])
    return curve.time[falls] + part * (curve.time[falls + 1] - curve.time[falls])


def measure_swing(ux, uy):
    """Extrema of the last period, as the benchmark asks, and the frequency of uy over the whole run;
    None when the run has no whole period."""
    crossings = mean_crossings(uy)
    turns = [extrema(curve, sign) for curve in (ux, uy) for sign in (-1, 1)]
    if len(crossings) < 2 or not all(turns):
        return None
    last = [turn[-1][1] for turn in turns]
    frequency = (len(crossings) - 1) / (crossings[-1] - crossings[0])
    return Swing(0.5 * (last[1] + last[0]), 0.5 * (last[1] - last[0]),
                 0.5 * (last[3] + last[2]), 0.5 * (last[3] - last[2]), float(frequency))


def relative(value, reference):
    return value / reference - 1


def relative_check(what, value, reference, band):
    difference = relative(value, reference)
    return Check(what, f"{100 * difference:+.3f} %", f"+-{100 * band:g} %",
                 bool(abs(difference) <= band))


def swing_checks(found, wanted):
    return [
        relative_check("CSM3 frequency", found.frequency_hz, wanted.frequency_hz, FREQUENCY_BAND),
        relative_check("CSM3 uy amplitude", found.uy_amplitude_m, wanted.uy_amplitude_m,
                       UY_AMPLITUDE_BAND),
        relative_check("CSM3 ux amplitude", found.ux_amplitude_m, wanted.ux_amplitude_m, UX_BAND),
        relative_check("CSM3 ux mean", found.ux_mean_m, wanted.ux_mean_m, UX_BAND),
    ]


def rms_history(curve, reference):
    """rms of the difference over the reference's instants, relative to its largest value."""
    times = reference.time[curve.covers(reference.time)]
    difference = curve.at(times) - reference.at(times)
    return float(np.sqrt(np.mean(difference**2)) / np.abs(reference.value).max())
