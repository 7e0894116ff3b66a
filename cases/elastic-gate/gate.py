# SPDX-License-Identifier: MIT
"""The gate's reference curves, what is measured on a run, and the bands that a run is held to."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from compare import Curve, rms_difference
from run_folder import RunError, read_columns
from verdict import Check, count_of

REFERENCE = Path(__file__).resolve().parent / "reference"
DIGITISING_M = 1e-3          # uncertainty of a digitised point, beside the spread of the two
INSTANTS_S = np.arange(1, 10) * 0.04

PEAK_BAND_M = (0.033, 0.050)
MINIMUM_BAND_M = (0.020, 0.045)
PEAK_JUDGED_FROM_S = 0.2     # every published curve has its peak before
MINIMUM_JUDGED_FROM_S = 0.4
NO_OUTFLOW_M2 = 1e-9         # round-off of areas; one point is at least a hundred times as large
BALANCE_BAND = 1e-12
ENERGY_GAIN_BAND = 0.003
VOLUME_BAND = 0.01
MOMENTUM_BAND = 0.01

PUBLISHED = {  # names in the reference file -> how they are shown
    "antoci2007_sph": "Antoci 2007, SPH",
    "khayyer2018_isph_sph": "Khayyer 2018, ISPH-SPH",
    "ng2020_sph_vcpm": "Ng 2020, SPH-VCPM",
    "yang2012_sph_fem": "Yang 2012, SPH-FEM (a)",
    "yang2012_sph_fem_chronoB": "Yang 2012, SPH-FEM (b)",
}


@dataclass(frozen=True)
class Tip:
    """Displacement of the free end [m]."""

    ux: Curve
    uy: Curve


@dataclass(frozen=True)
class Experiment:
    tip: Tip
    ux_uncertainty: np.ndarray
    uy_uncertainty: np.ndarray

    def at_instants(self):
        """The nine instants that the rms is taken over (the first sample, at rest, is not one)."""
        def cut(curve):
            later = curve.time > 0.02
            return Curve(curve.time[later], curve.value[later])
        return Tip(cut(self.tip.ux), cut(self.tip.uy))


@dataclass(frozen=True)
class Measures:
    """Of one tip curve against the experiment; None where the curve does not reach."""

    peak_ux_m: float
    peak_ux_time_s: float
    peak_uy_m: float
    min_ux_after_peak_m: float
    rms_ux_m: float
    rms_uy_m: float
    instants_compared: int


def read_experiment():
    data = read_columns(REFERENCE / "antoci_gate_tip_experiment_mean.csv")
    time = data["time_s"]
    return Experiment(Tip(Curve(time, data["ux_m"]), Curve(time, data["uy_m"])),
                      DIGITISING_M + data["ux_halfspread_m"],
                      DIGITISING_M + data["uy_halfspread_m"])


def read_published():
    """{name shown: Tip} of every published simulation."""
    data = read_columns(REFERENCE / "antoci_gate_tip_simulations.csv")

    def curve(source, component):
        rows = (data["source"] == source) & (data["comp"] == component)
        return Curve(data["time_s"][rows], data["disp_m"][rows])
    return {PUBLISHED.get(source, source): Tip(curve(source, "x"), curve(source, "y"))
            for source in dict.fromkeys(data["source"])}


def read_tip(run):
    """The middle of the gate's lower edge, from rest on."""
    data = run.series("tip.csv")
    if len(data["time_s"]) == 0:
        raise RunError(f"{run.path / 'tip.csv'}: has no row; the run ended in its first window")
    time = data["time_s"]
    start = [] if time[0] <= 0 else [0.0]
    return Tip(*(Curve(np.concatenate([start, time]), np.concatenate([start, data[name]]))
                 for name in ("ux_m", "uy_m")))


def measure(tip, experiment):
    reference = experiment.at_instants()
    peak_ux, peak_time = tip.ux.peak()
    rms_ux, instants = rms_difference(tip.ux, reference.ux)
    rms_uy, _ = rms_difference(tip.uy, reference.uy)
    minimum = tip.ux.minimum_after(peak_time)
    return Measures(float(peak_ux), float(peak_time), float(tip.uy.peak()[0]),
                    None if minimum is None else float(minimum), rms_ux, rms_uy, instants)


def end_time(run):
    return float(run.case()["case"]["end_time_s"])


def window_length(run):
    return float(run.case()["case"].get("time_step_s", 0.0))


def is_complete(run, tip):
    return bool(run.summary.get("completed")) and \
        tip.ux.end >= end_time(run) - 0.5 * window_length(run)


def checks(run, tip, measures):
    """What the case demands of this run; a run that ends early is judged on what it contains."""
    found = [count_of(run, "lost_points", "lost points"),
             count_of(run, "failed_windows", "failed windows")]
    if tip.ux.end >= PEAK_JUDGED_FROM_S - 1e-9:
        found.append(band_check("peak of x", measures.peak_ux_m, PEAK_BAND_M))
    if tip.ux.end >= MINIMUM_JUDGED_FROM_S - 0.5 * window_length(run) - 1e-9:
        found.append(band_check("minimum of x after the peak", measures.min_ux_after_peak_m,
                                MINIMUM_BAND_M))
    return found


def band_check(what, value, band):
    shown = "none" if value is None else f"{1e3 * value:.1f} mm"
    return Check(what, shown, f"{1e3 * band[0]:.0f} to {1e3 * band[1]:.0f} mm",
                 value is not None and band[0] <= value <= band[1])


def not_judged(tip):
    """A remark on what a short run leaves open; empty for a long one."""
    if tip.ux.end < PEAK_JUDGED_FROM_S - 1e-9:
        return (f"the run ends at {tip.ux.end:.3g} s: peak and minimum are not judged "
                f"(they need {PEAK_JUDGED_FROM_S:g} and {MINIMUM_JUDGED_FROM_S:g} s)")
    if tip.ux.end < MINIMUM_JUDGED_FROM_S - 1e-3:
        return (f"the run ends at {tip.ux.end:.3g} s: the minimum after the peak is not judged "
                f"(it needs {MINIMUM_JUDGED_FROM_S:g} s)")
    return ""


def total_energy(fluid):
    """Of the water, with what it has given to the gate and carried out through the outlet [J/m]."""
    total = fluid["kinetic_j"] + fluid["potential_j"] + fluid["work_on_walls_j"]
    return total + fluid.get("outlet_energy_j", 0.0)


def momentum_balance(run, fluid):
    """Change of the water's momentum against its weight and the force on all walls, relative to
    rho g H^2 / 2: (largest over the windows, of the whole run's impulses), what left through the
    outlet included; None without the columns for it."""
    needed = ("momentum_x_n_s", "momentum_y_n_s", "outlet_momentum_x_n_s", "outlet_momentum_y_n_s",
              "wall_force_x_n", "wall_force_y_n", "point_volume_m2")
    if any(name not in fluid for name in needed) or len(fluid["time_s"]) < 2:
        return None, None
    scene = run.case()["fluid"]
    gravity, density = np.array(scene["gravity_m_s2"]), scene["density_kg_m3"]
    depth = np.ptp(np.array(scene["water_m"])[:, 1])
    scale = 0.5 * density * np.linalg.norm(gravity) * depth**2
    momentum = np.column_stack([fluid[f"momentum_{d}_n_s"] + fluid[f"outlet_momentum_{d}_n_s"]
                                for d in "xy"])
    on_walls = np.column_stack([fluid[f"wall_force_{d}_n"] for d in "xy"])
    weight = density * fluid["point_volume_m2"][:, None] * gravity
    window = np.diff(fluid["time_s"])[:, None]
    missing = np.diff(momentum, axis=0) - window * (weight - on_walls)[1:]
    of_windows = np.linalg.norm(missing / window, axis=1) / scale
    of_run = np.linalg.norm(missing.sum(axis=0)) / window.sum() / scale
    return float(of_windows.max()), float(of_run)


def energy_gain(fluid):
    """Largest rise of the fluid's energy over its start, relative to it: (before the gap opens,
    afterwards); None where there is no sample."""
    total = total_energy(fluid)
    if len(total) == 0 or total[0] == 0:
        return None, None
    gain = total / total[0] - 1
    is_open = fluid["outflow_past_tip_m2"] > NO_OUTFLOW_M2
    before, after = gain[~is_open], gain[is_open]
    return (float(before.max()) if len(before) else None,
            float(after.max()) if len(after) else None)


def warnings(run, results):
    """Figures that are no part of the band but worth a look."""
    found = []
    for key in ("force_balance_max", "moment_balance_max", "work_balance_max"):
        value = run.summary.get(key)
        if value is None:
            found.append(f"{key} was not measured")
        elif not value <= BALANCE_BAND:
            found.append(f"{key} is {value:.2g}, above {BALANCE_BAND:g}")
    gain = results.get("energy_gain_before_opening")
    if gain is not None and gain > ENERGY_GAIN_BAND:
        found.append(f"energy rises by {100 * gain:.2f} % before the gap opens, "
                     f"above {100 * ENERGY_GAIN_BAND:g} %")
    gain = results.get("energy_gain_after_opening")
    if gain is not None and gain > 0:
        found.append(f"energy is {100 * gain:.2f} % above the start after the gap has opened")
    momentum = results.get("momentum_balance_max")
    if momentum is not None and momentum > MOMENTUM_BAND:
        found.append(f"momentum misses {100 * momentum:.2f} % of rho g H^2/2 in one window "
                     f"(above {100 * MOMENTUM_BAND:g} %), "
                     f"{100 * results['momentum_balance_mean']:.2f} % over the run")
    drift = run.summary.get("volume_drift_max")
    if drift is not None and abs(drift) > VOLUME_BAND:
        found.append(f"the water's volume drifts by {100 * drift:.2f} %, "
                     f"above {100 * VOLUME_BAND:g} %")
    return found
