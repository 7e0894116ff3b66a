# SPDX-License-Identifier: MIT
"""The channel's flow from rest, far from its ends: rho u_t = G(t) + (mu(u_y) u_y)_y without net flux.

Finite volumes on a grid that is fine at the plates, the two-stage L-stable Runge-Kutta method of second order
(R. Alexander, SIAM J. Numer. Anal. 14 (1977) 1006) with geometrically growing steps, Newton's method. Height, lid
speed and density are one.
"""

import numpy as np

FIRST_STEP = 1e-6
STAGE = 1 - 1 / np.sqrt(2)


class PowerLawFlow:
    """k s^(n-1) with s = sqrt(u_y^2 + lowest^2), no more than `highest`, as in fluid/rheology.hpp."""

    def __init__(self, exponent, consistency, cells=120, lowest=1e-3, highest=1e9):
        self.exponent, self.consistency = exponent, consistency
        self.lowest, self.highest = lowest, highest
        faces = 0.5 - 0.5 * np.cos(np.pi * np.linspace(0, 1, cells + 1))
        self.height = 0.5 * (faces[1:] + faces[:-1])
        self.width = np.diff(faces)
        self.distance = np.diff(np.concatenate([[0], self.height, [1]]))

    def stress(self, u):
        """Shear stress at the faces and its derivative by the shear rate."""
        gamma = np.diff(np.concatenate([[0], u, [1]])) / self.distance
        seen = np.hypot(gamma, self.lowest)
        mu = self.consistency * seen**(self.exponent - 1)
        slope = np.where(mu > self.highest, 0, (self.exponent - 1) * mu / seen)
        mu = np.minimum(mu, self.highest)
        return mu * gamma, mu + slope * gamma**2 / seen

    def rate(self, u, gradient):
        return np.diff(self.stress(u)[0]) / self.width + gradient

    def stage(self, base, dt, u, gradient):
        """Solves u = base + dt rate(u, gradient) without net flux."""
        n = len(u)
        cell = np.arange(n)
        for _ in range(100):
            _, slope = self.stress(u)
            below, above = (slope[:-1] / self.distance[:-1] / self.width,
                            slope[1:] / self.distance[1:] / self.width)
            matrix = np.zeros((n + 1, n + 1))
            matrix[cell, cell] = 1 + dt * (below + above)
            matrix[cell[1:], cell[:-1]] = -dt * below[1:]
            matrix[cell[:-1], cell[1:]] = -dt * above[:-1]
            matrix[:n, n] = -dt
            matrix[n, :n] = self.width
            residual = np.append(u - base - dt * self.rate(u, gradient), self.width @ u)
            change = np.linalg.solve(matrix, -residual)
            size = np.abs(change[:-1]).max()
            share = max(0.3, min(1.0, 0.05 / max(size, 1e-300)))
            u, gradient = u + share * change[:-1], gradient + share * change[-1]
            if size < 1e-10:
                return u, gradient
        raise ArithmeticError(f"n = {self.exponent:g}, k = {self.consistency:g}: no convergence")

    def velocity(self, end, steps=120):
        """u at self.height at the time `end`."""
        u, gradient = np.zeros_like(self.height), 0.0
        for dt in np.diff(np.concatenate([[0], np.geomspace(FIRST_STEP, end, steps)])):
            first, at_first = self.stage(u, STAGE * dt, u, gradient)
            base = u + (1 - STAGE) * dt * self.rate(first, at_first)
            u, gradient = self.stage(base, STAGE * dt, first, at_first)
        return u
