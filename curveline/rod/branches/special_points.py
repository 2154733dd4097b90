"""Where a branch loses stability, for the continuous rod: a fold or a bifurcation, its mode, and where the rod falls.

point = critical(path, bearing, *start_along(path, state))
point.kind, point.fraction, point.error                 # Kind.FOLD, BIFURCATION, NONE (to the end) or LOST
point.edges, point.phi, point.multipliers, point.mode   # the critical shape on its finest level, and its mode
falls(path, bearing, point)                              # where the rod lands, nudged along the mode and against it
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from enum import Enum
from typing import NamedTuple

import numpy as np

from curveline.kernels.forms import Counts, Vector
from curveline.kernels.kernel import njit, shipped
from curveline.rod.branches.arclength import (
    FIRST_STEP,
    LONGEST_STEP,
    advance,
    back_to_branch,
    begin_at,
    moved,
    product,
    solve_bordered,
)
from curveline.rod.branches.continuation import NUDGE, follow, land, perturbation, travel
from curveline.rod.branches.control_path import ControlPath, counts_along, forces_at, pose_at, problem_at, rod_at
from curveline.rod.planar.modes import LARGEST, characteristic, second_variation
from curveline.rod.planar.richardson import HONESTY, ROUNDING
from curveline.rod.problem import Array, Bearing, cut, refine_angles

NO_POINT = 0
FOLD_POINT = 1
BIFURCATION_POINT = 2

CLOSE = 1e-10
"""Arc length to which a special point is bracketed."""
STEPS = 400

TOLERANCE = 1e-6
LEVELS = 7
LEAST_LEVELS = 3
FINER_STARTS = 3
BACK = 0.9
"""Where the finer levels begin, as a part of the path to where the coarsest one loses its stability."""
BEYOND = 1.05
"""How far to look, as a fraction of the path: a coarse rod may keep its stability longer than the continuous one."""
PAST = 1e-3
"""How far past the special point the rod falls, as a part of its fraction."""
SAME = 1e-5
"""Edges of the same state differ by less than this [rad]: what is reached downhill is there to rounding."""


class SpecialKind(Enum):
    """How a stable branch ends; the value is what the user reads."""

    FOLD = "fold"
    BIFURCATION = "bifurcation"
    NONE = "stable to the end"
    LOST = "lost"


@dataclass(frozen=True)
class SpecialPoint:
    """Where a branch loses stability: its `fraction` of the path for the continuous rod, with an estimate of the error.

    Angles `phi (n,)`, `multipliers (2,)` and the `mode (n,)`, with the root mean square 1, are those of the finest
    level, on `edges (n,)`, which has the point at the fraction `reached`. The mode of a fold leads on along the branch.
    `levels` are pairs of edges and fraction. Without a special point the fraction is 1 and the mode is zero.
    """

    kind: SpecialKind
    fraction: float
    error: float
    reached: float
    edges: Array
    phi: Array
    multipliers: Array
    mode: Array
    levels: tuple[tuple[int, float], ...] = ()


class _Level(NamedTuple):
    """The special point on one level: what it is, the point (n+3,), its mode (n,), the edges (n,) there."""

    what: int
    point: Array
    mode: Array
    edges: Array


class FallOutcome(NamedTuple):
    """Where the rod lands after the loss of stability: whether in a stable state, and its angles `phi (n,)`.

    On `edges (n,)` at the fraction `at` of the path, just past the special point; `multipliers (2,)`.
    """

    landed: bool
    at: float
    edges: Array
    phi: Array
    multipliers: Array


@njit
def null_mode(problem, point):
    """The mode (n,) whose eigenvalue is nearest to zero at a point (n+3,), with the root mean square 1.

    By inverse iteration on the bordered Hessian, whose singularity is what makes it converge.
    """
    n = problem.edges.size
    variation = second_variation(problem, point[:n], point[n : n + 2])
    slope = np.zeros(n + 2)
    row = np.zeros(n + 3)
    row[n + 2] = 1.0
    right = np.zeros(n + 3)
    mode = perturbation(n)
    for _ in range(6):
        for j in range(n):
            right[j] = problem.edges[j] * mode[j]
        raw = solve_bordered(problem, variation, slope, row, right)[:n]
        size = 0.0
        for j in range(n):
            size += problem.edges[j] * raw[j] ** 2
        mode = moved(np.zeros(n), 1.0 / np.sqrt(size), raw)
    return mode


@njit
def determinant(path, bearing, counts, point):
    """Unstable directions at a point (n+3,), and the determinant of the bordered Hessian there."""
    n = point.size - 3
    problem = problem_at(path, bearing, point[n + 2], counts)
    return characteristic(problem, second_variation(problem, point[:n], point[n : n + 2]), 0.0)


@njit
def pinpoint(path, bearing, counts, here, step, beyond):
    """The point (n+3,) within a `step` ahead of a `Spot` at which the number of unstable directions changes.

    The point (n+3,) `beyond` is that at the end of the step.

    A zero of the determinant of the bordered Hessian along the branch, which has no poles, by the Illinois method, and
    by bisection while it leaves the range of floating point. A step that crosses another branch is short, and is
    not searched down to where that makes Newton singular: the secant is exact enough there.
    """
    low, high = 0.0, step
    low_point, high_point = here.point, beyond
    _, at_low = determinant(path, bearing, counts, low_point)
    _, at_high = determinant(path, bearing, counts, high_point)
    side = 0
    share = 0.5
    while high - low > CLOSE:
        share = 0.5
        if -LARGEST < at_low * at_high < 0.0:
            share = at_low / (at_low - at_high)
        # Not nearer to either end than the precision, so that the last step takes the zero between two ends.
        share = min(max(share, 0.4 * CLOSE / (high - low)), 1.0 - 0.4 * CLOSE / (high - low))
        guess = low + share * (high - low)
        point, iterations = back_to_branch(path, bearing, counts, here, guess)
        if iterations < 0:
            break
        unstable, value = determinant(path, bearing, counts, point)
        if unstable == here.unstable:
            low, low_point, at_low = guess, point, value
            at_high *= 0.5 if side < 0 else 1.0
            side = -1
        else:
            high, high_point, at_high = guess, point, value
            at_low *= 0.5 if side > 0 else 1.0
            side = 1
    return moved(low_point, share, moved(high_point, -1.0, low_point))


@njit
def next_special_point(path, bearing, counts, here, high):
    """The next point at which the number of unstable directions changes, ahead of a `Spot`, below a fraction `high`.

    Returns what it is, the point (n+3,), its mode (n,), and a `Spot` past it. It is a fold where the fraction turns
    back: there the derivative of the residual by the fraction has a part along the mode; otherwise a bifurcation.
    """
    n = here.point.size - 3
    step = FIRST_STEP
    for _ in range(STEPS):
        there, used, step = advance(path, bearing, counts, here, min(step, LONGEST_STEP))
        if used == 0.0:
            break
        if there.unstable != here.unstable:
            point = pinpoint(path, bearing, counts, here, used, there.point)
            mode = null_mode(problem_at(path, bearing, point[n + 2], counts), point)
            if there.tangent[n + 2] * here.tangent[n + 2] > 0.0:
                return BIFURCATION_POINT, point, mode, there
            if product(mode, there.tangent[:n]) < 0.0:
                mode = moved(np.zeros(n), -1.0, mode)
            return FOLD_POINT, point, mode, there
        here = there
        if not -high < here.point[n + 2] < high:
            break
    return NO_POINT, here.point, np.zeros(n), here


@shipped(ControlPath, Bearing, Counts, float, Vector, Vector)
def lost_from(path, bearing, counts, fraction, phi, multipliers):
    """Where stability is lost after a fraction of the path at which there is a stable state near `phi (n,)`.

    Returns what `next_special_point` does, with the state at the fraction as the last: its `Spot`.
    """
    found, begin = begin_at(path, bearing, counts, fraction, phi, multipliers)
    if not found or begin.unstable != 0:
        return NO_POINT, begin.point, np.zeros(phi.size), begin
    what, point, mode, _ = next_special_point(path, bearing, counts, begin, 1.1 * BEYOND)
    return what, point, mode, begin


@shipped(ControlPath, float, float)
def part_of(path, begin, end):
    """The part of a path between two of its fractions, as a path."""
    poses = pose_at(path, begin), pose_at(path, end)
    return ControlPath(*poses, path.at, forces_at(path, begin), forces_at(path, end))


def critical(
    path: ControlPath, bearing: Bearing, phi: Array, multipliers: Array, tolerance: float = TOLERANCE
) -> SpecialPoint:
    """Where along a path the stable state `phi (n,)`, `multipliers (2,)` at its begin loses stability.

    Located to rounding on levels of halved edges, and extrapolated (Richardson) until the estimate of the error is
    below `tolerance` times the fraction. Never raises for numerical reasons: see `SpecialKind`.
    """
    far = part_of(path, 0.0, BEYOND)
    branch = follow(far, bearing, phi, multipliers)
    for _ in range(FINER_STARTS):
        if branch.fractions.size > 0:
            break
        # A state close to a fold may exist on finer edges alone.
        phi = refine_angles(problem_at(path, bearing, 0.0, counts_along(path, bearing, phi.size)), phi, 2)
        branch = follow(far, bearing, phi, multipliers)
    if branch.fractions.size == 0:
        return _without(path, bearing, SpecialKind.LOST, phi, multipliers)
    if branch.reached == 1.0:
        return _without(path, bearing, SpecialKind.NONE, phi, multipliers)
    levels, fraction, error = _extrapolated(
        _levels(path, bearing, BACK * BEYOND * branch.reached, phi, multipliers), tolerance
    )
    if len(levels) < LEAST_LEVELS:
        return _without(path, bearing, SpecialKind.LOST, phi, multipliers)
    if fraction > 1.0:
        return _without(path, bearing, SpecialKind.NONE, phi, multipliers)
    last = levels[-1]
    n = last.edges.size
    return SpecialPoint(
        SpecialKind.FOLD if last.what == FOLD_POINT else SpecialKind.BIFURCATION,
        fraction,
        error,
        float(last.point[-1]),
        last.edges,
        last.point[:n],
        last.point[n : n + 2],
        last.mode,
        tuple((each.edges.size, float(each.point[-1])) for each in levels),
    )


def _extrapolated(levels: Iterable[_Level], tolerance: float) -> tuple[list[_Level], float, float]:
    """As many levels as the `tolerance` takes, the fraction for vanishing edges, and the estimate of its error."""
    met: list[_Level] = []
    fraction, error = 0.0, np.inf
    change = np.inf
    for level in levels:
        met.append(level)
        if len(met) < 2:
            continue
        before, change_before = fraction, change
        change = level.point[-1] - met[-2].point[-1]
        fraction = level.point[-1] + change / 3.0
        if len(met) < LEAST_LEVELS:
            continue
        error = HONESTY * abs(fraction - before) + ROUNDING
        if abs(change) > 0.4 * abs(change_before) + ROUNDING:
            # Where halving the edges does not quarter the change, the extrapolation is not to be trusted.
            error = max(error, abs(change))
        if error <= tolerance * fraction:
            break
    return met, float(fraction), float(error)


def _levels(path: ControlPath, bearing: Bearing, begin: float, phi: Array, multipliers: Array) -> Iterator[_Level]:
    """The special point on levels of halved edges, each sought from the fraction `begin` on; ends where one fails."""
    reached, phi, multipliers, _ = travel(part_of(path, 0.0, begin), bearing, phi, multipliers)
    counts = counts_along(path, bearing, phi.size)
    begin *= reached
    for _ in range(LEVELS):
        what, point, mode, here = lost_from(path, bearing, counts, begin, phi, multipliers)
        if what == NO_POINT:
            return
        yield _Level(what, point, mode, cut(rod_at(path, bearing, point[-1]).at, counts))
        n = phi.size
        phi = refine_angles(problem_at(path, bearing, begin, counts), here.point[:n], 2)
        multipliers = here.point[n : n + 2].copy()
        counts = 2 * counts


def _without(path: ControlPath, bearing: Bearing, kind: SpecialKind, phi: Array, multipliers: Array) -> SpecialPoint:
    """No special point: the state as far as it can be followed."""
    reached, phi, multipliers, _ = travel(path, bearing, phi, multipliers)
    edges = cut(rod_at(path, bearing, reached).at, counts_along(path, bearing, phi.size))
    return SpecialPoint(kind, 1.0, 0.0, float(reached), edges, phi, multipliers, np.zeros(phi.size))


def falls(path: ControlPath, bearing: Bearing, point: SpecialPoint) -> tuple[FallOutcome, ...]:
    """Where the rod lands after a special point, nudged along its mode and against it; one outcome if that is the same.

    At a bifurcation both ways are as likely as each other; they may, or may not, lead into the same state.
    """
    at = point.reached * (1.0 + PAST)
    edges = cut(rod_at(path, bearing, at).at, counts_along(path, bearing, point.phi.size))
    both = [
        FallOutcome(bool(landed), at, edges, phi, multipliers)
        for landed, phi, multipliers in (
            land(path, at, bearing, point.phi, point.multipliers, sign * NUDGE * point.mode) for sign in (1.0, -1.0)
        )
    ]
    is_one = both[0].landed == both[1].landed and float(np.max(np.abs(both[0].phi - both[1].phi))) < SAME
    return tuple(both[:1] if is_one else both)
