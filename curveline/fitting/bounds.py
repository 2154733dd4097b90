"""How near to a drawing a rod can come at the very best: bounds that hold whatever its nodes do.

The rod of a segment is no longer than a limit L, so that each of its points is no farther than L from its two pivots
together; pivots stand on their rails within limits. A place whose least such sum exceeds L by 2 d is at least d away
from any point of the rod.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from curveline.fitting.measured import in_frame, mean_square
from curveline.fitting.row import Array, Wanted

STRETCH = 1e-3
"""By which a rod may be longer than what was fed of it, as a part: more than its motors can pull."""


class Bounds(NamedTuple):
    """Distances [m] that no shape of a display falls below: of the root mean square, and of the largest."""

    rms: float  # of the root mean square distance
    max: float  # of the largest distance


def bounds_of(wanted: Wanted) -> Bounds:
    """What is known of a drawing; zeros where nothing is."""
    drawn = in_frame(wanted.fine, wanted.display.span)
    beyond = [_beyond(wanted, piece) for piece in drawn]
    squares = [mean_square(piece, off) for piece, off in zip(wanted.fine, beyond, strict=True)]
    rms = math.sqrt(0.5 * float(np.mean(squares)))
    farthest = max(float(np.max(each)) for each in beyond)
    return Bounds(rms, max(rms, farthest, _off_rails(wanted)))


def _beyond(wanted: Wanted, places: Array) -> Array:
    """At least how far some places (k, 2) [m], in the display's frame, are from any rod."""
    display, segments = wanted.display, len(wanted.pieces)
    longest = min(display.limits.length.high, display.rod.total_length) * (1.0 + STRETCH)
    away = np.array([_from_rail(wanted, node, places) for node in range(segments + 1)])
    beyond: Array = np.maximum(0.5 * ((away[1:] + away[:-1]).min(axis=0) - longest), 0.0)
    return beyond


def _from_rail(wanted: Wanted, node: int, places: Array) -> Array:
    """How far places (k, 2) are from where a pivot can stand."""
    height = wanted.display.limits.height
    rise = places[:, 1] - np.clip(places[:, 1], height.low, height.high)
    away: Array = np.hypot(places[:, 0] - node * wanted.display.span, rise)
    return away


def _off_rails(wanted: Wanted) -> float:
    """The largest distance from where a pivot can stand to the nearest place of the drawing; a pivot is on the rod."""
    found, height = 0.0, wanted.display.limits.height
    whole = np.vstack(in_frame(wanted.fine, wanted.display.span))
    for node in range(wanted.nodes):
        x = node * wanted.display.span
        found = max(found, _between(np.array([x, height.low]), np.array([x, height.high]), whole))
    return found


def _between(one: Array, other: Array, points: Array) -> float:
    """The distance between a straight line and a polyline that do not cross; 0 where they do."""
    x, low, high = float(one[0]), float(one[1]), float(other[1])
    before, after = points[:-1], points[1:]
    crosses = (before[:, 0] - x) * (after[:, 0] - x) <= 0.0
    run = np.where(after[:, 0] == before[:, 0], 1.0, after[:, 0] - before[:, 0])
    share = np.clip((x - before[:, 0]) / run, 0.0, 1.0)
    at = before[:, 1] + share * (after[:, 1] - before[:, 1])
    if np.any(crosses & (at >= low) & (at <= high)):
        return 0.0
    ends = [float(np.min(_from_pieces(before, after, end))) for end in (one, other)]
    sides = np.hypot(points[:, 0] - x, points[:, 1] - np.clip(points[:, 1], low, high))
    return min(*ends, float(np.min(sides)))


def _from_pieces(before: Array, after: Array, place: Array) -> Array:
    """How far a place is from straight pieces (k, 2) to (k, 2)."""
    way = after - before
    square = np.maximum((way**2).sum(axis=1), 1e-30)
    share = np.clip(((place - before) * way).sum(axis=1) / square, 0.0, 1.0)
    off: Array = np.hypot(*(before + share[:, None] * way - place).T)
    return off
