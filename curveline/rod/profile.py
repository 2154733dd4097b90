"""Kernels of a natural curvature that varies along the rod: what each vertex of a discrete rod is bent by when free.

A `profile (k, 3)` has a row for each place along the rod's material: the place [m], the curvature of the free rod there
[1/m] and its slope [1/m^2]; between two rows the curvature is a cubic, beyond them it is constant. One without rows is
of a rod that is bent alike all along.

The angle of an edge is the mean of the tangent's over it. So what a vertex turns by when free is the difference of the
means on both its sides, and a bend that is shorter than an edge moves no vertex from where it belongs.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from curveline.kernels.forms import Matrix, Vector
from curveline.kernels.kernel import leaf, shipped

PLACE, CURVATURE, SLOPE = range(3)
"""The columns of a profile."""
NO_PROFILE: NDArray[np.float64] = np.empty((0, 3))

TURN, BENT, BEFORE = range(3)
"""The rows of what vertices have when the rod is free: their turn [rad], the curvature there times the length, and what
of the turn lies before the vertex."""


@leaf
def interval_at(profile, place, k):
    """The row of a profile that a `place` lies behind, sought from row `k` on; the first one if it lies before all."""
    while k + 1 < profile.shape[0] and profile[k + 1, PLACE] <= place:
        k += 1
    return k


@leaf
def expanded(profile, k, place):
    """The cubic behind row `k` in powers of the distance from a `place`: the factors of the powers 0 to 3."""
    if k + 1 == profile.shape[0] or place < profile[0, PLACE]:
        return profile[k, CURVATURE], 0.0, 0.0, 0.0
    h = profile[k + 1, PLACE] - profile[k, PLACE]
    t = (place - profile[k, PLACE]) / h
    rise = profile[k + 1, CURVATURE] - profile[k, CURVATURE]
    start, end = h * profile[k, SLOPE], h * profile[k + 1, SLOPE]
    square, cube = 3.0 * rise - 2.0 * start - end, start + end - 2.0 * rise
    return (
        profile[k, CURVATURE] + t * (start + t * (square + t * cube)),
        (start + t * (2.0 * square + t * 3.0 * cube)) / h,
        (square + 3.0 * t * cube) / h**2,
        cube / h**3,
    )


@leaf
def turned_along(profile, k, begin, end):
    """Angle [rad] by which the free rod turns from one place to another, the integral of that, and the last row.

    The integral over the way [m rad] is that of the angle by which it has turned since the `begin`, which lies behind
    row `k` or a later one.
    """
    place, turned, swept = begin, 0.0, 0.0
    while True:
        k = interval_at(profile, place, k)
        stop = end
        if place < profile[0, PLACE]:
            stop = min(end, profile[0, PLACE])
        elif k + 1 < profile.shape[0]:
            stop = min(end, profile[k + 1, PLACE])
        c0, c1, c2, c3 = expanded(profile, k, place)
        x = stop - place
        swept += x * (turned + x * (c0 / 2.0 + x * (c1 / 6.0 + x * (c2 / 12.0 + x * c3 / 20.0))))
        turned += x * (c0 + x * (c1 / 2.0 + x * (c2 / 3.0 + x * c3 / 4.0)))
        if stop == end:
            return turned, swept, k
        place = stop


@leaf
def turned_between(profile, begin, end):
    """Angle [rad] by which the free rod turns from one place to another; 0 without a profile."""
    if profile.shape[0] == 0:
        return 0.0
    return turned_along(profile, 0, begin, end)[0]


@shipped(Matrix, float, float, Vector)
def laid_free(profile, begin, unit, edges):
    """What the vertices of a rod have when it is free, (3, n+1): see `lay_free`."""
    rest = np.zeros((3, edges.size + 1))
    lay_free(profile, begin, unit, edges, rest)
    return rest


@leaf
def lay_free(profile, begin, unit, edges, rest):
    """What the vertices of a rod have when it is free, into `rest (3, n+1)`: see `TURN`, `BENT`, `BEFORE`.

    The rod's `edges (n,)` are in units of `unit` [m], and it begins at the place `begin` [m].
    """
    n = edges.size
    k = interval_at(profile, begin, 0)
    place, angle, before = begin, 0.0, 0.0
    for j in range(n):
        rest[BENT, j] = unit * expanded(profile, k, place)[0]
        rest[BEFORE, j] = angle - before
        end = place + unit * edges[j]
        turned, swept, k = turned_along(profile, k, place, end)
        mean = angle + swept / (end - place)
        rest[TURN, j] = mean - before
        place, angle, before = end, angle + turned, mean
    k = interval_at(profile, place, k)
    rest[BENT, n] = unit * expanded(profile, k, place)[0]
    rest[BEFORE, n] = rest[TURN, n] = angle - before


@shipped(Matrix, float, Vector)
@leaf
def hidden_between(profile, begin, edges):
    """How far a free rod may be from a smooth curve through its vertices, at most, between these [m].

    The `edges (n,)` [m] begin at the place `begin`. In the middle of each the angle is held against that of the cubic
    that has angles and curvatures of both its ends; a quarter of its length is the way over which that counts.
    """
    k = interval_at(profile, begin, 0)
    place, most = begin, 0.0
    here = expanded(profile, k, place)[0]
    for j in range(edges.size):
        middle, end = place + 0.5 * edges[j], place + edges[j]
        half, _, k = turned_along(profile, k, place, middle)
        rest, _, k = turned_along(profile, k, middle, end)
        k = interval_at(profile, end, k)
        there = expanded(profile, k, end)[0]
        smooth = 0.5 * (half + rest) + 0.125 * edges[j] * (here - there)
        most = max(most, 0.25 * edges[j] * abs(half - smooth))
        place, here = end, there
    return most
