"""Kernels that sweep the mean height of a curve: they keep the equilibria met, and the places worth a closer look.

The mean height m of the curve over its chord is held by one more constraint, and the constrained minimum followed while
m rises or falls. The constraint's multiplier is the slope of the energy along the sweep, so each of its zeros is an
equilibrium; where it only comes near zero, between two samples or because the coarse rod just misses a fold, a pair of
states may hide, which a finer rod shows.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from curveline.kernels.forms import Matrix, Vector
from curveline.kernels.kernel import njit, shipped
from curveline.rod.planar.modes import modes_below, second_variation
from curveline.rod.planar.newton import Effort, descend, newton
from curveline.rod.problem import Array, Problem, copy_into, largest_change, mean_height, released, sharpest_turn

CAPACITY = 24
NEAR_PLACES = 16

NUDGE = 0.03
"""S-shaped disturbance [rad] that takes a constrained rod off an unstable symmetric shape."""
STRIDE = 0.025
"""Step of the mean height in a sweep, in units of the length."""
STRIDE_SHARE = 0.15
"""Longest step, too, as a part of the largest mean height that the rod can have: a taut one has its states close by."""
FEW = 48
"""Edges up to which steps are that long: more of them are swept with where a narrow dip may lie between two steps."""
BARELY = -8.0
"""Lowest eigenvalue of a coarse equilibrium that finer edges may show to be stable after all."""
RIDGE = -40.0
"""The same of a constrained equilibrium, beside which such a state may lie: a sweep's step changes it by some ten."""
FAR = 300.0
"""Slope of the energy at which a sweep ends; in the scenes searched by brute force no state lay beyond."""
BEYOND = 1.001
"""A mean height this often the largest that any curve has is not tried: to fail there costs as much as a sweep."""
NEAR = 12.0
"""Extreme of the energy's slope below which a pair of states may hide between samples or from the coarse rod."""
SHARPEST = 1.0
"""Turn between neighbouring edges [rad] from which on a coarse shape counts as an artefact."""
SAME = 1e-3
"""Edges' angles [rad] that differ by less belong to the same state."""

MOST_STEPS = 60

FOLLOW = Effort(turn=0.5, close=1e-3, iterations=12)
SETTLE = Effort(turn=0.5, close=1e-3, iterations=15)
CERTIFY = Effort(turn=0.3, close=1e-7, iterations=40)


class MetEquilibria(NamedTuple):
    """Equilibria met so far: `shapes (c, n)`, `multipliers (c, 2)`, `unstable (c,)`, `filled (1,)` how many."""

    shapes: Matrix
    multipliers: Matrix
    unstable: Vector
    filled: Vector


class Near(NamedTuple):
    """Where a sweep's slope of the energy came near zero: three heights each, and the rod in the middle one.

    `heights (c, 3)`, `shapes (c, n)`, multipliers `forces (c, 3)`, `filled (1,)` how many. `lost (1,)` counts the
    ridges that could not be followed to where they end.
    """

    heights: Array
    shapes: Array
    forces: Array
    filled: Array
    lost: Array


@njit
def nowhere_near(n):
    """An empty `Near` for rods of n edges."""
    return Near(
        np.zeros((NEAR_PLACES, 3)), np.zeros((NEAR_PLACES, n)), np.zeros((NEAR_PLACES, 3)), np.zeros(1), np.zeros(1)
    )


@njit
def no_ridge(n):
    """A `Near` for one place, where a sweep of rods of n edges left a ridge."""
    return Near(np.zeros((1, 3)), np.zeros((1, n)), np.zeros((1, 3)), np.zeros(1), np.zeros(1))


@shipped(int)
def nothing_found(n):
    """An empty `MetEquilibria` for rods of n edges."""
    return MetEquilibria(np.zeros((CAPACITY, n)), np.zeros((CAPACITY, 2)), np.zeros(CAPACITY), np.zeros(1))


@shipped(Problem, MetEquilibria, Vector, Vector, int)
def keep(problem, found, phi, multipliers, unstable):
    """Add an equilibrium to `found` unless it is an artefact, already there, or there is no room."""
    if unstable < 0 or sharpest_turn(problem, phi) > SHARPEST:
        return False
    count = int(found.filled[0])
    for i in range(count):
        if largest_change(found.shapes[i], phi) < SAME:
            return False
    if count == found.shapes.shape[0]:
        return False
    copy_into(found.shapes[count], phi)
    copy_into(found.multipliers[count], multipliers)
    found.unstable[count] = unstable
    found.filled[0] += 1
    return True


@njit
def slip_from(problem, phi, multipliers, backup):
    """Go downhill to a constrained minimum from `backup (n,)`, past a saddle; False if there is none.

    `phi (n,)` and `multipliers (3,)` are overwritten.
    """
    copy_into(phi, backup)
    # Off the symmetric path by a small S, or the descent could sit on it.
    n = phi.size
    for j in range(n):
        phi[j] += NUDGE * np.sin(2.0 * np.pi * (j + 0.5) / n)
    return descend(problem, phi, multipliers, SETTLE) > 0 and sharpest_turn(problem, phi) < SHARPEST


@njit
def settle_at(problem, height, phi, multipliers, backup):
    """Solve with the mean height held at `height`: Newton, or downhill from `backup (n,)` where that is unstable.

    `phi (n,)` and `multipliers (3,)` are overwritten; returns False if there is no such constrained minimum.
    """
    problem.targets[2] = height
    kept = multipliers.copy()
    iterations, unstable = newton(problem, phi, multipliers, FOLLOW)
    if iterations < 0 or unstable != 0:
        copy_into(multipliers, kept)
        return slip_from(problem, phi, multipliers, backup)
    return sharpest_turn(problem, phi) < SHARPEST


@njit
def is_ridge(problem, phi, multipliers, least):
    """True if no eigenvalue of a constrained equilibrium is below `least`, so that it may be a minimum, or lead to one.

    Which it is on finer edges.
    """
    variation = second_variation(problem, phi, multipliers)
    return modes_below(problem, variation, least) == 0 and sharpest_turn(problem, phi) < SHARPEST


@njit
def nearly_zero(before, here, after):
    """True if the slope of the energy came near zero and turned round: the parabola's vertex is below `NEAR`."""
    if before * here <= 0.0 or here * after <= 0.0 or abs(here) > abs(before) or abs(here) > abs(after):
        return False
    bend = before - 2.0 * here + after
    return abs(here) - 0.125 * (after - before) ** 2 / abs(bend) < NEAR


@njit
def predict(now, before, out):
    """Linear extrapolation of two equally spaced values, componentwise, into `out`."""
    for j in range(now.size):
        out[j] = 2.0 * now[j] - before[j]


@njit
def highest_mean(chord):
    """Largest mean height over its chord of any curve of length 1, clamped or not, whose ends are `chord` apart.

    That of a catenary turned upside down, whose centre of mass no other curve's exceeds: (coth u - u / sinh(u)^2) / 4,
    where u / sinh u is the chord. Newton on the logarithm of that, which is convex, comes from above.
    """
    if chord >= 1.0:
        return 0.0
    goal = -np.log(max(chord, 1e-12))
    u = np.sqrt(6.0 * np.expm1(goal))
    for _ in range(60):
        rest = np.exp(-2.0 * u)
        slope = (1.0 + rest) / (1.0 - rest) - 1.0 / u
        change = (u + np.log1p(-rest) - np.log(2.0 * u) - goal) / slope
        u -= change
        if abs(change) < 1e-9 * u:
            break
    rest = np.exp(-2.0 * u)
    return 0.25 * ((1.0 + rest) / (1.0 - rest) - 4.0 * u * rest / (1.0 - rest) ** 2)


@njit
def note(near, middle, stride, phi, multipliers):
    """Remember a place, if there is room: the `middle` one of three heights, angles (n,) and multipliers (3,) in it."""
    place = int(near.filled[0])
    if place < near.heights.shape[0]:
        for i in range(3):
            near.heights[place, i] = middle + (i - 1) * stride
        copy_into(near.shapes[place], phi)
        copy_into(near.forces[place], multipliers)
        near.filled[0] += 1


@njit
def seek(problem, free, phi, multipliers, found):
    """Let go of the height at `phi (n,)`, `multipliers (3,)` and keep the equilibrium that Newton reaches."""
    angles, force = phi.copy(), multipliers[:2].copy()
    iterations, unstable = newton(free, angles, force, CERTIFY)
    if iterations > 0:
        keep(problem, found, angles, force, unstable)


@njit
def sweep_heights(problem, start, direction, found, near):
    """Follow the constrained minimum `start`, angles (n,) and multipliers (3,), while the mean height rises or falls.

    `direction` is 1 or -1. Equilibria that are met go to `found`, places worth a closer look to `near`. Where the
    minimum becomes a saddle, the rod goes downhill to another one; but on finer edges the saddle may be a minimum, so
    that it is followed, too, as long as it is a ridge.
    """
    ridge = no_ridge(problem.edges.size)
    shape, held = start
    follow_heights(problem, (shape, held, np.nan), direction, (found, near, ridge), 0.0)
    if ridge.filled[0] > 0.0:
        start = ridge.shapes[0], ridge.forces[0], ridge.heights[0, 1]
        follow_heights(problem, start, direction, (found, near, ridge), RIDGE)


@njit
def follow_heights(problem, start, direction, out, least):
    """One way of `sweep_heights`, on which no eigenvalue under all constraints is below `least`.

    Where that is 0, the way is one of minima: where they end, the rod goes downhill to another one. With `RIDGE` the
    way ends there. `start` holds the slope of the energy one step before, too, if that is known; `out` holds `found`,
    `near` and a `Near` for the first ridge beside the way.
    """
    found, near, ridge = out
    shape, held, slope_before = start
    phi = shape.copy()
    multipliers = held.copy()
    free = released(problem)
    height = mean_height(problem, phi)
    before = phi.copy()
    before_forces = multipliers.copy()
    guess = phi.copy()
    forces = multipliers.copy()
    slopes = np.array([slope_before, held[2]])
    highest = BEYOND * highest_mean(np.hypot(problem.targets[0], problem.targets[1]))
    stride = direction * min(STRIDE, highest * STRIDE_SHARE)
    if phi.size > FEW:
        stride *= 0.5
    for _ in range(MOST_STEPS):
        height += stride
        if abs(height) > highest and problem.compliance[0] == 0.0:
            return
        predict(phi, before, guess)
        predict(multipliers, before_forces, forces)
        copy_into(before, phi)
        copy_into(before_forces, multipliers)
        problem.targets[2] = height
        kept = forces.copy()
        iterations, unstable = newton(problem, guess, forces, FOLLOW)
        if least < 0.0:
            if iterations < 0:
                near.lost[0] += 1.0
            if iterations < 0 or not is_ridge(problem, guess, forces, least):
                return
        elif iterations < 0 or unstable != 0:
            if iterations > 0 and unstable == 1 and ridge.filled[0] == 0.0 and is_ridge(problem, guess, forces, RIDGE):
                note(ridge, slopes[1], 0.0, guess, forces)
                if forces[2] * slopes[1] <= 0.0:
                    seek(problem, free, guess, forces, found)
                elif nearly_zero(slopes[0], slopes[1], forces[2]):
                    note(near, height - stride, stride, before, before_forces)
            copy_into(forces, kept)
            if not slip_from(problem, guess, forces, before):
                return
        elif sharpest_turn(problem, guess) > SHARPEST:
            return
        copy_into(phi, guess)
        copy_into(multipliers, forces)
        slope = multipliers[2]
        if slopes[1] != 0.0 and slope * slopes[1] <= 0.0:
            if abs(slope) > abs(slopes[1]):
                copy_into(guess, before)
                copy_into(forces, before_forces)
            seek(problem, free, guess, forces, found)
        elif nearly_zero(slopes[0], slopes[1], slope):
            note(near, height - stride, stride, before, before_forces)
        if abs(slope) > FAR:
            return
        slopes[0] = slopes[1]
        slopes[1] = slope
