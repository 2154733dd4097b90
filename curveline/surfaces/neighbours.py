"""How neighbouring lines stand to each other: the step between their curves, beside that which the surface has."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from curveline.drawings.drawing import Array
from curveline.fitting.fit import Fit
from curveline.surfaces.envelope import upper_envelope

PLACES = 401
"""Across the display, at which neighbours are held against each other."""


class Neighbours(NamedTuple):
    """A line, by its number, and the one behind it: how far the step in height between them is off the surface's."""

    line: int  # from 1
    rms: float  # [m]
    max: float  # [m]
    x: float  # [m], where it is largest


def compared(line: int, front: Fit, back: Fit) -> Neighbours:
    """How the step from a line to the one behind it differs from that which was drawn, in height at the same x."""
    display = front.scene.display
    x = np.linspace(0.0, display.span * (display.node_count - 1), PLACES)
    error = (_heights(back.curves, x) - _heights(front.curves, x)) - (
        _heights(back.drawn, x) - _heights(front.drawn, x)
    )
    place = int(np.argmax(np.abs(error)))
    return Neighbours(line, math.sqrt(float(np.mean(error**2))), float(np.abs(error[place])), float(x[place]))


def _heights(curves: Sequence[Array], x: Array) -> Array:
    """The height of what is highest of some curves at places x [m]."""
    parts = upper_envelope(np.vstack([np.hstack([curve[:-1], curve[1:]]) for curve in curves]))
    points = np.vstack(parts)
    heights: Array = np.interp(x, points[:, 0], points[:, 1])
    return heights
