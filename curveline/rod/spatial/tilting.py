"""Bearings that tilt while a rod moves between them: Newton's step of `dynamics.step` with their tilts as unknowns.

Bearings have no inertia, and a spring beyond their play: one that stops there would have to strike.

A tilt takes its mouth along, and the frame of its clamp: what that does to the slope of the
energy is taken by differences, which leaves Newton's method a little slower, and the step that it finds as exact.
"""

from __future__ import annotations

import math

import numpy as np

from curveline.rod.planar.clamps import LOOSE
from curveline.rod.problem import Array
from curveline.rod.spatial.bands import cholesky, solve_factored, times
from curveline.rod.spatial.energy import Shape, SpatialRod, assemble, moments, positions
from curveline.rod.spatial.mouths import GIVE, PLAY, REACH

DIFFERENCE = 1e-6
"""Tilt [rad] by which slopes are taken."""
Tilts = tuple[float, float]


def is_giving(rod: SpatialRod) -> bool:
    """True for a rod whose bearings may tilt."""
    return rod.bearings[GIVE] > 0.0 or rod.bearings[PLAY] > 0.0


def held_at(rod: SpatialRod, shape: Shape) -> Array:
    """Where the last mouth is held (3,), seen from where the motor holds the first one."""
    return rod.chord - _arm(rod, shape.tilts[1], 1) + _arm(rod, 0.0, 1)


def _arm(rod: SpatialRod, tilt: float, end: int) -> Array:
    """From a pivot to its mouth, at the last end back from the mouth (3,)."""
    w, x, y, z = rod.frames[end].tolist()
    across, up = 2.0 * (x * z + w * y), 2.0 * (y * z - w * x)
    c, s = math.cos(tilt), math.sin(tilt)
    return rod.bearings[REACH] * np.array([c * across - s * up, s * across + c * up, 0.0])


def _spring(rod: SpatialRod, tilt: float) -> tuple[float, float]:
    """Moment of a bearing and its slope: see `planar.clamps.spring`."""
    beyond = abs(tilt) - rod.bearings[PLAY]
    if beyond <= 0.0:
        return LOOSE * tilt, LOOSE
    rate = 1.0 / rod.bearings[GIVE]
    return LOOSE * tilt + math.copysign(beyond, tilt) * rate, LOOSE + rate


def newton_step(rod: SpatialRod, shape: Shape, gradient: Array, band: Array) -> tuple[Array, Tilts] | None:
    """Newton's step (4n+3,) and that of the tilts (2,); None if the band of what is free is not positive definite.

    `gradient` and `band` are those of what a time step minimises, with nothing held.
    """
    last = gradient.size - 3
    free, ends = slice(3, last), (slice(0, 3), slice(last, None))
    change = np.zeros(gradient.size)
    change[last:] = held_at(rod, shape) - positions(rod, shape)[-1]
    gradient = gradient + times(band, change)
    moment = moments(rod, shape)[:, 2]
    right, slope, bend = [-gradient[free]], np.empty(2), np.zeros((2, 2))
    ways = []
    for end in range(2):
        side, arm = 1.0 - 2.0 * end, _arm(rod, shape.tilts[end], end)
        way = np.zeros(gradient.size)
        way[ends[end]] = side * np.array([-arm[1], arm[0], 0.0])
        there, back = (_tilted(shape, end, sign * DIFFERENCE) for sign in (1.0, -1.0))
        turned = (assemble(rod, there)[0] - assemble(rod, back)[0]) / (2.0 * DIFFERENCE)
        twisted = (moments(rod, there)[end, 2] - moments(rod, back)[end, 2]) / (2.0 * DIFFERENCE)
        asked, rate = _spring(rod, shape.tilts[end])
        whole = times(band, way)
        right.append(-(whole + turned)[free])
        slope[end] = way @ gradient + moment[end] + turned @ change + asked
        bend[end, end] = way @ whole + 2.0 * way @ turned + twisted + rate - side * arm @ gradient[ends[end]]
        ways.append(way)
    factor = cholesky(band[free])
    if factor is None:
        return None
    steps = np.array([solve_factored(factor, each) for each in right])
    for end in range(2):
        slope[end] -= right[1 + end] @ steps[0]
        bend[end] -= right[1 + end] @ steps[1:].T
    tilts = -np.linalg.solve(bend, slope)
    change[free] = steps[0] + tilts @ steps[1:]
    change += tilts @ np.array(ways)
    return (change, (float(tilts[0]), float(tilts[1]))) if np.all(np.isfinite(change)) else None


def _tilted(shape: Shape, end: int, more: float) -> Shape:
    first, last = shape.tilts
    return shape._replace(tilts=(first + more, last) if end == 0 else (first, last + more))
