"""Kernels of the planar rod, inextensible or not: Newton on the bordered system, descent, inertia.

The Hessian of the Lagrangian is tridiagonal, bordered by the k constraints, so that a Newton step costs O(n): L D L^T
by a forward sweep, the Schur complement of the constraints, a backward sweep. The signs of the pivots and of the Schur
complement give the inertia (Sylvester), hence the number of directions in which the rod is unstable.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from curveline.kernels.forms import Vector
from curveline.kernels.kernel import leaf, njit, shipped
from curveline.rod.planar.clamps import link, link_energies, mouth_shift
from curveline.rod.problem import (
    COSINE,
    FORWARD_HEIGHT,
    FORWARD_X,
    FORWARD_Y,
    GRADIENT,
    INVERSE,
    REACH,
    SINE,
    STEP,
    Problem,
    coefficients,
    copy_into,
    gives,
)
from curveline.rod.profile import TURN
from curveline.rod.trigonometry import sines_and_cosines

TINY = 1e-290

HALVINGS = 12
"""Of a step that does not lead downhill."""
STUCK = 2
"""Steps in succession that do not, however short, with which a descent ends."""
PENALTY = 1000.0
LEAST_SHIFT = 0.05
"""The step away from a saddle grows with curvature over shift, so the shift must not dwarf a weak instability."""


class Effort(NamedTuple):
    """How hard to try: the most an edge may turn per step [rad], the last step's size that ends it, iterations.

    The error after a full Newton step is of the order of its square, so `close` = 1e-7 leaves rounding only.
    """

    turn: float
    close: float
    iterations: int


@leaf
def eliminate(problem, phi, multipliers, shift):
    """Eliminate the tridiagonal Hessian of the Lagrangian at `phi (n,)`, `multipliers (k,)`.

    The Hessian is shifted by `shift` times the edge lengths. Leaves in the problem's room the gradient and the slopes
    of the constraints after the forward sweep, and the pivots' inverses. Returns the number of negative pivots; the
    Schur complement C H^-1 C^T, plus what the constraints give by stretching, as the numbers 00, 01, 11, 02, 12, 22;
    and its right-hand side (3,). A third constraint that is not there has a row of the unit matrix.
    """
    edges, stiffness, loads, height, targets, ends, compliance, _, _, rest, room = problem
    sines_and_cosines(phi, room[SINE], room[COSINE])
    n = phi.size
    is_high = multipliers.size == 3
    stretches = compliance[0] > 0.0
    push, lift, hold = multipliers[0], multipliers[1], multipliers[2] if is_high else 0.0
    miss_x, miss_y, miss_h = -targets[0], -targets[1], -targets[2] if is_high else 0.0
    xx = xy = yy = xh = yh = gx = gy = gh = 0.0
    hh = 0.0 if is_high else 1.0
    gradient = forward_x = forward_y = forward_h = 0.0
    inverse = 0.0
    negative = 0
    yields = gives(problem)
    start, end = ends[0], ends[1]
    soft_start = soft_end = 0.0
    if yields:
        start, soft_start = link(problem, phi, multipliers, 0)
        end, soft_end = link(problem, phi, multipliers, 1)
        for side in range(2):
            give, angle = (soft_start, start) if side == 0 else (soft_end, end)
            reach_x, reach_y = mouth_shift(problem, angle, side)
            slope_x, slope_y = -problem.clamps[REACH] * np.sin(angle), problem.clamps[REACH] * np.cos(angle)
            miss_x += reach_x
            miss_y += reach_y
            xx += give * slope_x * slope_x
            xy += give * slope_x * slope_y
            yy += give * slope_y * slope_y
    stiff, here = stiffness[0], phi[0]
    bend = (here - start - rest[TURN, 0]) * stiff
    for j in range(n):
        sine, cosine, edge = room[SINE, j], room[COSINE, j], edges[j]
        ahead, after = stiffness[j + 1], phi[j + 1] if j + 1 < n else end
        bend_ahead = (after - here - rest[TURN, j + 1]) * ahead
        along, across = loads[0, j] + push * edge, loads[1, j] + lift * edge
        reach_x, reach_y, reach_h = edge * cosine, edge * sine, 0.0
        slope_x, slope_y, slope_h = -reach_y, reach_x, 0.0
        if is_high:
            along += hold * height[0, j]
            across += hold * height[1, j]
            reach_h = height[0, j] * cosine + height[1, j] * sine
            slope_h = height[1, j] * cosine - height[0, j] * sine
        thrust, turning = along * cosine + across * sine, across * cosine - along * sine
        slope, diagonal = bend - bend_ahead + turning, stiff + ahead - thrust + shift * edge
        stretch = 1.0
        if stretches:
            give = compliance[j]
            stretch -= give * thrust
            slope -= give * thrust * turning
            diagonal += give * (thrust * thrust - turning * turning)
            slope_x = slope_x * stretch - give * turning * reach_x
            slope_y = slope_y * stretch - give * turning * reach_y
            slope_h = slope_h * stretch - give * turning * reach_h
            xx += give * reach_x * reach_x
            xy += give * reach_x * reach_y
            yy += give * reach_y * reach_y
            xh += give * reach_x * reach_h
            yh += give * reach_y * reach_h
            hh += give * reach_h * reach_h
        miss_x += reach_x * stretch
        miss_y += reach_y * stretch
        if yields and (j == 0 or j == n - 1):
            give, angle, rate = (soft_start, start, stiff) if j == 0 else (soft_end, end, ahead)
            diagonal -= give * rate * rate
            slope_x -= give * rate * problem.clamps[REACH] * np.sin(angle)
            slope_y += give * rate * problem.clamps[REACH] * np.cos(angle)
        # The recurrences hang on each other by one division an edge.
        ratio = -stiff * inverse
        diagonal += ratio * stiff
        if abs(diagonal) < TINY:
            diagonal = TINY
        if diagonal < 0.0:
            negative += 1
        inverse = 1.0 / diagonal
        gradient = slope - ratio * gradient
        forward_x = slope_x - ratio * forward_x
        forward_y = slope_y - ratio * forward_y
        room[INVERSE, j], room[GRADIENT, j] = inverse, gradient
        room[FORWARD_X, j], room[FORWARD_Y, j] = forward_x, forward_y
        by_x, by_y = forward_x * inverse, forward_y * inverse
        gx += by_x * gradient
        gy += by_y * gradient
        xx += by_x * forward_x
        xy += by_y * forward_x
        yy += by_y * forward_y
        if is_high:
            miss_h += reach_h * stretch
            forward_h = slope_h - ratio * forward_h
            room[FORWARD_HEIGHT, j] = forward_h
            by_h = forward_h * inverse
            gh += by_h * gradient
            xh += by_h * forward_x
            yh += by_h * forward_y
            hh += by_h * forward_h
        stiff, here, bend = ahead, after, bend_ahead
    return negative, (xx, xy, yy, xh, yh, hh), (miss_x - gx, miss_y - gy, miss_h - gh)


@leaf
def border_of(problem, schur):
    """The Schur complement of what is held, from the numbers of `eliminate`: what is not has rows of the unit matrix.

    Returns how many of its eigenvalues are negative, by the signs of its leading minors; its determinant; and the
    numbers 00, 01, 11, 02, 12, 22 of its adjugate.
    """
    x, y = problem.held[0], problem.held[1]
    xx, yy, hh = schur[0] * x + (1.0 - x), schur[2] * y + (1.0 - y), schur[5]
    xy, xh, yh = schur[1] * x * y, schur[3] * x, schur[4] * y
    first, across, corner = yy * hh - yh * yh, xh * yh - xy * hh, xy * yh - xh * yy
    minor = xx * yy - xy * xy
    determinant = xx * first + xy * across + xh * corner
    negative = 0
    if xx < 0.0:
        negative += 1
    if (minor < 0.0) != (xx < 0.0):
        negative += 1
    if (determinant < 0.0) != (minor < 0.0):
        negative += 1
    return negative, determinant, (first, across, xx * hh - xh * xh, corner, xy * xh - xx * yh, minor)


@leaf
def solve_border(problem, schur, right):
    """Solve the Schur complement of `eliminate` for the right-hand side (3,): the change (3,) of the multipliers.

    And how many of its eigenvalues are negative, where those of a stable rod are positive.
    """
    negative, determinant, (xx, xy, yy, xh, yh, hh) = border_of(problem, schur)
    over = 1.0 / determinant
    x, y, h = right[0] * problem.held[0] * over, right[1] * problem.held[1] * over, right[2] * over
    return negative, (xx * x + xy * y + xh * h, xy * x + yy * y + yh * h, xh * x + yh * y + hh * h)


@leaf
def substitute(problem, change):
    """Newton's step for the angles, left in the problem's room after `eliminate`, for a `change (3,)` of multipliers.

    Returns the largest turn of an edge.
    """
    room, stiffness = problem.room, problem.stiffness
    is_high = problem.targets.size == 3
    push, lift, hold = change
    following = turn = 0.0
    for j in range(problem.edges.size - 1, -1, -1):
        value = room[GRADIENT, j] + push * room[FORWARD_X, j] + lift * room[FORWARD_Y, j]
        if is_high:
            value += hold * room[FORWARD_HEIGHT, j]
        following = (stiffness[j + 1] * following - value) * room[INVERSE, j]
        room[STEP, j] = following
        turn = max(turn, abs(following))
    return turn


@leaf
def newton_step(problem, phi, multipliers, shift):
    """Newton's step at `phi (n,)`, `multipliers (k,)`, left in the problem's room, with the Hessian shifted.

    Returns the number of unstable directions there, the largest turn of an edge, the change (3,) of the multipliers.
    """
    negative, schur, right = eliminate(problem, phi, multipliers, shift)
    wrong, change = solve_border(problem, schur, right)
    turn = substitute(problem, change)
    # NaN is lost in a maximum, not in the last of a chain of substitutions.
    if not np.isfinite(problem.room[STEP, 0]):
        turn = np.inf
    return negative - wrong, turn, change


@leaf
def move_by(problem, phi, scale):
    """Add `scale` times the step in the problem's room to the angles `phi (n,)`."""
    for j in range(phi.size):
        phi[j] += scale * problem.room[STEP, j]


@shipped(Problem, Vector, Vector, Effort)
@leaf
def newton(problem, phi, multipliers, effort):
    """Find an equilibrium, stable or not, from `phi (n,)`, `multipliers (k,)`, both overwritten.

    Full Newton steps, shortened where an edge would turn by more than the effort allows. Returns the iterations
    used (negative if they ran out) and the number of unstable directions at the equilibrium.
    """
    for iteration in range(1, effort.iterations + 1):
        unstable, turn, change = newton_step(problem, phi, multipliers, 0.0)
        if not np.isfinite(turn):
            return -iteration, -1
        scale = 1.0 if turn <= effort.turn else effort.turn / turn
        move_by(problem, phi, scale)
        for a in range(multipliers.size):
            multipliers[a] += scale * change[a]
        if turn < effort.close:
            return iteration, unstable
    return -effort.iterations, -1


@njit
def lean(problem, phi, multipliers):
    """How an equilibrium under a third constraint moves with its target: d phi (n,), d multipliers (3,) by it."""
    _, schur, _ = eliminate(problem, phi, multipliers, 0.0)
    # Newton's step once more, for a gradient that vanishes and a constraint that misses its target by one.
    for j in range(phi.size):
        problem.room[GRADIENT, j] = 0.0
    _, change = solve_border(problem, schur, (0.0, 0.0, -1.0))
    substitute(problem, change)
    return problem.room[STEP].copy(), change


@leaf
def thrust_on(problem, phi, multipliers, j):
    """Thrust on edge `j` times its length, from loads and constraints: its strain over minus its compliance."""
    along, across = coefficients(problem, multipliers, j)
    return along * np.cos(phi[j]) + across * np.sin(phi[j])


@leaf
def energy(problem, phi, multipliers):
    """Energy of bending and stretching plus load potential at `phi (n,)`; the `multipliers (k,)` set the strains."""
    return energy_and_gaps(problem, phi, multipliers)[0]


@leaf
def energy_and_gaps(problem, phi, multipliers):
    """The `energy`, and (3,) how far the constraints are from their targets, 0 for one that is not there."""
    edges, stiffness, loads, height, targets, ends, compliance, held, _, rest, room = problem
    sines_and_cosines(phi, room[SINE], room[COSINE])
    n = phi.size
    is_high = multipliers.size == 3
    stretches = compliance[0] > 0.0
    miss_x, miss_y, miss_h = -targets[0], -targets[1], -targets[2] if is_high else 0.0
    total = 0.0
    before, end = ends[0], ends[1]
    if gives(problem):
        before, end = link(problem, phi, multipliers, 0)[0], link(problem, phi, multipliers, 1)[0]
        for side in range(2):
            strained, potential = link_energies(problem, end if side else before, side)
            x, y = mouth_shift(problem, end if side else before, side)
            total += strained + potential
            miss_x += x
            miss_y += y
    for j in range(n):
        sine, cosine, edge = room[SINE, j], room[COSINE, j], edges[j]
        turn = phi[j] - before - rest[TURN, j]
        potential = loads[0, j] * cosine + loads[1, j] * sine
        total += 0.5 * turn * turn * stiffness[j] + potential
        stretch = 1.0
        if stretches:
            along, across = coefficients(problem, multipliers, j)
            thrust = along * cosine + across * sine
            total += compliance[j] * thrust * (0.5 * thrust - potential)
            stretch -= compliance[j] * thrust
        miss_x += edge * cosine * stretch
        miss_y += edge * sine * stretch
        if is_high:
            miss_h += (height[0, j] * cosine + height[1, j] * sine) * stretch
        before = phi[j]
    turn = end - before - rest[TURN, n]
    return total + 0.5 * turn * turn * stiffness[n], (miss_x * held[0], miss_y * held[1], miss_h)


@leaf
def merit(problem, phi, multipliers):
    """Augmented Lagrangian at `phi (n,)`: what a descent step must lower.

    An exact penalty would refuse steps along a weak instability: they leave the constraints by as much, to second
    order, as they lower the energy (the Maratos effect).
    """
    total, gaps = energy_and_gaps(problem, phi, multipliers)
    for a in range(multipliers.size):
        total += multipliers[a] * gaps[a] + 0.5 * PENALTY * gaps[a] * gaps[a]
    return total


@shipped(Problem, Vector, Vector, Effort)
def descend(problem, phi, multipliers, effort):
    """Go downhill from `phi (n,)` to a stable equilibrium, as `way_down` says; returns the iterations it gives."""
    return way_down(problem, phi, multipliers, effort)[0]


@njit
def way_down(problem, phi, multipliers, effort):
    """Go downhill from `phi (n,)` to a stable equilibrium; `phi` and `multipliers (k,)` are overwritten.

    Newton on the bordered system with the Hessian shifted until it is positive definite on the constraints, a bound on
    how far an edge turns per step, and a line search on an augmented Lagrangian (Nocedal and Wright 2006, ch. 17).
    Returns the iterations used, negative if they ran out or no step, however short, leads downhill any more; and the
    longest step [rad] if all were Newton's own, unshifted and not shortened, inf if not.
    """
    trial, target = np.empty(phi.size), np.empty(multipliers.size)
    shift = 0.0
    stuck = 0
    longest = 0.0
    for iteration in range(1, effort.iterations + 1):
        shift = 0.0 if shift < LEAST_SHIFT else 0.25 * shift
        for _ in range(40):
            unstable, turn, change = newton_step(problem, phi, multipliers, shift)
            if unstable == 0:
                break
            shift = max(LEAST_SHIFT, 4.0 * shift)
        if not np.isfinite(turn):
            return -iteration, np.inf
        scale = 1.0 if turn <= effort.turn else effort.turn / turn
        if turn > 0.05 or shift > 0.0:
            for a in range(multipliers.size):
                target[a] = multipliers[a] + change[a]
            start = merit(problem, phi, target)
            for _ in range(HALVINGS):
                copy_into(trial, phi)
                move_by(problem, trial, scale)
                if merit(problem, trial, target) < start:
                    stuck = 0
                    break
                scale *= 0.5
            else:
                stuck += 1
                if stuck == STUCK:
                    return -iteration, np.inf
        longest = max(longest, turn) if scale == 1.0 and shift == 0.0 else np.inf
        move_by(problem, phi, scale)
        for a in range(multipliers.size):
            multipliers[a] += scale * change[a]
        if turn < effort.close and shift == 0.0:
            return iteration, longest
    return -effort.iterations, np.inf
