"""Kernels that lay a rod along a drawn curve: a state near another, how its points move, how far off they are."""

from __future__ import annotations

import numpy as np

from curveline.kernels.forms import Matrix, Stack, Vector
from curveline.kernels.kernel import leaf, njit, shipped
from curveline.rod.branches.continuation import node_loads
from curveline.rod.branches.control_path import counts_along, problem_at, straight_path
from curveline.rod.planar.clamps import link
from curveline.rod.planar.modes import around, from_zero, lowest_eigenvalue
from curveline.rod.planar.newton import Effort, newton, newton_step
from curveline.rod.planar.richardson import vertex_table
from curveline.rod.problem import STEP, Bearing, Pose, largest_change

NEAR = Effort(turn=0.3, close=1e-7, iterations=20)
MOST_TURN = 0.5
"""An edge that turns by more than this [rad] belongs to another state."""
LITTLE = 1e-5
"""By how much each number of a pose is changed, in m or rad, to see what moves: a step of Newton's is exact to that."""
PRECISE = 1e-9
"""Of eigenvalues whose change is looked at."""
NUMBERS = 4
"""Of a pose that nodes can change: the height of the right pivot, both angles, the length."""
LOWEST, SHARPEST, LOADS, ASKED = 0, 1, 2, 8
"""What a state asks: its lowest eigenvalue [EI/L^2], its largest curvature beyond the natural one [1/m], and six loads
of the nodes, see `continuation.Branch`; and how many numbers that are."""


@leaf
def changed(pose, number, by):
    """The pose with another one of its `NUMBERS`."""
    return Pose(
        pose.x,
        pose.y + (by if number == 0 else 0.0),
        pose.start + (by if number == 1 else 0.0),
        pose.end + (by if number == 2 else 0.0),
        pose.length + (by if number == 3 else 0.0),
        pose.begin,
    )


@njit
def points_of(pose, bearing, state):
    """Positions (n+3, 2) [m]: left pivot, every vertex of the free rod, right pivot, seen from the left one.

    The `state` is a problem with its angles (n,) and multipliers (2,).
    """
    free, phi, multipliers = state
    n = phi.size
    length, half = pose.length - bearing.clamp, 0.5 * bearing.clamp
    table = vertex_table(free, phi, multipliers)
    angle, _ = link(free, phi, multipliers, 0)
    out = np.zeros((n + 3, 2))
    for j in range(n + 1):
        out[j + 1, 0] = half * np.cos(angle) + length * table[j, 0]
        out[j + 1, 1] = half * np.sin(angle) + length * table[j, 1]
    out[n + 2, 0], out[n + 2, 1] = pose.x, pose.y
    return out


@njit
def asks_of(pose, bearing, state, guess):
    """What a state asks, (ASKED,), its lowest eigenvalue sought from a guess."""
    free, phi, multipliers = state
    asks = np.empty(ASKED)
    asks[LOWEST] = lowest_eigenvalue(free, phi, multipliers, guess, PRECISE)
    asks[SHARPEST], loads = node_loads(straight_path(pose, pose), 0.0, bearing, free, phi, multipliers)
    for i in range(loads.size):
        asks[LOADS + i] = loads[i]
    return asks


@shipped(Pose, Bearing, Vector, Vector)
def laid(pose, bearing, phi, multipliers):
    """The stable state at a pose near one of angles `phi (n,)` and `multipliers (2,)`, both overwritten; False if none.

    Also its points (n+3, 2) [m], see `points_of`, and what it asks (ASKED,); and the slopes of both by the numbers of
    the pose, (NUMBERS, n+3, 2) and (NUMBERS, ASKED).
    """
    n = phi.size
    counts = counts_along(straight_path(pose, pose), bearing, n)
    free = problem_at(straight_path(pose, pose), bearing, 0.0, counts)
    before = phi.copy()
    iterations, unstable = newton(free, phi, multipliers, NEAR)
    slopes, rates = np.zeros((NUMBERS, n + 3, 2)), np.zeros((NUMBERS, ASKED))
    if iterations < 0 or unstable != 0 or largest_change(phi, before) > MOST_TURN:
        return False, np.zeros((n + 3, 2)), np.zeros(ASKED), slopes, rates
    points = points_of(pose, bearing, (free, phi, multipliers))
    # Sought twice, so that it is as exact as those that it is subtracted from.
    lowest = lowest_eigenvalue(free, phi, multipliers, from_zero(), PRECISE)
    asks = asks_of(pose, bearing, (free, phi, multipliers), around(lowest))
    angles, force = phi.copy(), multipliers.copy()
    for number in range(NUMBERS):
        other = changed(pose, number, LITTLE)
        there = problem_at(straight_path(other, other), bearing, 0.0, counts)
        _, _, change = newton_step(there, phi, multipliers, 0.0)
        for j in range(n):
            angles[j] = phi[j] + there.room[STEP, j]
        for a in range(2):
            force[a] = multipliers[a] + change[a]
        moved = points_of(other, bearing, (there, angles, force))
        for i in range(n + 3):
            slopes[number, i, 0] = (moved[i, 0] - points[i, 0]) / LITTLE
            slopes[number, i, 1] = (moved[i, 1] - points[i, 1]) / LITTLE
        asked = asks_of(other, bearing, (there, angles, force), around(asks[LOWEST]))
        for i in range(ASKED):
            rates[number, i] = (asked[i] - asks[i]) / LITTLE
    return True, points, asks, slopes, rates


@leaf
def nearest_piece(points, x, y):
    """Which piece of a polyline `points (m, 2)` is nearest to a place, and how far along it, from 0 to 1."""
    best, which, share = np.inf, 0, 0.0
    for i in range(points.shape[0] - 1):
        ax, ay = points[i, 0], points[i, 1]
        bx, by = points[i + 1, 0] - ax, points[i + 1, 1] - ay
        square = bx * bx + by * by
        t = 0.0
        if square > 0.0:
            t = min(max(((x - ax) * bx + (y - ay) * by) / square, 0.0), 1.0)
        dx, dy = x - ax - t * bx, y - ay - t * by
        distance = dx * dx + dy * dy
        if distance < best:
            best, which, share = distance, i, t
    return which, share


@leaf
def away_from(points, x, y):
    """How far a place is to the left of a polyline, the direction of that, which piece it is at, how far along."""
    which, t = nearest_piece(points, x, y)
    ax, ay = points[which, 0], points[which, 1]
    bx, by = points[which + 1, 0] - ax, points[which + 1, 1] - ay
    size = max(np.hypot(bx, by), 1e-12)
    nx, ny = -by / size, bx / size
    dx, dy = x - ax - t * bx, y - ay - t * by
    off = nx * dx + ny * dy
    distance = np.hypot(dx, dy)
    if (t == 0.0 or t == 1.0) and distance > 1e-12:
        # Beyond a corner, or an end, the way to it counts.
        side = 1.0 if off >= 0.0 else -1.0
        off, nx, ny = side * distance, side * dx / distance, side * dy / distance
    return off, nx, ny, which, t


@shipped(Matrix, Matrix, Stack, Matrix)
def misfits(points, target, slopes, moved):
    """Signed distances of a curve's `points (m, 2)` from a `target (k, 2)`, and of its points from the curve: (m+k,).

    Their slopes by as many numbers as the `slopes (p, m, 2)` of the points are by go to `moved (m+k, p)`.
    """
    m, k = points.shape[0], target.shape[0]
    out = np.empty(m + k)
    for i in range(m):
        out[i], nx, ny, _, _ = away_from(target, points[i, 0], points[i, 1])
        for p in range(moved.shape[1]):
            moved[i, p] = nx * slopes[p, i, 0] + ny * slopes[p, i, 1]
    for j in range(k):
        out[m + j], nx, ny, which, t = away_from(points, target[j, 0], target[j, 1])
        for p in range(moved.shape[1]):
            x = slopes[p, which, 0] + t * (slopes[p, which + 1, 0] - slopes[p, which, 0])
            y = slopes[p, which, 1] + t * (slopes[p, which + 1, 1] - slopes[p, which, 1])
            moved[m + j, p] = -(nx * x + ny * y)
    return out
