"""Kernels of the relaxation in space: Newton's system, its steps, and the descent to a stable equilibrium.

An edge turns and stretches by what a step says to first order, see `spatial.moved`, so that even a rod that hardly
stretches takes long steps; the last vertex then misses its place by the step's square, which the next step takes into
account.
"""

from __future__ import annotations

import numpy as np

from curveline.kernels.forms import Matrix
from curveline.kernels.kernel import leaf, njit, shipped
from curveline.rod.spatial.bands import factorise
from curveline.rod.spatial.bordered import (
    advance,
    balance,
    lagrangian,
    left_over,
    solve_border,
    sweep_backward,
    sweep_forward,
)
from curveline.rod.spatial.energy import BAND, Shape, SpatialRod
from curveline.rod.spatial.reaction import first_reaction, passed_on, strains, tilts_of, turns_of

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
BESIDE, ALIKE = 1e-4, 1e-9
"""Largest force that is left over, relative, and half the square of half the turn of an edge [rad], at which a descent
is beside a shape that is known."""
CALM, RISE = 0.1, 3.0
"""Largest force that is left over, relative, and by how much more there is then, where a descent has passed a state."""
SETTLED, EXHAUSTED, BROKEN, KNOWN = 0, 1, 2, 3
"""How a descent ends."""


@leaf
def floor_of(rod):
    """What rounding leaves over of the forces."""
    return ROUNDING * rod.edges.size * max(rod.stiffness[0], max(rod.stiffness[1], rod.stiffness[2]))


@shipped(SpatialRod)
@leaf
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


@njit
def room_for(n):
    """Arrays for the bordered system of n edges and for its factor, see `bordered`."""
    system = np.empty((n, 3, 3)), np.empty((n, 3, 3)), np.empty((n, 3, 4))
    factor = np.empty((n, 3)), np.empty((n, 3)), np.empty((n, 3, 3)), np.empty((n, 3, 4)), np.empty((n, 3))
    return system, factor


@njit
def factored(rod, system, shift, factor, give, complement):
    """Factor a bordered system that is shifted; True if what the border allows is a minimum."""
    for r in range(3):
        complement[r, 0] = 0.0
        for c in range(3):
            complement[r, 1 + c] = give[r, c]
    negative = sweep_forward(system, rod.edges, shift, factor, complement)
    if rod.held[1] == 0.0:
        return negative == 0
    return negative + solve_border(complement, np.zeros(3)) == 3


@njit
def newton_step(rod, factor, complement, gap, step, change):
    """Overwrite the turns `step (n, 3)` and the reaction's `change (3,)`: Newton's step, closing the gap by a part.

    Of what closes the `gap (3,)`, as much as turns no edge by more than `TURN`.
    """
    shares, asked, beside = np.zeros((2, 4)), np.zeros(3), factor[4]
    for axis in range(3):
        asked[axis] = complement[axis, 0]
        change[axis] = 0.0
    shares[0, 0] = 1.0
    if rod.held[1] == 0.0:
        sweep_backward(factor, shares, step)
        return
    solve_border(complement, asked)
    for axis in range(3):
        change[axis] = -gap[axis]
        shares[0, 1 + axis] = -asked[axis]
    solve_border(complement, change)
    for axis in range(3):
        shares[1, 1 + axis] = -change[axis]
    sweep_backward(factor, shares, step)
    turn = largest(beside)
    part = TURN / turn if turn > TURN else 1.0
    for axis in range(3):
        change[axis] = asked[axis] + part * change[axis]
        for j in range(step.shape[0]):
            step[j, axis] += part * beside[j, axis]


@leaf
def largest(step):
    """The largest of the turns (n, 3)."""
    most = 0.0
    for j in range(step.shape[0]):
        most = max(most, step[j, 0] ** 2 + step[j, 1] ** 2 + step[j, 2] ** 2)
    return np.sqrt(most)


@njit
def searched(rod, frames, turns, step, reaction, after, turns_after):
    """Go as far along a step as lowers the augmented Lagrangian, and turns no edge by more than `TURN`; True if any."""
    turn = largest(step)
    scale = TURN / turn if turn > TURN else 1.0
    advance(rod, frames, turns, step, scale, after, turns_after)
    if turn < SMALL:
        return True
    start = lagrangian(rod, frames, turns, reaction, PENALTY)
    for _ in range(SHORTENINGS):
        if lagrangian(rod, after, turns_after, reaction, PENALTY) < start:
            return True
        scale *= 0.5
        advance(rod, frames, turns, step, scale, after, turns_after)
    return False


@leaf
def is_known(frames, known, alike):
    """True if frames (n, 4) are those of one of the shapes `known (k, n, 4)`, but for turns that are `alike`."""
    for k in range(known.shape[0]):
        farthest = 0.0
        for j in range(frames.shape[0]):
            product = 0.0
            for r in range(4):
                product += frames[j, r] * known[k, j, r]
            farthest = max(farthest, 1.0 - abs(product))
            if farthest > alike:
                break
        if farthest <= alike:
            return True
    return False


@njit
def begun(rod, shape):
    """What a relaxation from `shape` begins with: its frames, rotations at the vertices and reaction, and room.

    There is room for frames and rotations after a step, for the step and the forces passed on; for the bordered system
    and its factor; and for the gap, what the border gives, the complement and the reaction's change.
    """
    n = rod.edges.size
    turns = turns_of(rod, shape)
    state = shape.frames.copy(), turns, first_reaction(rod, shape, turns)
    room = np.empty((n, 4)), np.empty((n + 1, 4)), np.empty((n, 3)), np.empty((n, 3))
    return state, room, room_for(n), (np.empty(3), np.empty((3, 3)), np.empty((3, 4)), np.empty(3))


@njit
def resting(rod, frames, turns, reaction):
    """The shape that has these frames, rotations at the vertices and reaction."""
    return Shape(strains(rod, frames, reaction), frames, turns, tilts_of(rod, frames, turns, reaction))


@njit
def descent(rod, shape, iterations, known, passed):
    """Shape, how it ended, iterations and force left over of a descent, which ends beside a `known` shape (k, n, 4).

    Overwrites the frames `passed (n, 4)` with those where little force was left over before there was more again, and
    says last if there were any: a state of finer edges may lie there.
    """
    least, shift, residual = neutral_of(rod), neutral_of(rod), np.inf
    (frames, turns, reaction), (after, turns_after, step, forces), (system, factor), small = begun(rod, shape)
    gap, give, complement, change = small
    ending, iteration = EXHAUSTED, 0
    calm, has_passed, calmest = CALM, False, np.empty(frames.shape)
    while iteration < iterations and ending == EXHAUSTED:
        iteration += 1
        scale = passed_on(rod, reaction, forces)
        balance(rod, frames, turns, forces, system, gap, give)
        residual = left_over(rod, system[2], gap, scale)
        if not residual < np.inf:
            ending = BROKEN
            break
        if residual < calm:
            calm = residual
            calmest[:] = frames
        elif calm < CALM and residual > RISE * calm and not has_passed:
            has_passed = True
            passed[:] = calmest
        is_definite = factored(rod, system, shift, factor, give, complement)
        for _ in range(SHIFTS):
            if is_definite:
                break
            shift = max(LEAST_SHIFT, 4.0 * shift)
            is_definite = factored(rod, system, shift, factor, give, complement)
        if not is_definite:
            ending = BROKEN
        elif shift == least and residual <= max(0.5 * RESIDUAL, floor_of(rod) / scale):
            ending = SETTLED
        elif shift == least and residual <= BESIDE and is_known(frames, known, ALIKE):
            ending = KNOWN
        else:
            # While kinks make the rod unstable, they are smoothed first: a stiffened rod closes its gap by a new kink.
            for axis in range(3):
                gap[axis] /= 1.0 + shift / SMOOTHING
            newton_step(rod, factor, complement, gap, step, change)
            for axis in range(3):
                reaction[axis] += change[axis]
            found = searched(rod, frames, turns, step, reaction, after, turns_after)
            frames, after, turns, turns_after = after, frames, turns_after, turns
            relief = 0.25 * shift if shift > LEAST_SHIFT else least
            shift = relief if found else 4.0 * max(shift, LEAST_SHIFT)
    return resting(rod, frames, turns, reaction), ending, iteration, residual, has_passed


@shipped(SpatialRod, Shape, int)
def descend_from(rod, shape, iterations):
    """Shape, how it ended, iterations and force left over of a descent from `shape`: see `relax.descend`."""
    n = rod.edges.size
    shape, ending, taken, residual, _ = descent(rod, shape, iterations, np.empty((0, n, 4)), np.empty((n, 4)))
    return shape, ending, taken, residual


@shipped(SpatialRod, Shape, int)
def newton_from(rod, shape, iterations):
    """Shape, how it ended, iterations and force left over of Newton's method from `shape`: see `relax.newton`."""
    residual = np.inf
    (frames, turns, reaction), (after, turns_after, step, forces), (system, factor), small = begun(rod, shape)
    gap, give, complement, change = small
    ending, iteration = EXHAUSTED, 0
    while iteration < iterations and ending == EXHAUSTED:
        iteration += 1
        scale = passed_on(rod, reaction, forces)
        balance(rod, frames, turns, forces, system, gap, give)
        residual = left_over(rod, system[2], gap, scale)
        if residual <= max(0.5 * RESIDUAL, floor_of(rod) / scale):
            ending = SETTLED
        elif not residual < np.inf:
            ending = BROKEN
        else:
            factored(rod, system, neutral_of(rod), factor, give, complement)
            newton_step(rod, factor, complement, gap, step, change)
            turn = largest(step)
            advance(rod, frames, turns, step, min(1.0, TURN / max(turn, TURN)), after, turns_after)
            for axis in range(3):
                reaction[axis] += change[axis]
            frames, after, turns, turns_after = after, frames, turns_after, turns
    return resting(rod, frames, turns, reaction), ending, iteration, residual
