# SPDX-License-Identifier: MIT
"""What a free surface must be free of: its normal traction, and viscosity that only the surface has.

At a point of the surface the traction along the normal n is -p + 2 mu n . grad(u) n. The gradient is a linear
least-squares fit over the points within 2.6 spacings, n points away from their centre of mass.
"""

from dataclasses import dataclass

import numpy as np

RADIUS, NEAR_SURFACE = 2.6, 2.0    # spacings
INTERIOR, SURFACE = 0, 1           # kinds of points
LEAST_NEIGHBOURS = 6               # fewer are spray


@dataclass(frozen=True)
class Surface:
    """Of one instant: per surface point its place and normal traction [Pa]; largest viscosity
    [Pa s] of the points within two spacings of the surface and of the other, interior ones."""

    position: np.ndarray
    traction: np.ndarray
    viscosity_near: float
    viscosity_inside: float


def neighbours(position, radius):
    """(i, j) of all pairs closer than `radius`, both ways, without i = j."""
    cell = np.floor((position - position.min(axis=0)) / radius).astype(int)
    members = {}
    for k, key in enumerate(map(tuple, cell)):
        members.setdefault(key, []).append(k)
    first, second = [], []
    for (x, y), here in members.items():
        around = [k for dx in (-1, 0, 1) for dy in (-1, 0, 1)
                  for k in members.get((x + dx, y + dy), [])]
        i, j = np.meshgrid(here, around, indexing="ij")
        near = (((position[i] - position[j])**2).sum(axis=2) < radius**2) & (i != j)
        first.append(i[near])
        second.append(j[near])
    return np.concatenate(first), np.concatenate(second)


def normal_stretching(offset, difference):
    """n . grad(u) n from the neighbours' offsets and velocity differences."""
    gradient, *_ = np.linalg.lstsq(offset, difference, rcond=None)
    normal = -offset.sum(axis=0)
    normal /= np.linalg.norm(normal)
    return float(normal @ gradient.T @ normal)


def measure(cloud, spacing):
    kind = cloud.fields["kind"].ravel()
    velocity, mu = cloud.fields["velocity"][:, :2], cloud.fields["viscosity"].ravel()
    pressure = cloud.fields["pressure"].ravel()
    i, j = neighbours(cloud.position, RADIUS * spacing)
    order = np.argsort(i, kind="stable")
    i, j = i[order], j[order]
    place, traction = [], []
    for k in np.flatnonzero(kind == SURFACE):
        of_k = j[np.searchsorted(i, k):np.searchsorted(i, k, side="right")]
        if len(of_k) < LEAST_NEIGHBOURS:
            continue
        stretching = normal_stretching(cloud.position[of_k] - cloud.position[k],
                                       velocity[of_k] - velocity[k])
        place.append(cloud.position[k])
        traction.append(-pressure[k] + 2 * mu[k] * stretching)
    distance = np.linalg.norm(cloud.position[i] - cloud.position[j], axis=1)
    touches = (kind[j] == SURFACE) & (distance < NEAR_SURFACE * spacing)
    near = (kind == SURFACE) | np.isin(np.arange(len(kind)), i[touches])
    inside = (kind == INTERIOR) & ~near
    return Surface(np.array(place).reshape(-1, 2), np.array(traction),
                   float(mu[near & (kind != 2)].max(initial=0)), float(mu[inside].max(initial=0)))
