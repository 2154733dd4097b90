"""A drawing cut at the rails of a display, where its nodes are to hold the rod."""

from __future__ import annotations

import math
from collections.abc import Iterator
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from curveline.drawings.drawing import Array, Drawing
from curveline.errors import InvalidInput
from curveline.scene import Display
from curveline.units import to_mm

PER_SEGMENT = 60
"""Points of a drawing per segment, equally spaced, with which it is held against the rod."""
FINE = 600
"""At least so many with which its distance is measured, its corners among them."""
SHORT = 1e-3
"""Part of a span by which a drawing may end before the first or the last rail: it goes on straight."""


class Cut(NamedTuple):
    """The pieces of a drawing between neighbouring rails, each seen from the foot of its left one [m]."""

    pieces: tuple[Array, ...]  # (PER_SEGMENT, 2), equally spaced, to be fitted
    fine: tuple[Array, ...]  # (k, 2) with all its corners, to be measured


def cut_at_rails(drawing: Drawing, display: Display) -> Cut:
    """A drawing cut at the rails of a display.

    InvalidInput for a drawing that is narrower than the display, or that crosses a rail more than once.
    """
    segments, span = display.node_count - 1, display.span
    points = _lengthened(drawing, display)
    crossings = [_crossing(drawing, points, node * span, node + 1) for node in range(segments + 1)]
    pieces, fine = [], []
    for segment, (begin, end) in enumerate(pairwise(crossings)):
        piece = _between(points, begin, end) - np.array([segment * span, 0.0])
        pieces.append(resampled(piece, PER_SEGMENT))
        fine.append(_subdivided(piece) if len(piece) < FINE else resampled(piece, FINE))
    return Cut(tuple(pieces), tuple(fine))


def _lengthened(drawing: Drawing, display: Display) -> Array:
    """The points of a drawing, which goes on straight for what it lacks at either end; InvalidInput if that is much."""
    whole, points = display.span * (display.node_count - 1), drawing.points
    slack = SHORT * display.span
    left, right = points[0, 0], points[-1, 0]
    if left > slack or right < whole - slack:
        raise InvalidInput(
            f"{drawing.name}: it reaches from {to_mm(left):.4g} to {to_mm(right):.4g} mm, and the rails of "
            f"{display.name} stand from 0 to {to_mm(whole):.4g} mm",
            "draw it as wide as the display, its left rail at x = 0; or name another display",
        )
    ends = []
    if left > 0.0:
        ends.append((0, np.array([0.0, points[0, 1]])))
    if right < whole:
        ends.append((len(points), np.array([whole, points[-1, 1]])))
    for place, end in reversed(ends):
        points = np.insert(points, place, end, axis=0)
    return points


def _crossing(drawing: Drawing, points: Array, x: float, node: int) -> float:
    """Where a drawing crosses the rail at `x`, as a number of points with a fraction; InvalidInput if it does twice."""
    side = points[:, 0] - x
    found = sorted(_zeros(side))
    # A drawing that goes on beyond the outer rails crosses them, and one that ends there touches them.
    if len(found) != 1:
        times = "never" if not found else f"{len(found)} times"
        raise InvalidInput(
            f"{drawing.name}: it crosses the rail of node {node}, at {to_mm(x):.4g} mm, {times}",
            "a node holds the rod once: draw one line from left to right",
        )
    return found[0]


def _zeros(side: Array) -> Iterator[float]:
    before = 0.0
    for place, here in enumerate(side.tolist()):
        if here == 0.0:
            yield float(place)
        elif place > 0 and before * here < 0.0:
            yield place - 1 + before / (before - here)
        before = here


def _between(points: Array, begin: float, end: float) -> Array:
    """The points from one place of a curve to another, both ends among them."""
    inner = points[math.floor(begin) + 1 : math.ceil(end)]
    ends = [np.array([np.interp(at, np.arange(len(points)), column) for column in points.T]) for at in (begin, end)]
    return np.vstack([ends[0], inner, ends[1]])


def _along(points: Array) -> Array:
    """The lengths of a polyline up to its points [m]."""
    lengths: Array = np.concatenate(([0.0], np.cumsum(np.hypot(*np.diff(points, axis=0).T))))
    return lengths


def resampled(points: Array, count: int) -> Array:
    """A polyline at so many points, equally spaced along it."""
    along = _along(points)
    at = np.linspace(0.0, along[-1], count)
    return np.column_stack([np.interp(at, along, column) for column in points.T])


def _subdivided(points: Array) -> Array:
    """A polyline with further points between its own, which are never farther apart than in `FINE` equal parts."""
    along = _along(points)
    at = np.union1d(along, np.linspace(0.0, along[-1], FINE))
    return np.column_stack([np.interp(at, along, column) for column in points.T])
