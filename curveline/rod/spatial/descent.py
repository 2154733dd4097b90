"""Kernels of the relaxation in space: Newton's system, its steps, and the descent to a stable equilibrium.

An edge turns and stretches by what a step says to first order, see `spatial.moved`, so that even a rod that hardly
stretches takes long steps; the last vertex then misses its place by the step's square, which the next step takes into
account.
"""

from __future__ import annotations

import numpy as np

from curveline.kernels.forms import Matrix, Vector
from curveline.kernels.kernel import njit, shipped
from curveline.rod.spatial.bands import factorise, solve_factored, times
from curveline.rod.spatial.energy import (
    BAND,
    Shape,
    SpatialRod,
    assemble,
    energy,
    follow_turns,
    metric,
    moved,
    positions,
)

RESIDUAL = 1e-10
"""Largest force that is left over, relative to the largest of the forces that balance."""
ROUNDING = 1e-15
"""Of the moments' force on a vertex, what rounding leaves over."""
PENALTY = 1000.0
NEUTRAL = 1e-6
"""Eigenvalues [EI / L^2] no further below zero are of motions that cost nothing, such as turning a round rod's arch."""
CANCELLED = 2e-17
"""Of the Hessian's entries, what rounding makes of the lowest eigenvalue."""
LEAST_SHIFT = 0.05
SHIFTS = 40
TURN = 0.5
"""Largest turn of an edge in a step [rad]."""
SMOOTHING = 1000.0
"""Shift at which half of the last vertex's gap is closed in a step."""
SMALL = 0.02
"""Turn [rad] below which a step needs no line search."""
SHORTENINGS = 14
SETTLED, EXHAUSTED, BROKEN = 0, 1, 2
"""How a descent ends."""


@shipped(SpatialRod)
def neutral_of(rod):
    """How far below zero an eigenvalue may be to count as zero."""
    n = rod.edges.size
    bending = max(rod.stiffness[0], rod.stiffness[1])
    return NEUTRAL + CANCELLED * n * (rod.stiffness[3] + 10.0 * n * n * bending)


@shipped(SpatialRod)
def free_of(rod):
    """First and last but one of the unknowns that are free; the first vertex is held, the last one as the rod says."""
    size = 4 * rod.edges.size + 3
    return 3, size - 3 if rod.held[1] > 0.0 else size


@njit
def gap_of(rod, shape):
    """How far (3,) the last vertex is from its place; nothing if it is free."""
    gap = np.zeros(3)
    if rod.held[1] > 0.0:
        last = positions(rod, shape)[-1]
        for axis in range(3):
            gap[axis] = rod.chord[axis] - last[axis]
    return gap


@njit
def reaction_of(rod, gradient):
    """The force (3,) on the last vertex that most of the rod asks for, by the `gradient (4n+3,)` of `assemble`.

    At equilibrium every edge asks for the same. Before, the median is least disturbed by kinks, whose forces are of the
    order of the number of vertices squared.
    """
    n = rod.edges.size
    out, beyond = np.zeros(3), np.empty(n)
    for axis in range(3 if rod.held[1] > 0.0 else 0):
        total = 0.0
        for j in range(n - 1, -1, -1):
            total += gradient[4 * j + 4 + axis]
            beyond[j] = total
        asked = np.sort(beyond)
        out[axis] = 0.5 * (asked[(n - 1) // 2] + asked[n // 2])
    return out


@shipped(SpatialRod, Shape)
def newton_system(rod, shape):
    """Gradient (4n+3,), band (4n+3, 11) of the Hessian of `moved`, and gap (3,) of the last vertex at `shape`."""
    gradient, band = assemble(rod, shape)
    follow_turns(rod, shape, gradient, reaction_of(rod, gradient), band)
    return gradient, band, gap_of(rod, shape)


@shipped(SpatialRod, Vector, Vector)
def left_over(rod, gradient, gap):
    """Largest force left over, over the largest force that an edge passes on, and what rounding alone may leave."""
    n = rod.edges.size
    scale = 1.0
    for axis in range(3):
        total = 0.0
        for j in range(n - 1, -1, -1):
            total += gradient[4 * j + 4 + axis] + rod.forces[j + 1, axis]
            scale = max(scale, abs(total))
    begin, end = free_of(rod)
    left = 0.0
    for i in range(begin, end):
        if not abs(gradient[i]) < np.inf:
            return np.nan, 0.0
        left = max(left, abs(gradient[i]))
    for axis in range(3):
        left = max(left, abs(gap[axis]) * scale)
    stiffest = max(rod.stiffness[0], max(rod.stiffness[1], rod.stiffness[2]))
    return left / scale, ROUNDING * n * stiffest / scale


@shipped(Matrix, Matrix, float, tuple[int, int])
def shifted(band, weights, shift, bounds):
    """The free part (N, 11) of `band` plus `shift` times that of `weights`."""
    begin, end = bounds
    out = np.empty((end - begin, BAND))
    for r in range(end - begin):
        for k in range(BAND):
            out[r, k] = band[begin + r, k] + shift * weights[begin + r, k]
    return out


@shipped(Matrix, Matrix, float, tuple[int, int])
def definite(band, weights, shift, bounds):
    """Factor of the free part of `band`, shifted by the least multiple of `weights` that does, the shift, and if any.

    Shifts are `shift`, `LEAST_SHIFT` if that is more, and four times the one before.
    """
    factor = shifted(band, weights, shift, bounds)
    for _ in range(SHIFTS):
        if factorise(factor):
            return factor, shift, True
        shift = max(LEAST_SHIFT, 4.0 * shift)
        factor = shifted(band, weights, shift, bounds)
    return factor, shift, False


@shipped(SpatialRod, Vector, Matrix, Vector)
def right_sides(rod, gradient, band, gap):
    """Right-hand sides (2, N): minus the gradient, and what moving the last vertex to its place asks of the others."""
    begin, end = free_of(rod)
    last = np.zeros(gradient.size)
    if rod.held[1] > 0.0:
        last[-3:] = gap
    asked = times(band, last)
    right = np.empty((2, end - begin))
    for i in range(begin, end):
        right[0, i - begin] = -gradient[i]
        right[1, i - begin] = -asked[i]
    return right


@shipped(SpatialRod, Shape, Vector, Matrix)
def joined(rod, shape, gap, solutions):
    """The step (4n+3,) from both `solutions (2, N)`: of the second, as much as turns no edge by more than `TURN`."""
    begin, end = free_of(rod)
    step = np.zeros(4 * rod.edges.size + 3)
    if rod.held[1] > 0.0:
        step[begin:end] = solutions[1]
        step[-3:] = gap
        _, turn = moved(rod, shape, step, 1.0)
        if turn > TURN:
            step *= TURN / turn
    step[begin:end] += solutions[0]
    return step


@shipped(SpatialRod, Shape, Vector)
def bounded(rod, shape, step):
    """The shape after as much of the step as turns no edge by more than `TURN`, how much, and the whole step's turn."""
    whole, turn = moved(rod, shape, step, 1.0)
    if turn <= TURN:
        return whole, 1.0, turn
    part, _ = moved(rod, shape, step, TURN / turn)
    return part, TURN / turn, turn


@njit
def merit(rod, shape, force):
    """Energy, plus the `force (3,)` on the last vertex times how far it is from its place, plus a penalty on that."""
    gap = gap_of(rod, shape)
    total = energy(rod, shape)
    for axis in range(3):
        total += force[axis] * gap[axis] + 0.5 * PENALTY * gap[axis] ** 2
    return total


@njit
def searched(rod, shape, step, force):
    """The shape after as much of the step as lowers the augmented Lagrangian, and if any of it did.

    `force (3,)` is that on the last vertex after the step, to first order: the multiplier of its place.
    """
    trial, scale, turn = bounded(rod, shape, step)
    if turn < SMALL:
        return trial, True
    start = merit(rod, shape, force)
    for _ in range(SHORTENINGS):
        if merit(rod, trial, force) < start:
            return trial, True
        scale *= 0.5
        trial, _ = moved(rod, shape, step, scale)
    return trial, False


@njit
def force_after(rod, gradient, band, step):
    """The force (3,) on the last vertex after a `step (4n+3,)`, to first order; none if it is free."""
    if rod.held[1] > 0.0:
        return (gradient + times(band, step))[-3:]
    return np.zeros(3)


@shipped(SpatialRod, Shape, int)
def descend_from(rod, shape, iterations):
    """Shape, how it ended, iterations and force left over of a descent from `shape`: see `relax.descend`."""
    weights, least, bounds = metric(rod), neutral_of(rod), free_of(rod)
    shift = least
    residual = np.inf
    for iteration in range(1, iterations + 1):
        gradient, band, gap = newton_system(rod, shape)
        residual, floor = left_over(rod, gradient, gap)
        if not residual < np.inf:
            return shape, BROKEN, iteration, residual
        factor, shift, is_definite = definite(band, weights, shift, bounds)
        if not is_definite:
            return shape, BROKEN, iteration, residual
        if shift == least and residual <= max(RESIDUAL, floor):
            return shape, SETTLED, iteration, residual
        # While kinks make the rod unstable, they are smoothed first: a stiffened rod closes its gap by a new kink.
        gap /= 1.0 + shift / SMOOTHING
        right = right_sides(rod, gradient, band, gap)
        for side in range(2):
            right[side] = solve_factored(factor, right[side])
        step = joined(rod, shape, gap, right)
        shape, found = searched(rod, shape, step, force_after(rod, gradient, band, step))
        relief = 0.25 * shift if shift > LEAST_SHIFT else least
        shift = relief if found else 4.0 * max(shift, LEAST_SHIFT)
    return shape, EXHAUSTED, iterations, residual
