"""A drawn curve: points in m, x along the row of nodes, y upwards, with what was understood of where it comes from."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from curveline.errors import InvalidInput

Array = npt.NDArray[np.float64]

MOST_POINTS = 1_000_000
LARGEST = 1e3
"""No display is larger [m]."""


@dataclass(frozen=True, eq=False)
class Drawing:
    """A curve through `points (k, 2)` [m], in the order in which it is drawn, by the `name` of where it comes from.

    `understood` says how its file was read, and how it was placed: with which scale above all. InvalidInput for what
    is no curve: fewer than two points, numbers that are none, all in one place.
    """

    points: Array
    name: str = "drawing"
    understood: str = ""

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
