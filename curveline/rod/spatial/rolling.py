"""Kernel that follows a stable shape while its last clamp is rolled on, until that is done or the shape falls.

Each step goes along the tangent of the branch, as far as turns no edge by much, and is corrected by Newton's method. A
step that leads far from where the tangent pointed, or to what is not stable, is halved; where steps become small, a
fold is at hand.
"""

from __future__ import annotations

import numpy as np

from curveline.kernels.kernel import njit, shipped
from curveline.rod.geometry.rotations import between, exponential, multiply
from curveline.rod.spatial.bordered import (
    advance,
    balance,
    in_space,
    left_over,
    tangent_of,
)
from curveline.rod.spatial.clamps import doubled, link
from curveline.rod.spatial.descent import factored, largest, neutral_of, newton_step, resting, room_for
from curveline.rod.spatial.energy import Shape, SpatialRod, positions, vertex_slopes, with_frames
from curveline.rod.spatial.mouths import arm, gives, mouth_frame, seen_from_mouth
from curveline.rod.spatial.reaction import first_reaction, passed_on, turns_of

REACH = 0.8
"""Turn of an edge [rad] up to which a tangent is followed."""
JUMP = 0.35
"""Turn of an edge [rad] beside the tangent by which it may have left its branch."""
LEAST = np.pi / 192.0
"""Roll [rad] below which a jump is a fall."""
CLOSE, BESIDE = 1e-7, 1e-3
"""Largest force that is left over after a step, relative: of a shape at rest, and of one beside it, that is followed on
for a third less."""
CORRECTIONS = 7
EASY = 3
"""Corrections of a step that may be followed by a longer one."""


@njit
def clamp_pull(rod, state, right, gap):
    """Overwrite the first of the right-hand sides (n, 3, 4), and the gap, with what rolling the last clamp on asks.

    The state holds frames (n, 4), turns (n+1, 4) and the reaction (3,). A bearing that yields tilts as it is rolled.
    """
    n = rod.edges.size
    frames, turns, reaction = state
    tilt, yields = 0.0, 0.0
    if gives(rod):
        tilt, yields = link(rod, frames, turns, (reaction[0], reaction[1]), 1)
    single = seen_from_mouth(rod.frames, turns[n], tilt, 1)
    (m0, m1, m2), (k00, k10, k11, k20, k21, k22) = in_space(
        frames[n - 1], vertex_slopes(rod, n, single, doubled(single))
    )
    t0, t1, t2 = tangent_of(mouth_frame(rod.frames, tilt, 1))
    tilting = yields * (k20 * t0 + k21 * t1 + k22 * t2 + 0.5 * (m1 * t0 - m0 * t1))
    x, y = arm(rod, tilt, 1)
    gap[0], gap[1], gap[2] = -tilting * y, tilting * x, 0.0
    for j in range(n):
        for r in range(3):
            right[j, r, 0] = 0.0
    right[n - 1, 0, 0] = k00 * t0 + k10 * t1 + k20 * t2 - 0.5 * (m1 * t2 - m2 * t1) + tilting * (0.5 * m1 - k20)
    right[n - 1, 1, 0] = k10 * t0 + k11 * t1 + k21 * t2 - 0.5 * (m2 * t0 - m0 * t2) - tilting * (0.5 * m0 + k21)
    right[n - 1, 2, 0] = k20 * t0 + k21 * t1 + k22 * t2 - 0.5 * (m0 * t1 - m1 * t0) - tilting * k22


@njit
def corrected(rod, state, spare, room, close):
    """Bring a `state` beside a stable equilibrium there; corrections taken, none if it leads to none or far away.

    None, too, where a correction leaves more force over than it met: what lies past a fold wanders. Of the forces, the
    part `close` may be left over.

    The state holds frames (n, 4), turns (n+1, 4) and the reaction (3,); `spare` has room for the first two. In the
    `room`, the bordered system is left as it is in the equilibrium.
    """
    system, factor, step, forces, give = room
    gap, complement, change = np.empty(3), np.empty((3, 4)), np.empty(3)
    least, off, before = neutral_of(rod), 0.0, np.inf
    frames, turns, reaction = state
    for taken in range(1, CORRECTIONS + 1):
        scale = passed_on(rod, reaction, forces)
        balance(rod, frames, turns, forces, system, gap, give)
        residual = left_over(rod, system[2], gap, scale)
        if not residual < before:
            return 0
        is_definite = factored(rod, system, least, factor, give, complement)
        if residual <= close:
            return taken if is_definite else 0
        # The first one may: it closes the gap, too.
        before = residual if taken > 1 else np.inf
        newton_step(rod, factor, complement, gap, step, change)
        off += largest(step)
        if off > JUMP:
            return 0
        advance(rod, frames, turns, step, 1.0, spare[0], spare[1])
        frames[:] = spare[0]
        turns[:] = spare[1]
        reaction += change
    return 0


@njit
def rolled_to(rod, frame, roll, turns, frames):
    """Turn the rod's last clamp to where `roll` [rad] brings it from `frame (4,)`, and the last vertex with it."""
    n = rod.edges.size
    turn = np.empty(4)
    exponential(np.array([0.0, 0.0, roll]), turn)
    multiply(frame, turn, rod.frames[1])
    between(frames[n - 1], rod.frames[1], turns[n])


@njit
def predicted(tangents, changes, share, step, change):
    """Overwrite turns `step (n, 3)` and `change (3,)` of the reaction with a part of a branch's way, to second order.

    Of `tangents` and `changes`, per roll, the second ones are those one step back; `share` holds the roll to go and
    half its square over that step, or nothing.
    """
    for axis in range(3):
        change[axis] = share[0] * changes[0][axis] + share[1] * (changes[0][axis] - changes[1][axis])
        for j in range(step.shape[0]):
            step[j, axis] = share[0] * tangents[0][j, axis] + share[1] * (tangents[0][j, axis] - tangents[1][j, axis])


@shipped(SpatialRod, Shape, float, int, float)
def roll_through(rod, shape, angle, count, close):
    """The shapes that a stable one becomes as the last clamp is rolled on, `count` times by `angle` [rad].

    They are at rest but for the part `close` of the forces.

    Returns strains (k, n), frames (k, n, 4), turns (k, n+1, 4), tilts (k, 2) and vertices (k, n+1, 3) of those that are
    reached, the shape as far as it goes, the roll that was done, and the number of corrections that were tried.
    """
    n, side, least = rod.edges.size, np.sign(angle), neutral_of(rod)
    now = with_frames(rod, rod.frames.copy())
    turns = turns_of(rod, shape)
    state = shape.frames.copy(), turns, first_reaction(rod, shape, turns)
    trial, spare = (np.empty((n, 4)), np.empty((n + 1, 4)), np.empty(3)), (np.empty((n, 4)), np.empty((n + 1, 4)))
    out = np.empty((count, n)), np.empty((count, n, 4)), np.empty((count, n + 1, 4)), np.empty((count, n + 1, 3))
    tilts = np.empty((count, 2))
    system, factor = room_for(n)
    step, forces, give = np.empty((n, 3)), np.empty((n, 3)), np.empty((3, 3))
    room = system, factor, step, forces, give
    tangents, changes = (np.zeros((n, 3)), np.zeros((n, 3))), (np.zeros(3), np.zeros(3))
    gap, complement, change = np.zeros(3), np.empty((3, 4)), np.empty(3)
    passed_on(now, state[2], forces)
    balance(now, state[0], state[1], forces, system, gap, give)
    done, work, size, last, reached = 0.0, 0, abs(angle), 0.0, 0
    while reached < count:
        clamp_pull(now, state, system[2], gap)
        if not factored(now, system, least, factor, give, complement):
            break
        newton_step(now, factor, complement, gap, tangents[0], changes[0])
        to_go = (reached + 1) * abs(angle) - done
        size = min(size, REACH / largest(tangents[0]))
        taken, part = 0, min(size, to_go)
        while taken == 0 and (part >= LEAST or part == to_go):
            share = part, 0.5 * part**2 / last if last > 0.0 else 0.0
            predicted(tangents, changes, share, step, change)
            advance(now, state[0], state[1], step, side, trial[0], trial[1])
            rolled_to(now, rod.frames[1], side * (done + part), trial[1], trial[0])
            trial[2][:] = state[2] + side * change
            taken = corrected(now, trial, spare, room, close)
            work += CORRECTIONS if taken == 0 else taken
            if taken == 0:
                size = part = 0.5 * part
        if taken == 0:
            break
        state, trial = trial, state
        tangents, changes = (tangents[1], tangents[0]), (changes[1], changes[0])
        last = part
        done += part
        if part == to_go:
            done = (reached + 1) * abs(angle)
            here = resting(now, state[0], state[1], state[2])
            out[0][reached], out[1][reached], out[2][reached] = here.strain, here.frames, here.turns
            tilts[reached, 0], tilts[reached, 1] = here.tilts
            out[3][reached] = positions(now, here)
            reached += 1
        size = 2.0 * size if taken <= EASY else size
    end = resting(now, state[0], state[1], state[2])
    strain, frames, turned, places = out
    return (
        strain[:reached].copy(),
        frames[:reached].copy(),
        turned[:reached].copy(),
        tilts[:reached].copy(),
        places[:reached].copy(),
        end,
        side * done,
        work,
    )


def roll_on(rod: SpatialRod, shape: Shape, angle: float) -> tuple[Shape, float, int]:
    """The shape that a stable one becomes as the last clamp is rolled on by `angle` [rad], as far as it goes.

    Returns that, the roll that was done, and the number of corrections that were tried.
    """
    if angle == 0.0:
        return shape, 0.0, 0
    *_, end, done, work = roll_through(rod, shape, angle, 1, CLOSE)
    return end, done, work
