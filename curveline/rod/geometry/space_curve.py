"""The curve of a state in space, with the forces and moments that hold it."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from curveline.rod.geometry.hermite import interpolate
from curveline.rod.problem import Array

X, Y, Z = range(3)
"""Axes: x and y span the display's plane."""


@dataclass(frozen=True)
class SpaceCurve:
    """A curve in the frame of its left pivot, in SI, z out of the display's plane towards the viewer.

    `table (m+1, 9)` holds position [m], its slope and its second derivative [1/m] by the unstretched arc length at the
    ends of `edges (m,)` [m] of the free rod. The rod is held straight for half of `clamp` along the `tangents (2, 3)`
    at both ends of its `length`; `chord (3,)` leads from pivot to pivot. `forces (2, 3)` [N] and `moments (2, 3)` [N m]
    are those of the clamps on the rod, where the free rod begins and ends.
    """

    table: Array
    edges: Array
    tangents: Array
    chord: Array
    length: float  # [m]
    clamp: float  # [m]
    forces: Array
    moments: Array

    @property
    def vertices(self) -> Array:
        """Positions (m+1, 3) [m] of the vertices."""
        return self.table[:, :3]

    @property
    def slopes(self) -> Array:
        """Slopes (m+1, 3) of the position by the arc length at the vertices."""
        return self.table[:, 3:6]

    @property
    def bends(self) -> Array:
        """Second derivatives (m+1, 3) [1/m] at the vertices."""
        return self.table[:, 6:]

    def coordinate(self, axis: int) -> Array:
        """One coordinate of the vertices (`X`, `Y` or `Z`), its slope and its second derivative: (m+1, 3)."""
        return self.table[:, axis::3]

    def positions(self, points: int) -> Array:
        """`points` positions (points, 3) [m], equally spaced in arc length from pivot to pivot."""
        half = 0.5 * self.clamp
        places = np.linspace(0.0, self.length, points)
        out = np.empty((points, 3))
        interpolate(self.table, self.edges, places - half, out)
        before = places < half
        out[before] = places[before, None] * self.tangents[0]
        after = places > self.length - half
        out[after] = self.chord - (self.length - places[after, None]) * self.tangents[1]
        return out

    @property
    def depth(self) -> float:
        """Largest distance from the display's plane [m]."""
        return float(np.max(np.abs(self.vertices[:, Z])))

    @cached_property
    def mean_depth(self) -> float:
        """Mean distance of the free rod from the display's plane, positive in front of it [m]."""
        return float(np.sum(_integrals(self.coordinate(Z), self.edges)) / np.sum(self.edges))


def _integrals(table: Array, edges: Array) -> Array:
    """Integrals (m,) over `edges (m,)` of the quintic through values, slopes and second derivatives (m+1, 3)."""
    before, after = table[:-1], table[1:]
    sums, differences = before + after, before - after
    return edges * (sums[:, 0] / 2.0 + edges * differences[:, 1] / 10.0 + edges**2 * sums[:, 2] / 120.0)
