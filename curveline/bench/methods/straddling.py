"""How codes whose clamps hold whole edges are given a clamp: the first and the last edge straddle it.

Holding the first edge beyond the clamp, as their examples do, imposes the tangent half an edge too late: an error of
first order in the edges, 3 mm on 50 of them. An edge whose middle is the clamp makes it second order.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from curveline.bench.methods.cases import Case
from curveline.rod.problem import Array

STILL = 1e-4
"""A dynamic code has come to rest once no vertex is faster than this [m/s]."""
CLOSED = 1e-13


class Start(NamedTuple):
    """n + 1 equal edges of length `h` [m]: `angles (n+1,)` [rad], `vertices (n+2, 2)` [m] from the left pivot."""

    h: float
    angles: Array
    vertices: Array

    @property
    def free(self) -> slice:
        """The vertices that no clamp holds."""
        return slice(2, len(self.vertices) - 2)

    def places(self, case: Case) -> Array:
        """Arc lengths from the left pivot of the free vertices [m]."""
        order = np.arange(len(self.vertices), dtype=np.float64)[self.free]
        return np.asarray(0.5 * case.rod.clamp + self.h * (order - 0.5), dtype=np.float64)


def straddling(case: Case, n: int) -> Start:
    """The spline guess on n edges and one more, the outer two along the clamps, closed to the chord exactly."""
    rod = case.rod
    h = rod.free_length / n
    guess = case.guess(2 * n)
    angles = np.array([rod.start, *(0.5 * (guess[1:-1:2] + guess[2::2])), rod.end])
    edges = np.array([0.5 * h, *np.full(n - 1, h), 0.5 * h])
    angles = closed(angles, edges, np.array(rod.free_chord))
    steps = h * np.column_stack([np.cos(angles), np.sin(angles)])
    first = np.array(rod.free_start) - 0.5 * steps[0]
    return Start(h, angles, first + np.vstack([np.zeros(2), np.cumsum(steps, axis=0)]))


def closed(angles: Array, edges: Array, chord: Array) -> Array:
    """The nearest `angles (m,)` to those given whose edges sum to `chord (2,)`, the outer two angles held."""
    free = np.ones(angles.size)
    free[[0, -1]] = 0.0
    for _ in range(30):
        gap = np.array([edges @ np.cos(angles), edges @ np.sin(angles)]) - chord
        if np.abs(gap).max() < CLOSED:
            break
        slopes = np.vstack([-np.sin(angles), np.cos(angles)]) * free
        angles = angles - slopes.T @ np.linalg.solve((slopes * edges) @ slopes.T, gap)
    return angles
