# SPDX-License-Identifier: MIT
"""The channel: its exact profile, and the error of a run's.

Between plates at y = 0 (at rest) and y = 1 (unit speed) the shear stress is linear, tau = tau_0 + G y, and
u' = sign(tau) |tau|^(1/n). The two unknowns follow from u(1) = 1, no net flux and integrals in closed form:

    int u' dy = 1,    int u dy = 1 - int y u' dy = 0.
"""

import numpy as np

TOLERANCE = 1e-13


def moments(exponent, wall_stress, gradient):
    """(int u' dy, int y u' dy) over the channel."""
    power = 1 / exponent

    def integrals(stress):   # of u' and of stress times u' over the stress
        size = abs(stress)
        return (size**(power + 1) / (power + 1),
                np.sign(stress) * size**(power + 2) / (power + 2))
    p1, q1 = integrals(wall_stress + gradient)
    p0, q0 = integrals(wall_stress)
    return (p1 - p0) / gradient, ((q1 - q0) - wall_stress * (p1 - p0)) / gradient**2


def stresses(exponent):
    """(tau_0, G) by Newton's method from the Newtonian ones, -2 and 6."""
    unknown = np.array([-2.0, 6.0])
    for _ in range(100):
        residual = np.array(moments(exponent, *unknown)) - 1
        if np.abs(residual).max() < TOLERANCE:
            return tuple(unknown)
        step = 1e-7
        columns = [(np.array(moments(exponent, *(unknown + step * e))) - 1 - residual) / step
                   for e in np.eye(2)]
        unknown = unknown - np.linalg.solve(np.column_stack(columns), residual)
    raise ArithmeticError(f"no profile for the exponent {exponent:g}: residual {residual}")


def exact_velocity(exponent, y):
    """u at the heights y."""
    wall_stress, gradient = stresses(exponent)
    power = 1 / exponent
    stress = wall_stress + gradient * np.asarray(y, float)
    return (np.abs(stress)**(power + 1) - abs(wall_stress)**(power + 1)) / (gradient * (power + 1))


def name_of(exponent, points):
    return f"n{exponent:g}-{points}"


def profile(run, name):
    """(y, u, v) in the middle at the last output."""
    line = run.series(f"{name}/probe_middle.csv")
    now = line["time_s"] == line["time_s"].max()
    return line["y_m"][now], line["u_m_s"][now], line["v_m_s"][now]


def error(run, exponent, points):
    """rms over the profile, over the lid's speed."""
    y, u, _ = profile(run, name_of(exponent, points))
    return float(np.sqrt(np.mean((u - exact_velocity(exponent, y))**2)))
