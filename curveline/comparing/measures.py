"""How far curves are from each other: over the width that they share, and across the curve.

Heights over x are what *A Multi-Stable Curved Line Shape Display* measures (V-A). Where a curve overhangs it has more
than one height over an x; then only distances across it are known.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from curveline.fitting.measured import Gaps
from curveline.trial import Array
from curveline.units import mm

PLACES = 501
"""Places over the common span, equally far apart, and points along a curve."""
OVERHANG = 0.01
"""A curve overhangs where its x goes back by more than this part of its width; less is noise of its points."""


HOLE, LEAST_HOLE = 4.0, mm(15.0)
"""Neighbours so many times as far apart as most, and at least so far, have something between them that was not seen."""


def holes_in(points: Array) -> list[int]:
    """The pairs of neighbours of a polyline `(n, 2)` between which nothing is known: the numbers of the former."""
    steps = np.hypot(*np.diff(points, axis=0).T)
    found: list[int] = np.flatnonzero(steps > max(HOLE * float(np.median(steps)), LEAST_HOLE)).tolist()
    return found


def heights_at(points: Array, x: Array) -> Array | None:
    """Heights of a polyline `(n, 2)` at `x (k,)`, within its width, NaN in its holes; None if it overhangs."""
    along = points[:, 0]
    back = float(np.max(np.maximum.accumulate(along) - along))
    if back > OVERHANG * float(np.ptp(along)):
        return None
    order = np.argsort(along, kind="stable")
    heights: Array = np.interp(x, along[order], points[order, 1])
    for hole in holes_in(points):
        low, high = sorted(along[hole : hole + 2])
        heights[(x > low) & (x < high)] = np.nan
    return heights


def common_span(curves: Sequence[Array]) -> Array:
    """`PLACES` equally spaced x that all curves `(n, 2)` reach; empty if there is no such width."""
    begin = max(float(curve[:, 0].min()) for curve in curves)
    end = min(float(curve[:, 0].max()) for curve in curves)
    return np.linspace(begin, end, PLACES) if end > begin else np.zeros(0)


def along(points: Array) -> Array:
    """Points of a polyline `(n, 2)`, equally spaced in arc length, `PLACES` of them but for those in its holes."""
    steps = np.hypot(*np.diff(points, axis=0).T)
    places = np.concatenate([[0.0], np.cumsum(steps)])
    wanted = np.linspace(0.0, places[-1], PLACES)
    for hole in holes_in(points):
        wanted = wanted[(wanted <= places[hole]) | (wanted >= places[hole + 1])]
    return np.column_stack([np.interp(wanted, places, points[:, column]) for column in (0, 1)])


def rms_across(points: Array, curve: Array) -> float:
    """Root mean square distance [m] from a polyline `(n, 2)`, evenly along it, to the nearest points of a `curve`."""
    return math.sqrt(float(np.mean(Gaps.between(along(points), curve).there ** 2)))


def rms_over(heights: Array, expected: Array) -> float:
    """Root mean square difference [m] between `heights (trials, k)` and `expected (k,)`, where both are known."""
    return float(np.sqrt(np.nanmean((heights - expected) ** 2)))


def mean_deviation(heights: Array, ddof: int) -> float | None:
    """Mean over the places of the standard deviation between trials, `heights (trials, k)` [m], with `ddof` (0 or 1).

    None of fewer than two trials.
    """
    return float(np.mean(np.std(heights, axis=0, ddof=ddof))) if len(heights) > 1 else None
