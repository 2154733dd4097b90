"""The stable curves of a display that are nearest to a drawn one, wherever that is up or down the rails."""

from __future__ import annotations

from functools import lru_cache
from typing import NamedTuple

import numpy as np

from curveline.atlases.curves import StableCurves, curves_of
from curveline.atlases.entries import Array, share_of
from curveline.errors import InvalidInput
from curveline.rod.branches.continuation import STIFFEST
from curveline.rod.problem import Pose
from curveline.scene import Display

LOOKED_AT = 200
"""Of the nearest curves, from which unlike ones are taken."""


class NearCurve(NamedTuple):
    """A stable curve near a drawn one: the pose of its nodes, the height of the left one, a state to start from."""

    pose: Pose
    height: float  # [m]
    angles: Array  # (EDGES,) [rad]
    multipliers: Array  # (2,)


class _Compared(NamedTuple):
    """Stable curves, and what comparing them takes."""

    curves: StableCurves
    flat: Array  # (s, 2 POINTS), without their mean heights [m]
    squares: Array  # (s,) of these [m^2]
    heights: Array  # (s,), mean ones [m]
    margins: Array  # (s,), lowest eigenvalues, parts of `STIFFEST`
    shares: Array  # (s,) of what rod or motors can give


@lru_cache(4)
def _compared(display: Display) -> _Compared | None:
    """The curves of a display; None if it has no atlas."""
    try:
        curves = curves_of(display)
    except InvalidInput:
        return None
    entries = curves.entries
    heights = entries["curve"][:, :, 1].mean(axis=1)
    flat = entries["curve"].copy()
    flat[:, :, 1] -= heights[:, None]
    flat = flat.reshape(len(flat), -1)
    shares = share_of(entries, display)
    return _Compared(curves, flat, np.sum(flat**2, axis=1), heights, entries["lowest_eigenvalue"] / STIFFEST, shares)


def nearest_curves(display: Display, drawn: Array, count: int, margin: float, part: float) -> list[NearCurve]:
    """At most so many curves near a `drawn (POINTS, 2)` one [m], the nearest first, that keep a margin of stability.

    They ask for no more than a `part` of what rod and motors can give, and are as far from each other, on average, as
    the nearest is from what was drawn. Points are compared that are as far along either curve.
    """
    known = _compared(display)
    if known is None:
        return []
    height = float(drawn[:, 1].mean())
    wanted = (drawn - np.array([0.0, height])).ravel()
    gaps = np.maximum(known.squares - 2.0 * known.flat @ wanted + wanted @ wanted, 0.0)
    gaps[(known.margins < margin) | (known.shares > part)] = np.inf
    nearest = np.argsort(gaps, kind="stable")[:LOOKED_AT]
    chosen: list[int] = []
    for place in nearest[np.isfinite(gaps[nearest])].tolist():
        apart = np.sum((known.flat[chosen] - known.flat[place]) ** 2, axis=1)
        if (apart > gaps[nearest[0]]).all():
            chosen.append(place)
        if len(chosen) == count:
            break
    return [_near(known, place, height) for place in chosen]


def _near(known: _Compared, place: int, height: float) -> NearCurve:
    """A curve whose mean height is that of what was drawn."""
    row = known.curves.entries[place]
    pose = Pose(*known.curves.where[place].tolist())
    return NearCurve(pose, height - float(known.heights[place]), row["angles"].copy(), row["multipliers"].copy())
