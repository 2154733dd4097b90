"""Curves of drawing programs as points, so many that the lines between these are nowhere farther off than they may."""

from __future__ import annotations

import math

import numpy as np

from curveline.drawings.drawing import Array
from curveline.drawings.sketch import OF_WIDTH

MOST = 50_000
"""Points of one curve."""


def flat_bezier(control: Array, error: float) -> Array:
    """Points (k, 2) of a Bezier curve with `control (3 or 4, 2)` points; `error` 0 is a part of its size.

    The chord of a part that takes 1/n of the parameter is off by at most max|B''| / (8 n^2), and B'' lies within the
    second differences of the control points.
    """
    degree = len(control) - 1
    bend = degree * (degree - 1) * float(np.max(np.hypot(*np.diff(control, 2, axis=0).T)))
    t = np.linspace(0.0, 1.0, _count(bend / 8.0, _allowed(control, error)) + 1)[:, None]
    points: Array = control[:1] * (1.0 - t) ** degree
    for k in range(1, degree + 1):
        points = points + math.comb(degree, k) * control[k] * t**k * (1.0 - t) ** (degree - k)
    points[-1] = control[-1]
    return points


def flat_conic(center: Array, axes: Array, turn: tuple[float, float], error: float) -> Array:
    """Points (k, n) of a part of an ellipse: center + cos(t) axes[0] + sin(t) axes[1], t from one angle to another."""
    begin, end = turn
    size = float(np.linalg.norm(axes, axis=1).sum())
    # Of a whole turn the leftmost and the rightmost place are among the points: an outline is parted there.
    count = 4 * math.ceil(_count((end - begin) ** 2 * size / 8.0, error or OF_WIDTH * size) / 4)
    t = np.linspace(begin, end, count + 1)
    points: Array = center + np.outer(np.cos(t), axes[0]) + np.outer(np.sin(t), axes[1])
    return points


def _allowed(control: Array, error: float) -> float:
    return error or OF_WIDTH * float(np.max(np.ptp(control, axis=0)))


def _count(off: float, allowed: float) -> int:
    """Into how many parts a curve is cut that is off its chord by `off`, if that goes with the square of the parts."""
    if off <= allowed or not allowed > 0.0:
        return 1
    return min(MOST, math.ceil(math.sqrt(off / allowed)))
