"""A way: everything that a scene can change, changing at once along a straight line from one setting to another."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from curveline.rod._jit import njit
from curveline.rod.problem import Array, Pose, cut, make_problem, released, scale_rod, shares


class ControlPath(NamedTuple):
    """A straight path in all that nodes impose and loads push; the fraction 0 is its begin, 1 its end.

    Dead loads act at the sorted fractions `at (m,)` of the length from pivot to pivot, `before (m, 2)` [N] at the begin
    and `after (m, 2)` [N] at the end.
    """

    begin: Pose
    end: Pose
    at: Array
    before: Array
    after: Array


@njit
def straight_path(begin, end):
    """The way from one pose to another of a rod without loads."""
    return ControlPath(begin, end, np.zeros(0), np.zeros((0, 2)), np.zeros((0, 2)))


@njit
def loading(pose, at, before, after):
    """The way on which the nodes stay while loads at `at (m,)` change from `before (m, 2)` to `after (m, 2)` [N]."""
    return ControlPath(pose, pose, at, before, after)


@njit
def between(begin, end, fraction):
    """The pose on the straight path between two poses."""
    return Pose(
        begin.x + fraction * (end.x - begin.x),
        begin.y + fraction * (end.y - begin.y),
        begin.start + fraction * (end.start - begin.start),
        begin.end + fraction * (end.end - begin.end),
        begin.length + fraction * (end.length - begin.length),
    )


@njit
def pose_at(way, fraction):
    """The pose at a fraction of the way."""
    return between(way.begin, way.end, fraction)


@njit
def loads_at(way, fraction):
    """The loads at a fraction of the way, (m, 3): fraction of the length, force [N]."""
    loads = np.empty((way.at.size, 3))
    for i in range(way.at.size):
        loads[i, 0] = way.at[i]
        for axis in range(2):
            loads[i, 1 + axis] = way.before[i, axis] + fraction * (way.after[i, axis] - way.before[i, axis])
    return loads


@njit
def rod_at(way, bearing, fraction):
    """The free rod at a fraction of the way, in units of its length there and EI."""
    return scale_rod(pose_at(way, fraction), bearing, loads_at(way, fraction))


@njit
def counts_along(way, bearing, n):
    """Edges (m+1,) between the loads, n in all: they stay the same on all of the way while their lengths change."""
    return shares(rod_at(way, bearing, 0.0).at, n)


@njit
def problem_at(way, bearing, fraction, counts):
    """The rod at a fraction of the way, cut into `counts (m+1,)` edges between its loads."""
    rod = rod_at(way, bearing, fraction)
    return released(make_problem(rod, cut(rod.at, counts)))


@njit
def is_still(way):
    """True if nothing changes along the way."""
    if way.begin != way.end:
        return False
    for i in range(way.at.size):
        if way.before[i, 0] != way.after[i, 0] or way.before[i, 1] != way.after[i, 1]:
            return False
    return True
