# SPDX-License-Identifier: MIT
"""The channel: its exact profile, and the error of a run's.

Between plates at y = 0 (at rest) and y = 1 (unit speed) the shear stress is linear, tau = tau_0 + G y, and
u' = sign(tau) (|tau| - tau_y)^(1/n) where |tau| exceeds the yield stress, which is zero for a power law. The two
unknowns follow from u(1) = 1, no net flux and integrals in closed form:

    int u' dy = 1,    int u dy = 1 - int y u' dy = 0.
"""

import numpy as np

from run_folder import RunError

TOLERANCE = 1e-13


def moments(exponent, wall_stress, gradient, yield_stress):
    """(int u' dy, int y u' dy) over the channel."""
    power = 1 / exponent

    def integrals(stress):   # of u' and of stress times u' over the stress
        excess = max(abs(stress) - yield_stress, 0.0)
        first = excess**(power + 1) / (power + 1)
        return first, np.sign(stress) * (excess**(power + 2) / (power + 2) + yield_stress * first)
    p1, q1 = integrals(wall_stress + gradient)
    p0, q0 = integrals(wall_stress)
    return (p1 - p0) / gradient, ((q1 - q0) - wall_stress * (p1 - p0)) / gradient**2


def stresses(exponent, yield_stress=0.0):
    """(tau_0, G) by Newton's method from the Newtonian ones, -2 and 6, and the yield stress at the plates."""
    unknown = np.array([-2.0 - yield_stress, 6.0 + 2 * yield_stress])
    for _ in range(100):
        residual = np.array(moments(exponent, *unknown, yield_stress)) - 1
        if np.abs(residual).max() < TOLERANCE:
            return tuple(unknown)
        step = 1e-7
        columns = [(np.array(moments(exponent, *(unknown + step * e), yield_stress)) - 1 - residual) / step
                   for e in np.eye(2)]
        unknown = unknown - np.linalg.solve(np.column_stack(columns), residual)
    raise ArithmeticError(f"no profile for the exponent {exponent:g}: residual {residual}")


def exact_velocity(exponent, y, yield_stress=0.0):
    """u at the heights y."""
    wall_stress, gradient = stresses(exponent, yield_stress)
    power = 1 / exponent

    def excess(stress):
        return np.maximum(np.abs(stress) - yield_stress, 0)
    stress = wall_stress + gradient * np.asarray(y, float)
    return (excess(stress)**(power + 1) - excess(wall_stress)**(power + 1)) / (gradient * (power + 1))


def name_of(exponent, points):
    return f"n{exponent:g}-{points}"


def profile(run, name):
    """(y, u, v) in the middle at the last output."""
    line = run.series(f"{name}/probe_middle.csv")
    now = line["time_s"] == line["time_s"].max()
    return line["y_m"][now], line["u_m_s"][now], line["v_m_s"][now]


def error(run, exponent, points):
    """rms over the profile and the outputs of the second half of the run, over the lid's speed.

    The flow is steady by then, the points are not: one output alone is off by half to twice of this.
    """
    line = run.series(f"{name_of(exponent, points)}/probe_middle.csv")
    if len(line["time_s"]) == 0:
        raise RunError(f"{run.path}: no profile was written; the run ended before its first output at "
                       "case.output_interval_s: let it go on longer")
    late = line["time_s"] > 0.5 * line["time_s"].max()
    return float(np.sqrt(np.mean((line["u_m_s"][late] - exact_velocity(exponent, line["y_m"][late]))**2)))
