"""Poses of a segment that are spread evenly over what the limits of a display allow."""

from __future__ import annotations

import numpy as np

from curveline.atlases.entries import Array
from curveline.rod.clamped_rod import ClampedRod
from curveline.rod.states.slack import STRAIGHT
from curveline.scene import Display

NUMBERS = 4
"""That nodes can change of a pose: the rise of the right pivot over the left one, both angles, the length."""
BASES = 2, 3, 5, 7
LEAST_EXCESS = STRAIGHT
"""Of the rod between the clamps over the line between them, as a part of that: what is less is straight."""


def longest(display: Display) -> float:
    """The most rod that can lie between two nodes, the others taking as little as they may [m]."""
    others = (display.node_count - 2) * display.limits.length.low
    return min(display.limits.length.high, display.rod.total_length - display.clamp - others)


def spread(count: int) -> Array:
    """Points (count, NUMBERS) of the unit cube, evenly spread; the first ones of more are the same.

    The digits of 1, 2, 3, ... mirrored at the point, in the base of a prime for each number (Halton, Numer. Math. 2,
    84, 1960).
    """
    points = np.zeros((count, NUMBERS))
    for column, base in enumerate(BASES):
        rest, part = np.arange(1, count + 1), 1.0
        while rest.any():
            rest, digit = np.divmod(rest, base)
            part /= base
            points[:, column] += part * digit
    return points


def sampled_poses(display: Display, rod: ClampedRod, count: int) -> Array:
    """Poses (m, 5) of a segment over the limits of a display: of `count` that are spread, those that have a curve.

    The root of the rod to spare is spread evenly, as a rod that is nearly straight answers to that.
    """
    limits, points = display.limits, spread(count)
    reach = limits.height.high - limits.height.low
    rise = reach * (2.0 * points[:, 0] - 1.0)
    start, end = (limits.angle.low + points[:, 1:3] * (limits.angle.high - limits.angle.low)).T
    half = 0.5 * rod.bearing.clamp
    x = display.span - half * (np.cos(start) + np.cos(end))
    y = rise - half * (np.sin(start) + np.sin(end))
    least = np.maximum(limits.length.low, np.hypot(x, y) * (1.0 + LEAST_EXCESS) + rod.bearing.clamp)
    length = least + points[:, 3] ** 2 * (longest(display) - least)
    poses = np.column_stack([np.full(count, display.span), rise, start, end, length])
    return np.ascontiguousarray(poses[least < longest(display)])
