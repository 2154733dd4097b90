"""A control path: all that a scene can change, changing at once along a straight line from one setting to another."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from curveline.kernels.forms import Counts, Matrix, Vector
from curveline.kernels.kernel import njit, shipped
from curveline.rod.problem import Bearing, Pose, cut, make_problem, scale_rod, shares


class ControlPath(NamedTuple):
    """A straight path in all that nodes impose and loads push; the fraction 0 is its begin, 1 its end.

    Dead loads act at the sorted fractions `at (m,)` of the length from pivot to pivot, `before (m, 2)` [N] at the begin
    and `after (m, 2)` [N] at the end.
    """

    begin: Pose
    end: Pose
    at: Vector
    before: Matrix
    after: Matrix


@shipped(Pose, Pose)
def straight_path(begin, end):
    """The path from one pose to another of a rod without loads."""
    return ControlPath(begin, end, np.zeros(0), np.zeros((0, 2)), np.zeros((0, 2)))


@shipped(Pose, Vector, Matrix, Matrix)
def loading(pose, at, before, after):
    """The path on which the nodes stay while loads at `at (m,)` change from `before (m, 2)` to `after (m, 2)` [N]."""
    return ControlPath(pose, pose, at, before, after)


@shipped(Pose, Pose, float)
def between(begin, end, fraction):
    """The pose on the straight path between two poses."""
    return Pose(
        begin.x + fraction * (end.x - begin.x),
        begin.y + fraction * (end.y - begin.y),
        begin.start + fraction * (end.start - begin.start),
        begin.end + fraction * (end.end - begin.end),
        begin.length + fraction * (end.length - begin.length),
        begin.begin + fraction * (end.begin - begin.begin),
    )


@njit
def pose_at(path, fraction):
    """The pose at a fraction of the path."""
    return between(path.begin, path.end, fraction)


@njit
def forces_at(path, fraction):
    """The loads at a fraction of the path, (m, 2) [N]."""
    forces = np.empty((path.at.size, 2))
    for i in range(path.at.size):
        for axis in range(2):
            forces[i, axis] = path.before[i, axis] + fraction * (path.after[i, axis] - path.before[i, axis])
    return forces


@shipped(ControlPath, Bearing, float)
def rod_at(path, bearing, fraction):
    """The free rod at a fraction of the path, in units of its length there and EI."""
    return scale_rod(pose_at(path, fraction), bearing, path.at, forces_at(path, fraction))


@shipped(ControlPath, Bearing, int)
def counts_along(path, bearing, n):
    """Edges (m+1,) between the loads, n in all: they stay the same on all of the path while their lengths change."""
    return shares(rod_at(path, bearing, 0.0).at, n)


@shipped(ControlPath, Bearing, float, Counts)
def problem_at(path, bearing, fraction, counts):
    """The rod at a fraction of the path, cut into `counts (m+1,)` edges between its loads."""
    rod = rod_at(path, bearing, fraction)
    return make_problem(rod, cut(rod.at, counts))


@njit
def is_still(path):
    """True if nothing changes along the path."""
    if path.begin != path.end:
        return False
    for i in range(path.at.size):
        if path.before[i, 0] != path.after[i, 0] or path.before[i, 1] != path.after[i, 1]:
            return False
    return True
