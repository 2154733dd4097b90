"""Trace an equilibrium along a path, stable or not, by pseudo-arclength: the fraction may turn back at folds.

A point of a branch is a vector (n+3,): angles, both multipliers, fraction of the path. A step leads along the tangent
and back to the branch across it (Keller 1977: pseudo-arclength continuation), so that folds are points like any other.
The Hessian of the Lagrangian, bordered by the constraints, is singular at a fold, but its tridiagonal part is generally
not: that is eliminated in O(n), and what is left, multipliers and fraction, is a dense 3 x 3 system with pivoting.

    track = trace(path, bearing, *start_along(path, state), reach)      # Reach(low, high, step, records)
    track.fractions, track.unstable, track.lowest, track.phi, track.multipliers
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from curveline.kernels.forms import Vector
from curveline.kernels.kernel import njit, shipped
from curveline.rod.branches.control_path import ControlPath, counts_along, problem_at
from curveline.rod.planar.clamps import link, mouth_shift
from curveline.rod.planar.modes import from_zero, lowest_eigenvalue, modes_below, second_variation
from curveline.rod.planar.newton import TINY, Effort, newton
from curveline.rod.problem import COSINE, SINE, Array, Bearing, coefficients, copy_into, gives
from curveline.rod.profile import TURN
from curveline.rod.trigonometry import sines_and_cosines

CORRECT = Effort(turn=0.3, close=1e-7, iterations=8)
BEGIN = Effort(turn=0.2, close=1e-7, iterations=25)

DIFFERENCE = 1e-4
"""Fraction of the path by which the residual is differenced."""

FIRST_STEP = 0.02
LONGEST_STEP = 0.1
SMALLEST_STEP = 1e-4
"""Arc length to which the crossing of two branches is told from one that passes by: imperfections of relative size e
keep them about e^(1/3) apart."""
LOST_STEP = 1e-9

STRAIGHTEST = 0.95
"""Least cosine between the tangents at both ends of a step: a sharper turn is taken in shorter steps."""
EASY = 0.99


class TraceReach(NamedTuple):
    """How far to trace: the fractions `low` and `high` beyond which to stop, the longest step, the most records.

    Steps are counted in the root mean square of the edges' turn [rad] and the fraction of the path.
    """

    low: float = -0.01
    high: float = 1.0
    step: float = LONGEST_STEP
    records: int = 400


class Track(NamedTuple):
    """A traced branch, a record per step: fraction of the path, unstable directions, lowest eigenvalue [EI/L^2].

    `phi (m, n)` and `multipliers (m, 2)` hold the states.
    """

    fractions: Array
    unstable: Array
    lowest: Array
    phi: Array
    multipliers: Array


class Spot(NamedTuple):
    """A point (n+3,) of a branch, the unit tangent (n+3,) there in the direction of travel, the unstable directions."""

    point: Array
    tangent: Array
    unstable: int


@njit
def residual(problem, point):
    """Slopes of the Lagrangian by angles and multipliers, (n+2,), at a `point (n+3,)`: zero at an equilibrium."""
    n = problem.edges.size
    out = np.empty(n + 2)
    for a in range(2):
        out[n + a] = -problem.targets[a]
    before, end = problem.ends[0], problem.ends[1]
    if gives(problem):
        for side in range(2):
            angle, _ = link(problem, point[:n], point[n : n + 2], side)
            out[n : n + 2] += np.array(mouth_shift(problem, angle, side))
            before, end = (angle, end) if side == 0 else (before, angle)
    sines_and_cosines(point[:n], problem.room[SINE], problem.room[COSINE])
    for j in range(n):
        cosine, sine = problem.room[COSINE, j], problem.room[SINE, j]
        along, across = coefficients(problem, point[n : n + 2], j)
        stretch = 1.0 - problem.compliance[j] * (along * cosine + across * sine)
        after = point[j + 1] if j + 1 < n else end
        turned, ahead = point[j] - before - problem.rest[TURN, j], after - point[j] - problem.rest[TURN, j + 1]
        bends = turned * problem.stiffness[j] - ahead * problem.stiffness[j + 1]
        out[j] = bends + (across * cosine - along * sine) * stretch
        out[n] += problem.edges[j] * cosine * stretch
        out[n + 1] += problem.edges[j] * sine * stretch
        before = point[j]
    return out


@njit
def slope_along(path, bearing, counts, point):
    """Derivative (n+2,) of the residual by the fraction of the path.

    By central differences: it turns steps and tangents, whose errors the next iteration takes out, but moves no point
    of the branch; so its truncation does no harm, and a wide difference keeps rounding low.
    """
    out = np.zeros(point.size - 1)
    for sign in (-1.0, 1.0):
        there = residual(problem_at(path, bearing, point[out.size] + sign * DIFFERENCE, counts), point)
        for i in range(out.size):
            out[i] += sign * there[i] / (2.0 * DIFFERENCE)
    return out


@njit
def solve_small(matrix, vector):
    """Solve the k x k system in place by elimination with row pivoting; the solution replaces `vector (k,)`."""
    k = vector.size
    for i in range(k):
        best = i
        for r in range(i + 1, k):
            if abs(matrix[r, i]) > abs(matrix[best, i]):
                best = r
        if best != i:
            for c in range(k):
                matrix[i, c], matrix[best, c] = matrix[best, c], matrix[i, c]
            vector[i], vector[best] = vector[best], vector[i]
        if abs(matrix[i, i]) < TINY:
            matrix[i, i] = TINY
        for r in range(i + 1, k):
            factor = matrix[r, i] / matrix[i, i]
            for c in range(i, k):
                matrix[r, c] -= factor * matrix[i, c]
            vector[r] -= factor * vector[i]
    for i in range(k - 1, -1, -1):
        for c in range(i + 1, k):
            vector[i] -= matrix[i, c] * vector[c]
        vector[i] /= matrix[i, i]


@njit
def solve_bordered(problem, variation, slope, row, right):
    """The change (n+3,) of a point that changes the residual by `right[:n+2]` and whose product with `row` is the last.

    `variation` is `second_variation` there, `slope (n+2,)` the residual's derivative by the fraction. The tridiagonal
    part is swept for four right-hand sides at once: the residual's, both constraints', the slope's.
    """
    diagonal, border, corner = variation
    n = diagonal.size
    sides = np.empty((4, n))
    pivots = np.empty(n)
    for j in range(n):
        sides[0, j], sides[1, j], sides[2, j], sides[3, j] = right[j], border[0, j], border[1, j], slope[j]
        pivots[j] = diagonal[j]
        if j > 0:
            ratio = -problem.stiffness[j] / pivots[j - 1]
            pivots[j] += ratio * problem.stiffness[j]
            for side in range(4):
                sides[side, j] -= ratio * sides[side, j - 1]
        if abs(pivots[j]) < TINY:
            pivots[j] = TINY
    for j in range(n - 1, -1, -1):
        for side in range(4):
            if j + 1 < n:
                sides[side, j] += problem.stiffness[j + 1] * sides[side, j + 1]
            sides[side, j] /= pivots[j]
    matrix = np.zeros((3, 3))
    vector = np.empty(3)
    copy_into(vector, right[n:])
    for a in range(3):
        for b in range(2):
            matrix[a, b] = -corner[a, b] if a < 2 else row[n + b]
        matrix[a, 2] = slope[n + a] if a < 2 else row[n + 2]
        for j in range(n):
            factor = border[a, j] if a < 2 else row[j]
            vector[a] -= factor * sides[0, j]
            for b in range(3):
                matrix[a, b] -= factor * sides[1 + b, j]
    solve_small(matrix, vector)
    out = np.empty(n + 3)
    for j in range(n):
        out[j] = sides[0, j] - vector[0] * sides[1, j] - vector[1] * sides[2, j] - vector[2] * sides[3, j]
    copy_into(out[n:], vector)
    return out


@njit
def weighted(edges, vector):
    """The covector (n+3,) of a change of a point: its product with another is their inner product.

    Angles count by the lengths of their edges, so that halving those changes nothing; multipliers do not count.
    """
    n = edges.size
    out = np.zeros(n + 3)
    for j in range(n):
        out[j] = edges[j] * vector[j]
    out[n + 2] = vector[n + 2]
    return out


@njit
def moved(point, size, change):
    """A point (n+3,) moved by `size` times a change (n+3,)."""
    out = np.empty(point.size)
    for i in range(point.size):
        out[i] = point[i] + size * change[i]
    return out


@njit
def product(one, other):
    """Sum of the products of two vectors (n,)."""
    total = 0.0
    for j in range(one.size):
        total += one[j] * other[j]
    return total


@njit
def back_to_branch(path, bearing, counts, here, ahead):
    """The point (n+3,) of the branch that is `ahead` of a `Spot` along its tangent, and the iterations used.

    They are negative where there is none.
    """
    n = here.point.size - 3
    point = moved(here.point, ahead, here.tangent)
    row = weighted(problem_at(path, bearing, here.point[n + 2], counts).edges, here.tangent)
    right = np.empty(n + 3)
    for iteration in range(1, CORRECT.iterations + 1):
        problem = problem_at(path, bearing, point[n + 2], counts)
        gap = residual(problem, point)
        for i in range(n + 2):
            right[i] = -gap[i]
        right[n + 2] = ahead - product(row, moved(point, -1.0, here.point))
        variation = second_variation(problem, point[:n], point[n : n + 2])
        change = solve_bordered(problem, variation, slope_along(path, bearing, counts, point), row, right)
        turn = 0.0
        for j in range(n):
            turn = max(turn, abs(change[j]))
        if not (turn < CORRECT.turn and np.isfinite(product(change, change))):
            return point, -iteration
        point = moved(point, 1.0, change)
        if turn < CORRECT.close:
            return point, iteration
    return point, -CORRECT.iterations


@njit
def tangent_at(path, bearing, counts, point, before):
    """The unit tangent (n+3,) of the branch at a point, in the direction of `before (n+3,)`."""
    n = point.size - 3
    problem = problem_at(path, bearing, point[n + 2], counts)
    variation = second_variation(problem, point[:n], point[n : n + 2])
    right = np.zeros(n + 3)
    right[n + 2] = 1.0
    slope = slope_along(path, bearing, counts, point)
    out = solve_bordered(problem, variation, slope, weighted(problem.edges, before), right)
    return moved(np.zeros(n + 3), 1.0 / np.sqrt(product(weighted(problem.edges, out), out)), out)


@njit
def unstable_at(path, bearing, counts, point):
    """Number of unstable directions at a point of a branch."""
    n = point.size - 3
    problem = problem_at(path, bearing, point[n + 2], counts)
    return modes_below(problem, second_variation(problem, point[:n], point[n : n + 2]), 0.0)


@njit
def begin_at(path, bearing, counts, fraction, phi, multipliers):
    """The `Spot` at a fraction of the path near `phi (n,)`, `multipliers (2,)`, to be left forwards; False if none."""
    n = phi.size
    point = np.empty(n + 3)
    before = np.zeros(n + 3)
    before[n + 2] = 1.0
    angles, force = phi.copy(), multipliers.copy()
    iterations = 0
    unstable = -1
    if counts.sum() == n:
        iterations, unstable = newton(problem_at(path, bearing, fraction, counts), angles, force, BEGIN)
    copy_into(point[:n], angles)
    copy_into(point[n : n + 2], force)
    point[n + 2] = fraction
    if iterations <= 0:
        return False, Spot(point, before, unstable)
    return True, Spot(point, tangent_at(path, bearing, counts, point, before), unstable)


@njit
def advance(path, bearing, counts, here, step):
    """The next `Spot` of a branch, the step (arc length) that led there, and the next one to try; step 0 if none.

    A step is halved where Newton fails or the tangents turn too far. Along a branch the fraction turns back just where
    the number of unstable directions changes by one (both change the sign of a determinant; Keller 1977). Where only
    one of the two happens, the step has jumped to another branch, or has passed a crossing with one: shorter steps
    tell, down to `SMALLEST_STEP`.
    """
    n = here.point.size - 3
    while step > LOST_STEP:
        point, iterations = back_to_branch(path, bearing, counts, here, step)
        if iterations > 0:
            tangent = tangent_at(path, bearing, counts, point, here.tangent)
            edges = problem_at(path, bearing, point[n + 2], counts).edges
            cosine = product(weighted(edges, tangent), here.tangent)
            unstable = unstable_at(path, bearing, counts, point)
            turns_back = tangent[n + 2] * here.tangent[n + 2] < 0.0
            regular = turns_back == ((unstable - here.unstable) % 2 != 0)
            if cosine > STRAIGHTEST and (regular or step <= SMALLEST_STEP):
                growth = 1.5 if iterations <= 4 and cosine > EASY else 1.0
                return Spot(point, tangent, unstable), step, growth * step
        step *= 0.5
    return here, 0.0, 0.0


@shipped(ControlPath, Bearing, Vector, Vector, TraceReach)
def trace(path, bearing, phi, multipliers, reach):
    """Trace the branch of the equilibrium `phi (n,)`, `multipliers (2,)`, stable or not, from the begin of a path.

    Ends where the fraction leaves the bounds of the `TraceReach`, after its most records, or where no step succeeds.
    """
    n = phi.size
    counts = counts_along(path, bearing, n)
    table = np.empty((reach.records, n + 5))
    count = 0
    found, here = begin_at(path, bearing, counts, 0.0, phi, multipliers)
    step = FIRST_STEP if found else 0.0
    while count < reach.records and found:
        problem = problem_at(path, bearing, here.point[n + 2], counts)
        copy_into(table[count, : n + 3], here.point)
        table[count, n + 3] = here.unstable
        table[count, n + 4] = lowest_eigenvalue(problem, here.point[:n], here.point[n : n + 2], from_zero(), 1e-6)
        count += 1
        here, used, step = advance(path, bearing, counts, here, min(step, reach.step))
        found = used > 0.0 and reach.low <= table[count - 1, n + 2] <= reach.high
    rows = table[:count]
    return Track(
        rows[:, n + 2].copy(),
        rows[:, n + 3].copy(),
        rows[:, n + 4].copy(),
        rows[:, :n].copy(),
        rows[:, n : n + 2].copy(),
    )
