"""Kernel for the states of a rod without difficulties, in one call: search, refinement, and what to judge them by.

A rod has none where a search on few edges is clear, or one on finer edges: slack, not steep, every place worth a closer
look followed, and every state that was met stable on finer edges, too. That is most of them. Others are left to
`planar_states`.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from curveline.kernels.forms import Matrix, Vector
from curveline.kernels.kernel import leaf, njit, shipped
from curveline.rod.geometry.vertex_table import X, Y
from curveline.rod.planar.approach import THIN, layer
from curveline.rod.planar.lateral import lateral_pair
from curveline.rod.planar.pairs import COUNT, DIRECTIONS, FORCE, alone, joined, pairs_near
from curveline.rod.planar.response import middle_angles, response
from curveline.rod.planar.richardson import ACROSS, EIGENVALUE, UP
from curveline.rod.planar.search import divided, let_go_aside, may_be_stable, search_edges
from curveline.rod.planar.sweep import BARELY, CAPACITY
from curveline.rod.problem import (
    Bearing,
    Pose,
    copy_into,
    make_problem,
    mesh,
    pose_at_row,
    scale_rod,
    stretching_by,
    weighing,
)
from curveline.rod.states.refined import (
    CLEARLY,
    CROSSES,
    ERROR,
    HEIGHT,
    LEVEL,
    MOST_EDGES,
    NEUTRAL,
    NUMBERS,
    SAME_CURVE,
    UNSTABLE,
    WRAPS,
    placement_of,
    refined,
)

EDGES = 24
"""Edges to search with first."""
FINER = 4
"""Parts of an edge where that leaves doubts."""
STEEP = 1.45
"""Clamp angle [rad] from which on more guesses than two arches are tried; the built-in displays stay below."""
LONG = 2.0
"""Length over chord from which on they are tried, too."""

COARSE_LATERAL, FINE_LATERAL, MOVED_BY_STRETCH, MOVED_BY_WEIGHT, VERTICES = range(NUMBERS, NUMBERS + 5)
"""The numbers of a state after those of `refined`: the lowest eigenvalue out of the plane on two resolutions, how far
the curve moves where the rod may stretch, and under its weight [m], and how many vertices its curve has."""
PLAIN_NUMBERS = NUMBERS + 5


class Asked(NamedTuple):
    """What to find out of states: their curves to `tolerance` [m], and how these answer to what the model leaves out.

    The `stretching` compliance EI / EA [m^2] and the `weight` [N/m] that the rod has in truth, NaN for what not to ask.
    """

    tolerance: float
    stretching: float
    weight: float
    sideways: bool  # whether to look out of the plane, too


@leaf
def is_slack_and_gentle(rod):
    """True for a rod whose states two arches and the sweeps from them show."""
    if abs(rod.ends[0]) > STEEP or abs(rod.ends[1]) > STEEP:
        return False
    return LONG * np.hypot(rod.chord[0], rod.chord[1]) >= 1.0


@njit
def judged(rod, lateral, asked, state, numbers):
    """Fill in how a state answers to what the model leaves out; see `model_error` for what that means.

    `lateral (3,)` as in `lateral_variation`; `asked` in units of the `ScaledRod`; `state` as `refined` gives it, in SI.
    """
    table, places, length = state
    edges = places / length
    angles = middle_angles(places, table)
    forces = np.array([numbers[ACROSS], numbers[UP]])
    if asked.sideways:
        numbers[COARSE_LATERAL], numbers[FINE_LATERAL] = lateral_pair(rod, edges, angles, table, (forces, lateral))
    if not np.isnan(asked.stretching):
        other = stretching_by(rod, asked.stretching)
        numbers[MOVED_BY_STRETCH] = response(rod, other, edges, angles.copy(), forces.copy()) * length
    if not np.isnan(asked.weight):
        other = weighing(rod, asked.weight)
        numbers[MOVED_BY_WEIGHT] = response(rod, other, edges, angles.copy(), forces.copy()) * length


@njit
def is_known(states, vertices, one, near):
    """Whether `one` of some states, its numbers and vertices (m, 6), is a curve among them; False too if none can tell.

    The `states (c, PLAIN_NUMBERS)` have their `vertices (V, 6)` one after the other; curves that are nearer than `near`
    beside their errors are one. Positions are compared where both have vertices, by all that the coarser ones are cut
    of. Returns whether it is known, and whether that could be told.
    """
    numbers, table = one
    m = table.shape[0] - 1
    begin = 0
    for i in range(states.shape[0]):
        other = int(states[i, VERTICES]) - 1
        parts = min(m, other)
        apart = near + states[i, ERROR] + numbers[ERROR]
        if abs(states[i, HEIGHT] - numbers[HEIGHT]) < apart + CLEARLY * near / SAME_CURVE:
            if m % parts != 0 or other % parts != 0:
                return False, False
            gap = 0.0
            for j in range(parts + 1):
                here, there = table[j * (m // parts)], vertices[begin + j * (other // parts)]
                gap = max(gap, np.hypot(here[X] - there[X], here[Y] - there[Y]))
            if gap < apart:
                return True, True
        begin += other + 1
    return False, True


@njit
def met_on(rod, edges):
    """What a search on `edges (n,)` meets that may be stable, as `pairs.joined` has it.

    From saddles among them the rod was let go, to nothing new. Returns first whether all that can be told here, and
    whether finer edges show no more.
    """
    (_, found), (_, sought), near, is_unclear = search_edges(rod, edges)
    met = np.empty((0, 4)), np.empty(0)
    if sought.filled[0] > 0.0:
        return False, False, met
    free = make_problem(rod, edges)
    is_promising = may_be_stable(rod, edges, found)
    for i in range(is_promising.size):
        if is_promising[i]:
            met = joined(met, alone(found, i))
            if found.unstable[i] > 0.0 and let_go_aside(free, found.shapes[i], found):
                return False, False, met
    if near.filled[0] == 0.0:
        return True, not is_unclear, met
    is_followed, known, angles = pairs_near(rod, edges, near)
    is_told = not np.any(known[:, DIRECTIONS] > 0.0)
    return is_told, is_followed and not is_unclear, joined(met, (known, angles))


@njit
def met_by_search(rod, edges):
    """What searches on `edges (n,)`, and on finer ones if need be, meet that may be stable, as `pairs.joined` has it.

    Returns False first where they do not tell.
    """
    met = np.empty((0, 4)), np.empty(0)
    for parts in (1, FINER):
        is_told, is_clear, more = met_on(rod, divided(edges, parts))
        met = joined(met, more)
        if not is_told or not np.any(met[0][:, DIRECTIONS] == 0.0):
            return False, met
        if is_clear:
            return True, met
    return False, met


@shipped(Pose, Bearing, Vector, Matrix, Asked)
def plain_states(pose, bearing, at, forces, asked):
    """Every stable state of a rod without difficulties under dead loads `forces (m, 2)` [N] at fractions `at (m,)`.

    Returns the numbers (c, PLAIN_NUMBERS) of its states, none for a rod that has difficulties; the vertices (V, 6) of
    all of them, one after the other; and the edges (V,) [m] behind these vertices, 0 behind the last one of each.
    """
    none = np.empty((0, PLAIN_NUMBERS)), np.empty((0, 6)), np.empty(0)
    length = pose.length - bearing.clamp
    if not length > 0.0:
        return none
    rod = scale_rod(pose, bearing, at, forces)
    if layer(rod) < THIN or not is_slack_and_gentle(rod):
        return none
    edges = mesh(rod.at, EDGES)
    is_clear, (known, angles) = met_by_search(rod, edges)
    if not is_clear:
        return none
    placement = placement_of(pose, bearing, forces, 0)
    ratio = 1.0 / bearing.stiffness
    lateral = np.array([bearing.lateral * ratio, bearing.twisting * ratio, bearing.natural * length])
    scaled = Asked(asked.tolerance, asked.stretching / length**2, asked.weight * length**3 * ratio, asked.sideways)
    is_judged = asked.sideways or not np.isnan(asked.stretching) or not np.isnan(asked.weight)
    states = np.empty((known.shape[0], PLAIN_NUMBERS))
    vertices, behind = np.empty((0, 6)), np.empty(0)
    count = end = 0
    for i in range(known.shape[0]):
        n = int(known[i, COUNT])
        begin, end = end, end + n
        cut = divided(edges, n // edges.size)
        coarse = (cut, angles[begin:end].copy(), known[i, FORCE:].copy())
        table, places, numbers = refined(rod, coarse, placement, asked.tolerance, MOST_EDGES)
        is_saddle = numbers[UNSTABLE] > 0.0 and not numbers[EIGENVALUE] > NEUTRAL
        if is_saddle and known[i, DIRECTIONS] > 0.0 and numbers[EIGENVALUE] < BARELY:
            continue
        if numbers[UNSTABLE] != 0.0 or not numbers[EIGENVALUE] > NEUTRAL:
            return none
        is_there, is_told = is_known(states[:count], vertices, (numbers, table), SAME_CURVE * pose.length)
        if not is_told:
            return none
        if is_there:
            continue
        states[count, :NUMBERS] = numbers
        states[count, NUMBERS:] = np.nan
        states[count, VERTICES] = table.shape[0]
        if is_judged:
            judged(rod, lateral, scaled, (table, places, length), states[count])
        vertices, behind = appended(vertices, behind, table, places)
        count += 1
    if count == 0:
        return none
    return states[:count].copy(), vertices, behind


@njit
def in_order(states, doubts):
    """Put `states (c, PLAIN_NUMBERS)` in the order of their heights, the highest first.

    False if that does not tell by what names they go: one crosses itself or a tail, or two may be equally high, given
    how far each may be off, `doubts (c,)`.
    """
    count = states.shape[0]
    for i in range(count):
        if states[i, CROSSES] > 0.0 or states[i, WRAPS] > 0.0:
            return False
        for j in range(i, 0, -1):
            if states[j, HEIGHT] > states[j - 1, HEIGHT]:
                for a in range(PLAIN_NUMBERS):
                    states[j, a], states[j - 1, a] = states[j - 1, a], states[j, a]
                doubts[j], doubts[j - 1] = doubts[j - 1], doubts[j]
    is_told = True
    for i in range(1, count):
        is_told = is_told and states[i - 1, HEIGHT] - states[i, HEIGHT] > doubts[i] + doubts[i - 1]
    return is_told


@shipped(Matrix, Bearing, Vector, Matrix, Asked)
def plain_batch(poses, bearing, at, forces, asked):
    """The states of many rods without difficulties, at `poses (m, 5)`; what else there is, is as in `plain_states`.

    Returns how many states each rod has (m,), 0 for one that has difficulties, and the numbers (S, PLAIN_NUMBERS) of
    all of them, those of a rod the highest first.
    """
    counts = np.zeros(poses.shape[0], dtype=np.int64)
    table = np.empty((2 * poses.shape[0] + CAPACITY, PLAIN_NUMBERS))
    total = 0
    for i in range(poses.shape[0]):
        pose = pose_at_row(poses[i])
        states, _, _ = plain_states(pose, bearing, at, forces, asked)
        count = states.shape[0]
        doubts = np.empty(count)
        for j in range(count):
            doubts[j] = states[j, ERROR] + LEVEL * pose.length
        if not in_order(states, doubts):
            continue
        if total + count > table.shape[0]:
            larger = np.empty((2 * table.shape[0], PLAIN_NUMBERS))
            for j in range(total):
                copy_into(larger[j], table[j])
            table = larger
        for j in range(count):
            copy_into(table[total + j], states[j])
        counts[i] = count
        total += count
    return counts, table[:total].copy()


@njit
def appended(vertices, behind, table, places):
    """All `vertices (V, 6)` and the edges `behind (V,)` them, and those of one more state."""
    n, m = vertices.shape[0], table.shape[0]
    all_vertices, all_behind = np.empty((n + m, 6)), np.zeros(n + m)
    for i in range(n):
        copy_into(all_vertices[i], vertices[i])
        all_behind[i] = behind[i]
    for i in range(m):
        copy_into(all_vertices[n + i], table[i])
    copy_into(all_behind[n : n + m - 1], places)
    return all_vertices, all_behind
