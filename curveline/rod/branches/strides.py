"""Long strides: several ways from pose to pose at once, where the rod turns little on them and is far from any fold.

Near folds, and near where it leaves its plane, a state is led from pose to pose, in steps as short as that takes.
"""

from __future__ import annotations

import numpy as np

from curveline.kernels.forms import Matrix, Vector
from curveline.kernels.kernel import njit, shipped
from curveline.rod.branches.continuation import (
    LARGEST_MOVE,
    SHALLOW,
    STIFFEST,
    step_with,
    stiffness_outside,
    travel,
    try_step,
)
from curveline.rod.branches.control_path import ControlPath, counts_along, problem_at, straight_path
from curveline.rod.planar.modes import modes_below, second_variation
from curveline.rod.planar.newton import Effort
from curveline.rod.problem import Bearing, copy_into, pose_at_row

STRIDE = 0.2
"""Of the way on which a rod snaps through, the part that is taken at once."""
CALM = 0.6 * STIFFEST
"""Lowest eigenvalue in the plane [EI/L^2] of a state that is calm. It falls with the square root of what is left of the
way, so that such a state has a sixth left: two have more than a stride between them."""
MOST_AT_ONCE = 16
LEAST_EXCESS = 1e-6
"""Over the length: of rods that are straight."""
PASS = Effort(turn=0.2, close=1e-4, iterations=6)
"""Of a stride: on the way an error of 1e-8 is none, and where it takes more iterations the stride is too long."""


@njit
def way_between(poses, begin, end):
    """The straight path from one of the `poses (m, 5)` to another."""
    return straight_path(pose_at_row(poses[begin]), pose_at_row(poses[end]))


@njit
def way_gone(poses, bearing, k):
    """By what part of the way on which a rod snaps through its clamps go from the pose before `k` to that.

    A rod of length L with an excess e over its chord turns by some a = 2 sqrt(e / L), and to snap through takes clamps
    that turn by about as much (Radisson and Kanso 2023): of that the turns of clamps and chord are parts, and of e what
    is fed.
    """
    before, here = poses[k - 1], poses[k]
    length = here[4] - bearing.clamp
    excess = max(length - np.hypot(here[0] - bearing.clamp, here[1]), LEAST_EXCESS * length)
    turned = max(abs(here[2] - before[2]), abs(here[3] - before[3])) + abs(here[1] - before[1]) / here[0]
    return turned / (2.0 * np.sqrt(excess / length)) + 0.5 * abs(here[4] - before[4]) / excess


@njit
def strides_ahead(poses, bearing, begin, most):
    """How many ways from the pose `begin` on, `most` or fewer, can be taken at once."""
    went = 0.0
    for k in range(begin + 1, min(begin + most, poses.shape[0] - 1) + 1):
        went += way_gone(poses, bearing, k)
        if went > STRIDE:
            return k - 1 - begin
    return min(most, poses.shape[0] - 1 - begin)


@njit
def is_calm(path, bearing, state):
    """True if a `state`, problem, angles and multipliers, at the end of a path is far from losing its stability."""
    free, phi, multipliers = state
    if modes_below(free, second_variation(free, phi, multipliers), CALM) > 0:
        return False
    return stiffness_outside(path, bearing, 1.0, state, SHALLOW) >= SHALLOW


@shipped(Matrix, Bearing, Vector, Vector)
def pass_through(poses, bearing, phi, multipliers):
    """Follow the stable state `phi (n,)`, `multipliers (2,)` through `poses (m, 5)` from the first on.

    Returns how many of the ways between them it passed to the end, all or those before it was lost, the state at the
    end of these, and whether it was lost because the rod left its plane. Several ways on which the rod turns little are
    taken at once where the state is far from losing its stability before and after.
    """
    last = poses.shape[0] - 1
    counts = counts_along(way_between(poses, 0, 0), bearing, phi.size)
    place, most, rests = 0, MOST_AT_ONCE, False
    while place < last:
        ahead = strides_ahead(poses, bearing, place, most) if rests else 0
        if ahead > 0:
            way = way_between(poses, place, place + ahead)
            free = problem_at(way, bearing, 1.0, counts)
            found, angles, forces = step_with(free, (phi, multipliers), LARGEST_MOVE, PASS)
            if found and is_calm(way, bearing, (free, angles, forces)):
                phi, multipliers, place, most = angles, forces, place + ahead, MOST_AT_ONCE
            else:
                most = ahead // 2
        else:
            way = way_between(poses, place, place + 1)
            share, angles, forces, leaves = travel(way, bearing, phi, multipliers)
            if share < 1.0:
                return place, phi, multipliers, leaves
            phi, multipliers, place, most = angles, forces, place + 1, min(most + 1, MOST_AT_ONCE)
            rests = counts.sum() == phi.size and is_calm(
                way, bearing, (problem_at(way, bearing, 1.0, counts), phi, multipliers)
            )
    return last, phi, multipliers, False


@shipped(ControlPath, Bearing, Matrix, Matrix)
def led_along(path, bearing, shapes, forces):
    """Lead states `shapes (c, n)`, `forces (c, 2)` along a path of a rod without loads.

    Returns which of them arrive (c,), and their angles (c, n) and multipliers (c, 2) there.
    """
    arrive = np.zeros(shapes.shape[0], dtype=np.bool_)
    out, held = shapes.copy(), forces.copy()
    for c in range(arrive.size):
        share, angles, pull, _ = travel(path, bearing, shapes[c].copy(), forces[c].copy())
        arrive[c] = share == 1.0
        copy_into(out[c], angles)
        copy_into(held[c], pull)
    return arrive, out, held


@shipped(ControlPath, Bearing, Vector, Vector, int)
def looks_kept(path, bearing, phi, multipliers, looks):
    """At how many of the `looks` at a path, one after the other, the state `phi (n,)`, `multipliers (2,)` still is.

    And its angles and multipliers at the last of these.
    """
    counts = counts_along(path, bearing, phi.size)
    for look in range(looks):
        free = problem_at(path, bearing, (look + 1) / looks, counts)
        found, angles, forces = try_step(free, phi, multipliers, LARGEST_MOVE)
        if not found:
            return look, phi, multipliers
        phi, multipliers = angles, forces
    return looks, phi, multipliers
