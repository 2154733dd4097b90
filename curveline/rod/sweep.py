"""Kernels that sweep the mean height of a curve: they keep the equilibria met, and the places worth a closer look.

The mean height m of the curve over its chord is held by one more constraint, and the constrained minimum followed while
m rises or falls. The constraint's multiplier is the slope of the energy along the sweep, so each of its zeros is an
equilibrium; where it only comes near zero, between two samples or because the coarse rod just misses a fold, a pair of
states may hide, which a finer rod shows.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from curveline.rod._jit import njit
from curveline.rod.planar import Effort, descend, newton
from curveline.rod.problem import Array, copy_into, largest_change, mean_height, released, sharpest_turn

CAPACITY = 24
NEAR_PLACES = 8

NUDGE = 0.03
"""S-shaped disturbance [rad] that takes a constrained rod off an unstable symmetric shape."""
STRIDE = 0.025
"""Step of the mean height in a sweep, in units of the length."""
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

FOLLOW = Effort(turn=0.5, close=1e-3, iterations=12)
SETTLE = Effort(turn=0.5, close=1e-3, iterations=15)
CERTIFY = Effort(turn=0.3, close=1e-7, iterations=40)


class Found(NamedTuple):
    """Equilibria met so far: `shapes (c, n)`, `multipliers (c, 2)`, `unstable (c,)`, `filled (1,)` how many."""

    shapes: Array
    multipliers: Array
    unstable: Array
    filled: Array


class Near(NamedTuple):
    """Where a sweep's slope of the energy came near zero: three heights each, and the rod in the middle one.

    `heights (c, 3)`, `shapes (c, n)`, multipliers `forces (c, 3)`, `filled (1,)` how many.
    """

    heights: Array
    shapes: Array
    forces: Array
    filled: Array


@njit
def nowhere_near(n):
    """An empty `Near` for rods of n edges."""
    return Near(np.empty((NEAR_PLACES, 3)), np.empty((NEAR_PLACES, n)), np.empty((NEAR_PLACES, 3)), np.zeros(1))


@njit
def nothing_found(n):
    """An empty `Found` for rods of n edges."""
    return Found(np.empty((CAPACITY, n)), np.empty((CAPACITY, 2)), np.empty(CAPACITY), np.zeros(1))


@njit
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
def settle_at(problem, height, phi, multipliers, backup):
    """Solve with the mean height held at `height`: Newton, or downhill from `backup (n,)` where that is unstable.

    `phi (n,)` and `multipliers (3,)` are overwritten; returns False if there is no such constrained minimum.
    """
    problem.targets[2] = height
    kept = multipliers.copy()
    iterations, unstable = newton(problem, phi, multipliers, FOLLOW)
    if iterations < 0 or unstable != 0:
        copy_into(phi, backup)
        copy_into(multipliers, kept)
        # Off the symmetric path by a small S, or the descent could sit on it.
        n = phi.size
        for j in range(n):
            phi[j] += NUDGE * np.sin(2.0 * np.pi * (j + 0.5) / n)
        iterations = descend(problem, phi, multipliers, SETTLE)
    return iterations > 0 and sharpest_turn(problem, phi) < SHARPEST


@njit
def parabola_vertex(at, values):
    """Abscissa of the vertex of the parabola through three points; NaN if they lie on a line."""
    first = (values[1] - values[0]) / (at[1] - at[0])
    second = (values[2] - values[1]) / (at[2] - at[1])
    bend = (second - first) / (at[2] - at[0])
    return 0.5 * (at[0] + at[1] - first / bend) if bend != 0.0 else np.nan


@njit
def look_closer(problem, heights, phi, multipliers, found):
    """Look for a pair of states near a fold on a finer rod: the energy's slope came near zero between three `heights`.

    Successive parabolic interpolation seeks the extremum of the slope. Once the slope changes sign, a pair of states
    exists, and the rod is released from every height that was tried. `phi (n,)`, `multipliers (3,)` are overwritten.
    """
    tries = 7
    at = np.empty(tries)
    slopes = np.empty(tries)
    shapes = np.empty((tries, phi.size))
    forces = np.empty((tries, 3))
    tried = 0
    crossed = False
    while tried < tries and not (crossed and tried > 3):
        height = heights[tried] if tried < 3 else parabola_vertex(at[tried - 3 : tried], slopes[tried - 3 : tried])
        if not abs(height - heights[1]) <= abs(heights[2] - heights[1]) + 1e-12:
            break
        backup = phi.copy()
        if not settle_at(problem, height, phi, multipliers, backup):
            break
        at[tried] = height
        slopes[tried] = multipliers[2]
        copy_into(shapes[tried], phi)
        copy_into(forces[tried], multipliers)
        crossed = crossed or slopes[tried] * slopes[0] < 0.0
        tried += 1
    if not crossed:
        return
    free = released(problem)
    for i in range(tried):
        force = forces[i, :2].copy()
        iterations, unstable = newton(free, shapes[i], force, CERTIFY)
        if iterations > 0:
            keep(problem, found, shapes[i], force, unstable)


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
def sweep_heights(problem, start, direction, found, near):
    """Follow the constrained minimum `start`, angles (n,) and multipliers (3,), while the mean height rises or falls.

    `direction` is 1 or -1. Equilibria that are met go to `found`, places worth a closer look to `near`.
    """
    shape, held = start
    phi = shape.copy()
    multipliers = held.copy()
    free = released(problem)
    height = mean_height(problem, phi)
    before = phi.copy()
    before_forces = multipliers.copy()
    guess = phi.copy()
    forces = multipliers.copy()
    slopes = np.array([0.0, held[2]])
    highest = BEYOND * highest_mean(np.hypot(problem.targets[0], problem.targets[1]))
    for count in range(60):
        height += direction * STRIDE
        if abs(height) > highest and problem.compliance[0] == 0.0:
            return
        predict(phi, before, guess)
        predict(multipliers, before_forces, forces)
        copy_into(before, phi)
        copy_into(before_forces, multipliers)
        if not settle_at(problem, height, guess, forces, before):
            return
        copy_into(phi, guess)
        copy_into(multipliers, forces)
        slope = multipliers[2]
        if slopes[1] != 0.0 and slope * slopes[1] <= 0.0:
            if abs(slope) > abs(slopes[1]):
                copy_into(guess, before)
                copy_into(forces, before_forces)
            force = forces[:2].copy()
            iterations, unstable = newton(free, guess, force, CERTIFY)
            if iterations > 0:
                keep(problem, found, guess, force, unstable)
        elif count > 1 and nearly_zero(slopes[0], slopes[1], slope):
            heights = np.array([height - 2.0 * direction * STRIDE, height - direction * STRIDE, height])
            place = int(near.filled[0])
            if place < near.heights.shape[0]:
                copy_into(near.heights[place], heights)
                copy_into(near.shapes[place], before)
                copy_into(near.forces[place], before_forces)
                near.filled[0] += 1
        if abs(slope) > FAR:
            return
        slopes[0] = slopes[1]
        slopes[1] = slope
