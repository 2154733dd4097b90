"""Kernels for pairs of states that a coarse rod may hide: where a sweep came near a fold, a finer rod is asked."""

from __future__ import annotations

import numpy as np

from curveline.kernels.forms import Vector
from curveline.kernels.kernel import njit, shipped
from curveline.rod.planar.dips import bottom, bottom_near, let_go
from curveline.rod.planar.search import COARSE, DOUBTFUL, divided, doubtful
from curveline.rod.planar.sweep import BARELY, Near, room_for
from curveline.rod.problem import ScaledRod, copy_into, held_in_height, largest_change, make_problem, refine_angles

PARTS = 4
"""Parts of an edge from one look at a dip to the next: a fold moves with the square of the edge, 0.1 % at 100 edges."""
FINEST = 2000
"""Edges from which on no finer ones are tried: a fold is then known to 1e-7."""
SAME_DIP = 1e-2
"""Edges' angles [rad] that differ by less at the bottom belong to one dip: two lie farther from each other, or both are
followed in vain, since the bottom is found to about a thousandth."""

COUNT, DIRECTIONS, FORCE = 0, 1, 2
"""Columns of what is known of an equilibrium: its number of edges, unstable directions, from there both multipliers."""


@njit
def alone(found, place):
    """What is known (1, 4) of the equilibrium at a `place` of what was `found`, and its angles (n,)."""
    known = np.empty((1, 4))
    known[0, COUNT], known[0, DIRECTIONS] = found.shapes.shape[1], found.unstable[place]
    copy_into(known[0, FORCE:], found.multipliers[place])
    return known, found.shapes[place].copy()


@njit
def joined(some, others):
    """What is known (c, 4) of `some` equilibria and of `others`, and the angles (a,) of all, one after the other."""
    c, a = some[0].shape[0], some[1].size
    known, angles = np.empty((c + others[0].shape[0], 4)), np.empty(a + others[1].size)
    for i in range(known.shape[0]):
        copy_into(known[i], some[0][i] if i < c else others[0][i - c])
    copy_into(angles[:a], some[1])
    copy_into(angles[a:], others[1])
    return known, angles


@njit
def seek_pair(rod, edges, dip, place, states):
    """Keep the stable state beside the bottom of a `dip`, its height, the slope's second derivative and its sign.

    The slope at the bottom, at the `place` (angles, multipliers), is followed over ever finer edges until it crosses
    zero, or until its limit for vanishing edges (Richardson) is clearly beside zero: then the continuous rod has none
    there. Returns whether it was not lost, and the `states` with what was found, as `joined` has them.
    """
    height, bend, sign = dip
    phi, force = place
    slope = sign * force[2]
    while bend > 0.0:
        n = edges.size
        problem = held_in_height(make_problem(rod, edges))
        found = room_for(n, 1)
        is_there = slope < 0.0 and let_go(problem, (height, bend), phi.copy(), force.copy(), sign, found)
        if found.filled[0] > 0.0:
            states = joined(states, alone(found, 0))
        share = (COARSE / n) ** 2
        if n > FINEST or (is_there and not doubtful(problem, found, share * BARELY, share * DOUBTFUL)):
            return True, states
        phi = refine_angles(problem, phi, PARTS)
        edges = divided(edges, PARTS)
        height, below = bottom_near(held_in_height(make_problem(rod, edges)), (height, bend), phi, force, sign)
        gain = (sign * below - slope) / (PARTS**2 - 1)
        if np.isnan(below):
            return False, states
        if sign * below + gain > 0.5 * abs(gain):
            return True, states
        slope = sign * below
    return False, states


@shipped(ScaledRod, Vector, Near)
def pairs_near(rod, edges, near):
    """The states where sweeps on `edges (n,)` came `near` a fold, each on the edges that tell it from none.

    Each dip is noted by every sweep that passes it. Returns False if one was lost, so that finer sweeps may meet
    others; and of the states their number of edges, unstable directions and multipliers (c, 4), and their angles, one
    after the other (a,).
    """
    states = np.empty((0, 4)), np.empty(0)
    seen = np.empty((int(near.filled[0]), edges.size))
    count = 0
    is_clear = True
    for place in range(int(near.filled[0])):
        phi, force = near.shapes[place].copy(), near.forces[place].copy()
        sign = 1.0 if force[2] >= 0.0 else -1.0
        problem = held_in_height(make_problem(rod, edges))
        height, bend = bottom(problem, near.heights[place], phi, force, sign)
        is_known = False
        for i in range(count):
            is_known = is_known or largest_change(phi, seen[i]) < SAME_DIP
        if is_known:
            continue
        copy_into(seen[count], phi)
        count += 1
        is_followed, states = seek_pair(rod, edges, (height, bend, sign), (phi, force), states)
        is_clear = is_clear and is_followed
    return is_clear, states[0], states[1]
