"""Kernels of a natural curvature that varies along the rod: what each vertex of a discrete rod is bent by when free.

A `profile (k, 4)` has a row for each place along the rod's material: the place [m], the angle [rad] by which the free
rod turned since the first one, its curvature [1/m] and the slope of that [1/m^2]; between two rows the curvature is a
cubic, beyond them it is constant. One without rows is of a rod that is bent alike all along.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from curveline.kernels.kernel import leaf

PLACE, TURNED, CURVATURE, SLOPE = range(4)
"""The columns of a profile."""
NO_PROFILE: NDArray[np.float64] = np.empty((0, 4))


@leaf
def interval_at(profile, place, k):
    """The row of a profile that a `place` lies behind, sought from row `k` on; the first one if it lies before all."""
    while k + 1 < profile.shape[0] and profile[k + 1, PLACE] <= place:
        k += 1
    return k


@leaf
def curvature_behind(profile, k, place):
    """Curvature [1/m] at a `place` behind row `k`; see `interval_at`."""
    last = profile.shape[0] - 1
    if place <= profile[0, PLACE] or k == last:
        return profile[k, CURVATURE]
    h = profile[k + 1, PLACE] - profile[k, PLACE]
    t = (place - profile[k, PLACE]) / h
    rise = profile[k + 1, CURVATURE] - profile[k, CURVATURE]
    start, end = h * profile[k, SLOPE], h * profile[k + 1, SLOPE]
    return profile[k, CURVATURE] + t * (start + t * (3.0 * rise - 2.0 * start - end + t * (start + end - 2.0 * rise)))


@leaf
def angle_behind(profile, k, place):
    """Angle [rad] by which the free rod turned since the first row, at a `place` behind row `k`."""
    last = profile.shape[0] - 1
    beyond = place - profile[k, PLACE]
    if place <= profile[0, PLACE] or k == last:
        return profile[k, TURNED] + beyond * profile[k, CURVATURE]
    h = profile[k + 1, PLACE] - profile[k, PLACE]
    t = beyond / h
    rise = profile[k + 1, CURVATURE] - profile[k, CURVATURE]
    start, end = h * profile[k, SLOPE], h * profile[k + 1, SLOPE]
    cubic, quartic = (3.0 * rise - 2.0 * start - end) / 3.0, 0.25 * (start + end - 2.0 * rise)
    return profile[k, TURNED] + beyond * (profile[k, CURVATURE] + t * (0.5 * start + t * (cubic + t * quartic)))


@leaf
def turned_between(profile, begin, end):
    """Angle [rad] by which the free rod turns from one place to another; 0 without a profile."""
    if profile.shape[0] == 0:
        return 0.0
    here, there = interval_at(profile, begin, 0), interval_at(profile, end, 0)
    return angle_behind(profile, there, end) - angle_behind(profile, here, begin)


@leaf
def lay_free(profile, begin, unit, edges, rest):
    """What the vertices of a rod are bent by when it is free, into `rest (2, n+1)`: turn [rad], curvature times `unit`.

    The rod's `edges (n,)` are in units of `unit` [m], and it begins at the place `begin` [m]. A vertex turns by what
    lies between the middles of the edges beside it, one at an end by what lies before or behind that.
    """
    n = edges.size
    here = interval_at(profile, begin, 0)
    between = here
    before = angle_behind(profile, here, begin)
    place = begin
    for i in range(n + 1):
        here = interval_at(profile, place, here)
        half = 0.5 * unit * edges[i] if i < n else 0.0
        between = interval_at(profile, place + half, between)
        after = angle_behind(profile, between, place + half)
        rest[0, i] = after - before
        rest[1, i] = unit * curvature_behind(profile, here, place)
        before = after
        place += 2.0 * half
