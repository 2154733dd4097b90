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
from curveline.kernels.kernel import leaf, njit, shipped
from curveline.rod.planar.modes import modes_below, second_variation
from curveline.rod.planar.newton import Effort, descend, lean, newton
from curveline.rod.problem import Problem, copy_into, largest_change, mean_height, released, sharpest_turn

CAPACITY = 24
NEAR_PLACES = 16

NUDGE = 0.3
"""Disturbance [rad] into an S that takes a constrained rod off an unstable symmetric shape."""
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
STRETCHED = 1.5
"""The same of a rod that may stretch."""
NEAR = 12.0
"""Extreme of the energy's slope below which a pair of states may hide between samples or from the coarse rod."""
SHARPEST = 1.0
"""Turn between neighbouring edges [rad] from which on a coarse shape counts as an artefact."""
SAME = 1e-3
"""Edges' angles [rad] that differ by less belong to the same state."""

MOST_STEPS = 60

SMOOTH = 0.1
"""Second difference of an edge [rad] above which the last steps of a sweep lead on along a straight line only."""
JUMP = 0.3
"""Turn of an edge [rad] from there to where it goes, above which it may have jumped."""
FIRST = 0.4
"""Turn of an edge [rad] in a sweep's first step, above which its tangent leads astray."""

FOLLOW = Effort(turn=0.5, close=2e-2, iterations=12)
LOOK = Effort(turn=0.5, close=1e-3, iterations=12)
SETTLE = Effort(turn=0.5, close=1e-3, iterations=15)
CERTIFY = Effort(turn=0.3, close=1e-4, iterations=40)


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

    heights: Matrix
    shapes: Matrix
    forces: Matrix
    filled: Vector
    lost: Vector


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
    return room_for(n, CAPACITY)


@njit
def room_for(n, count):
    """Room for so many equilibria on n edges."""
    return MetEquilibria(np.zeros((count, n)), np.zeros((count, 2)), np.zeros(count), np.zeros(1))


@shipped(Problem, MetEquilibria, Vector, Vector, int)
@leaf
def keep(problem, found, phi, multipliers, unstable):
    """Add an equilibrium to `found` unless it is an artefact, already there, or there is no room.

    Returns its place there, -1 if it has none.
    """
    if unstable < 0 or sharpest_turn(problem, phi) > SHARPEST:
        return -1
    count = int(found.filled[0])
    for i in range(count):
        if largest_change(found.shapes[i], phi) < SAME:
            return i
    if count == found.shapes.shape[0]:
        return -1
    copy_into(found.shapes[count], phi)
    copy_into(found.multipliers[count], multipliers)
    found.unstable[count] = unstable
    found.filled[0] += 1
    return count


@leaf
def hold(problem, phi, multipliers):
    """Newton with the mean height held, as `newton`: roughly, but for what seems to be unstable. Overwrites both."""
    iterations, unstable = newton(problem, phi, multipliers, FOLLOW)
    if iterations > 0 and unstable != 0:
        iterations, unstable = newton(problem, phi, multipliers, LOOK)
    return iterations, unstable


@njit
def slip_from(problem, begin, phi, multipliers):
    """Go downhill to a constrained minimum from `begin (n,)`, a saddle or near one; False if there is none.

    `phi (n,)` and `multipliers (3,)` are overwritten.
    """
    n = phi.size
    at = 0.0
    for j in range(n):
        # A symmetric arch has odd angles about its middle: what takes it off is even, and moves no end at first order.
        middle = np.pi * (at + 0.5 * problem.edges[j])
        at += problem.edges[j]
        phi[j] = begin[j] + NUDGE * (np.sin(3.0 * middle) - np.sin(middle) / 3.0)
    return descend(problem, phi, multipliers, SETTLE) > 0 and sharpest_turn(problem, phi) < SHARPEST


@njit
def settle_at(problem, height, phi, multipliers):
    """Solve with the mean height held at `height`: Newton, or downhill from where that is unstable.

    `phi (n,)` and `multipliers (3,)` are overwritten; returns False if there is no such constrained minimum.
    """
    problem.targets[2] = height
    begin, kept = phi.copy(), multipliers.copy()
    iterations, unstable = hold(problem, phi, multipliers)
    if iterations < 0 or unstable != 0:
        if iterations > 0:
            copy_into(begin, phi)
        copy_into(multipliers, kept)
        return slip_from(problem, begin, phi, multipliers)
    return sharpest_turn(problem, phi) < SHARPEST


@njit
def is_ridge(problem, phi, multipliers, least):
    """True if no eigenvalue of a constrained equilibrium is below `least`, so that it may be a minimum, or lead to one.

    Which it is on finer edges.
    """
    variation = second_variation(problem, phi, multipliers)
    return modes_below(problem, variation, least) == 0 and sharpest_turn(problem, phi) < SHARPEST


@leaf
def nearly_zero(before, here, after):
    """True if the slope of the energy came near zero and turned round: the parabola's vertex is below `NEAR`."""
    if before * here <= 0.0 or here * after <= 0.0 or abs(here) > abs(before) or abs(here) > abs(after):
        return False
    bend = before - 2.0 * here + after
    return abs(here) - 0.125 * (after - before) ** 2 / abs(bend) < NEAR


@leaf
def bend_of(now, before, earlier):
    """Largest second difference of three equally spaced values (n,)."""
    largest = 0.0
    for j in range(now.size):
        largest = max(largest, abs(now[j] - 2.0 * before[j] + earlier[j]))
    return largest


@leaf
def predict(now, before, earlier, bend, out):
    """Extrapolate three equally spaced values, componentwise, into `out`: linear for a `bend` of 0, quadratic for 1."""
    for j in range(now.size):
        out[j] = 2.0 * now[j] - before[j] + bend * (now[j] - 2.0 * before[j] + earlier[j])


@leaf
def between(before, now, share, out):
    """Linear interpolation of two values, componentwise, into `out`."""
    for j in range(now.size):
        out[j] = before[j] + share * (now[j] - before[j])


@leaf
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


@leaf
def note(near, heights, phi, multipliers):
    """Remember a place, if there is room: three heights, angles (n,) and multipliers (3,) at the middle one."""
    place = int(near.filled[0])
    if place < near.heights.shape[0]:
        for i in range(3):
            near.heights[place, i] = heights[i]
        copy_into(near.shapes[place], phi)
        copy_into(near.forces[place], multipliers)
        near.filled[0] += 1


@njit
def seek(problem, free, phi, multipliers, found):
    """Let go of the height at `phi (n,)`, `multipliers (3,)`, both overwritten, and keep what Newton reaches.

    Returns its place in `found`, -1 if it has none.
    """
    iterations, unstable = newton(free, phi, multipliers[:2], CERTIFY)
    return keep(problem, found, phi, multipliers[:2], unstable) if iterations > 0 else -1


@njit
def sweep_heights(problem, start, direction, found, near):
    """Follow the constrained minimum `start`, angles (n,) and multipliers (3,), while the mean height rises or falls.

    `direction` is 1 or -1. Equilibria that are met go to `found`, places worth a closer look to `near`. Where the
    minimum becomes a saddle, the rod goes downhill to another one; but on finer edges the saddle may be a minimum, so
    that it is followed, too, as long as it is a ridge. Returns (c,) 1 for those of `found` that it met before any jump.
    """
    passed = np.zeros(found.unstable.size)
    ridge = no_ridge(problem.edges.size)
    shape, held = start
    follow_heights(problem, (shape, held, np.nan), direction, (found, near, ridge, passed), 0.0)
    if ridge.filled[0] > 0.0:
        start = ridge.shapes[0], ridge.forces[0], ridge.heights[0, 1]
        follow_heights(problem, start, direction, (found, near, ridge, np.zeros(passed.size)), RIDGE)
    return passed


@leaf
def course_of(problem, phi):
    """The highest mean height of a sweep, and the angle whose sine is that of `phi (n,)` over it, and its step.

    Near the highest mean height the rod changes as fast as such an angle does.
    """
    highest = highest_mean(np.hypot(problem.targets[0], problem.targets[1]))
    highest *= BEYOND if problem.compliance[0] == 0.0 else STRETCHED
    step = min(STRIDE / highest, STRIDE_SHARE)
    if phi.size > FEW:
        step *= 0.5
    sine = min(max(mean_height(problem, phi) / highest, -1.0), 1.0)
    return highest, np.arctan2(sine, np.sqrt(1.0 - sine * sine)), step


@leaf
def heights_at(highest, course, stride):
    """The mean heights of the last three steps of a sweep."""
    return (
        highest * np.sin(course - 2.0 * stride),
        highest * np.sin(course - stride),
        highest * np.sin(course),
    )


@njit
def led_by(problem, phi, multipliers, stride):
    """How far a sweep's first step leads, d phi (n,), d multipliers (3,); nowhere if that is too far for a tangent."""
    lead, pull = lean(problem, phi, multipliers)
    share = stride
    if not abs(stride) * largest_change(lead, np.zeros(lead.size)) < FIRST:
        share = 0.0
    return share * lead, (share * pull[0], share * pull[1], share * pull[2])


@njit
def follow_heights(problem, start, direction, out, least):
    """One way of `sweep_heights`, on which no eigenvalue under all constraints is below `least`.

    Where that is 0, the way is one of minima: where they end, the rod goes downhill to another one. With `RIDGE` the
    way ends there. `start` holds the slope of the energy one step before, too, if that is known; `out` holds `found`,
    `near`, a `Near` for the first ridge beside the way, and (c,) what is to be 1 for what was met before any jump.
    """
    found, near, ridge, passed = out
    shape, held, slope_before = start
    free = released(problem)
    phi, before, earlier, guess = shape.copy(), shape.copy(), shape.copy(), shape.copy()
    multipliers, before_forces, earlier_forces, forces = held.copy(), held.copy(), held.copy(), held.copy()
    slopes = np.array([slope_before, held[2]])
    highest, course, stride = course_of(problem, phi)
    stride *= direction
    lead, pull = led_by(problem, phi, multipliers, stride * highest * np.cos(course))
    for j in range(phi.size):
        before[j] -= lead[j]
        earlier[j] -= 2.0 * lead[j]
    for a in range(3):
        before_forces[a] -= pull[a]
        earlier_forces[a] -= 2.0 * pull[a]
    is_smooth = True
    for step in range(MOST_STEPS):
        course += stride
        if abs(course) > 0.5 * np.pi:
            return
        bend = 1.0 if bend_of(phi, before, earlier) < SMOOTH else 0.0
        predict(phi, before, earlier, bend, guess)
        predict(multipliers, before_forces, earlier_forces, bend, forces)
        copy_into(earlier, before)
        copy_into(earlier_forces, before_forces)
        copy_into(before, phi)
        copy_into(before_forces, multipliers)
        copy_into(phi, guess)
        copy_into(multipliers, forces)
        problem.targets[2] = highest * np.sin(course)
        iterations, unstable = hold(problem, guess, forces)
        is_smooth = is_smooth and iterations > 0 and unstable == 0 and largest_change(guess, phi) < JUMP
        if least < 0.0:
            if iterations < 0:
                near.lost[0] += 1.0
            if iterations < 0 or not is_ridge(problem, guess, forces, least):
                return
        elif iterations < 0 or unstable != 0:
            if iterations > 0 and unstable == 1 and ridge.filled[0] == 0.0 and is_ridge(problem, guess, forces, RIDGE):
                note(ridge, (0.0, slopes[1], 0.0), guess, forces)
                if forces[2] * slopes[1] <= 0.0:
                    seek(problem, free, guess, forces, found)
                elif nearly_zero(slopes[0], slopes[1], forces[2]):
                    note(near, heights_at(highest, course, stride), before, before_forces)
            copy_into(forces, multipliers)
            if not slip_from(problem, guess if iterations > 0 else before, guess, forces):
                return
        elif sharpest_turn(problem, guess) > SHARPEST:
            return
        copy_into(phi, guess)
        copy_into(multipliers, forces)
        slope = multipliers[2]
        if slopes[1] != 0.0 and slope * slopes[1] <= 0.0:
            share = slopes[1] / (slopes[1] - slope)
            if not is_smooth:
                share = np.round(share)
            between(before, phi, share, guess)
            between(before_forces, multipliers, share, forces)
            place = seek(problem, free, guess, forces, found)
            if is_smooth and place >= 0:
                passed[place] = 1.0
        elif nearly_zero(slopes[0], slopes[1], slope):
            note(near, heights_at(highest, course, stride), before, before_forces)
        if abs(slope) > FAR:
            return
        if step == 0:
            # The slope at the start is worth a step before it.
            for j in range(phi.size):
                earlier[j] = phi[j] - 2.0 * lead[j]
            for a in range(3):
                earlier_forces[a] = multipliers[a] - 2.0 * pull[a]
        slopes[0] = slopes[1]
        slopes[1] = slope
