"""Kernels that tell whether a curve crosses itself or its own tails, and how near to itself it comes."""

from __future__ import annotations

import numpy as np

from curveline.rod._jit import njit

APART = 0.2
"""Parts of a curve nearer than this fraction of its length along it are neighbours, not a contact."""


@njit
def _cross(ax, ay, bx, by, cx, cy, dx, dy):
    """True if the straight pieces a-b and c-d cross each other inside."""
    first = (bx - ax) * (cy - ay) - (by - ay) * (cx - ax)
    second = (bx - ax) * (dy - ay) - (by - ay) * (dx - ax)
    third = (dx - cx) * (ay - cy) - (dy - cy) * (ax - cx)
    fourth = (dx - cx) * (by - cy) - (dy - cy) * (bx - cx)
    return first * second < 0.0 and third * fourth < 0.0


@njit
def crosses_itself(table):
    """True if the polygon through the vertices `table (m+1, 4)` crosses itself."""
    m = table.shape[0] - 1
    for i in range(m - 2):
        for j in range(i + 2, m):
            if _cross(
                table[i, 0], table[i, 1], table[i + 1, 0], table[i + 1, 1],
                table[j, 0], table[j, 1], table[j + 1, 0], table[j + 1, 1],
            ):  # fmt: skip
                return True
    return False


@njit
def crosses_tails(table, tail):
    """True if the polygon crosses the straight pieces of length `tail` that lead away from its ends backwards."""
    m = table.shape[0] - 1
    for end in range(2):
        at = 0 if end == 0 else m
        away = -tail if end == 0 else tail
        tip_x = table[at, 0] + away * np.cos(table[at, 2])
        tip_y = table[at, 1] + away * np.sin(table[at, 2])
        for j in range(m):
            # The edge at the tail's own root only touches it.
            if (end == 0 and j == 0) or (end == 1 and j == m - 1):
                continue
            if _cross(
                table[at, 0], table[at, 1], tip_x, tip_y,
                table[j, 0], table[j, 1], table[j + 1, 0], table[j + 1, 1],
            ):  # fmt: skip
                return True
    return False


@njit
def clearance(table):
    """Smallest distance between vertices that are at least `APART` of the length from each other along the curve."""
    m = table.shape[0] - 1
    apart = max(2, int(APART * m))
    nearest = np.inf
    for i in range(m + 1 - apart):
        for j in range(i + apart, m + 1):
            nearest = min(nearest, np.hypot(table[i, 0] - table[j, 0], table[i, 1] - table[j, 1]))
    return nearest
