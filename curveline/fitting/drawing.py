"""A drawn curve: points in m, x along the row of nodes from the first rail on, y upwards; cut at the rails of a display."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from curveline.errors import InvalidInput
from curveline.scene import Display
from curveline.units import to_mm

Array = npt.NDArray[np.float64]

MOST_POINTS = 1_000_000
LARGEST = 1e3
"""No display is larger [m]."""
PER_SEGMENT = 60
"""Points of a drawing per segment, equally spaced, with which it is held against the rod."""
SHORT = 1e-3
"""Part of a span by which a drawing may end before the first or the last rail: it goes on straight."""


@dataclass(frozen=True, eq=False)
class Drawing:
    """A curve through `points (k, 2)` [m], in the order in which it is drawn, by the `name` of where it comes from.

    InvalidInput for what is no curve: fewer than two points, numbers that are none, all in one place.
    """

    points: Array
    name: str = "drawing"

    def __post_init__(self) -> None:
        try:
            points = np.asarray(self.points, dtype=np.float64)
        except (TypeError, ValueError) as error:
            raise InvalidInput(f"{self.name}: these points are no numbers: {error}", "give x and y of each") from None
        if points.ndim != 2 or points.shape[1] != 2 or not 2 <= points.shape[0] <= MOST_POINTS:
            hint = f"give x and y of 2 to {MOST_POINTS} points"
            raise InvalidInput(f"{self.name}: a curve is an array (k, 2), not {points.shape}", hint)
        bad = np.flatnonzero(~(np.abs(points) <= LARGEST).all(axis=1))
        if bad.size:
            x, y = points[bad[0]]
            hint = "coordinates are metres here" if math.isfinite(x + y) else "leave out points that are not known"
            raise InvalidInput(f"{self.name}: point {bad[0] + 1} is at {x:g}, {y:g} m, where no display is", hint)
        apart = np.concatenate(([True], np.any(np.diff(points, axis=0) != 0.0, axis=1)))
        points = points[apart]
        if points.shape[0] < 2:
            raise InvalidInput(f"{self.name}: all points are in one place", "a curve has two ends")
        if points[-1, 0] < points[0, 0]:
            points = points[::-1]
        points = np.ascontiguousarray(points)
        points.flags.writeable = False
        object.__setattr__(self, "points", points)


def cut_at_rails(drawing: Drawing, display: Display) -> tuple[Array, ...]:
    """The pieces (PER_SEGMENT, 2) [m] of a drawing between neighbouring rails, each seen from the foot of its left one.

    InvalidInput for a drawing that is narrower than the display, or that crosses a rail more than once.
    """
    segments, span = display.node_count - 1, display.span
    points = _lengthened(drawing, display)
    crossings = [_crossing(drawing, points, node * span, node + 1) for node in range(segments + 1)]
    pieces = []
    for segment, (begin, end) in enumerate(zip(crossings, crossings[1:], strict=False)):
        piece = _resampled(_between(points, begin, end))
        piece[:, 0] -= segment * span
        pieces.append(piece)
    return tuple(pieces)


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


def _resampled(points: Array) -> Array:
    """A curve at `PER_SEGMENT` points, equally spaced along it."""
    along = np.concatenate(([0.0], np.cumsum(np.hypot(*np.diff(points, axis=0).T))))
    at = np.linspace(0.0, along[-1], PER_SEGMENT)
    return np.column_stack([np.interp(at, along, column) for column in points.T])
