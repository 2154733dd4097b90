"""How far curves are from each other: over the width that they share, and across the curve.

Heights over x are what *A Multi-Stable Curved Line Shape Display* measures (V-A). Where a curve overhangs it has more
than one height over an x; then only distances across it are known.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from curveline.fitting.measured import Gaps, mean_square
from curveline.trial import Array

PLACES = 501
"""Places over the common span, equally far apart, and points along a curve."""
OVERHANG = 0.01
"""A curve overhangs where its x goes back by more than this part of its width; less is noise of its points."""


def heights_at(points: Array, x: Array) -> Array | None:
    """Heights of a polyline `(n, 2)` at `x (k,)`, within its width; None if it overhangs."""
    along = points[:, 0]
    back = float(np.max(np.maximum.accumulate(along) - along))
    if back > OVERHANG * float(np.ptp(along)):
        return None
    order = np.argsort(along, kind="stable")
    heights: Array = np.interp(x, along[order], points[order, 1])
    return heights


def common_span(curves: Sequence[Array]) -> Array:
    """`PLACES` equally spaced x that all curves `(n, 2)` reach; empty if there is no such width."""
    begin = max(float(curve[:, 0].min()) for curve in curves)
    end = min(float(curve[:, 0].max()) for curve in curves)
    return np.linspace(begin, end, PLACES) if end > begin else np.zeros(0)


def along(points: Array) -> Array:
    """`PLACES` points of a polyline `(n, 2)`, equally spaced in arc length."""
    steps = np.hypot(*np.diff(points, axis=0).T)
    places = np.concatenate([[0.0], np.cumsum(steps)])
    wanted = np.linspace(0.0, places[-1], PLACES)
    return np.column_stack([np.interp(wanted, places, points[:, column]) for column in (0, 1)])


def rms_across(points: Array, curve: Array) -> float:
    """Root mean square distance [m] from a polyline `(n, 2)`, evenly along it, to the nearest points of a `curve`."""
    there = along(points)
    return math.sqrt(mean_square(there, Gaps.between(there, curve).there))


def rms_over(heights: Array, expected: Array) -> float:
    """Root mean square difference [m] between `heights (trials, k)` and `expected (k,)`."""
    return float(np.sqrt(np.mean((heights - expected) ** 2)))


def mean_deviation(heights: Array, ddof: int) -> float | None:
    """Mean over the places of the standard deviation between trials, `heights (trials, k)` [m], with `ddof` (0 or 1).

    None of fewer than two trials.
    """
    return float(np.mean(np.std(heights, axis=0, ddof=ddof))) if len(heights) > 1 else None
