"""Pairs of states that a coarse rod may hide: where a sweep came near a fold, a finer rod is asked.

That is rare, so it is no part of the search's kernel: the first run need not wait for it to be compiled.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from curveline.rod.planar.dips import bottom, bottom_near, let_go
from curveline.rod.planar.search import DOUBTFUL, divided, doubtful
from curveline.rod.planar.sweep import BARELY, MetEquilibria, Near, nothing_found
from curveline.rod.problem import Array, ScaledRod, held_in_height, largest_change, make_problem, refine_angles

PARTS = 4
"""Parts of an edge from one look at a dip to the next: a fold moves with the square of the edge, 0.1 % at 100 edges."""
COARSE = 24.0
"""Edges that cannot tell an eigenvalue between `BARELY` and `DOUBTFUL` from zero; others by the square of theirs."""
FINEST = 2000
"""Edges from which on no finer ones are tried: a fold is then known to 1e-7."""
SAME_DIP = 1e-2
"""Edges' angles [rad] that differ by less at the bottom belong to one dip: two lie farther from each other, or both are
followed in vain, since the bottom is found to about a thousandth."""

Finer = dict[int, tuple[Array, MetEquilibria]]
"""Edges and what was found on them, by their number."""


class Dip(NamedTuple):
    """The bottom of a dip: mean height, second derivative of the slope by it (0 if there is none), sign beside it.

    And the angles `phi (n,)` and multipliers `force (3,)` there.
    """

    height: float
    bend: float
    sign: float
    phi: Array
    force: Array


def pairs_near(scaled: ScaledRod, edges: Array, near: Near) -> tuple[Finer, bool]:
    """The stable states where sweeps on `edges (n,)` came `near` a fold; False if finer sweeps may meet others.

    Each dip is noted by every sweep that passes it.
    """
    finer: Finer = {}
    clear = True
    seen: list[Array] = []
    for place in range(int(near.filled[0])):
        phi, force = near.shapes[place].copy(), near.forces[place].copy()
        sign = math.copysign(1.0, force[2])
        problem = held_in_height(make_problem(scaled, edges))
        height, bend = bottom(problem, near.heights[place], phi, force, sign)
        if any(largest_change(phi, other) < SAME_DIP for other in seen):
            continue
        seen.append(phi.copy())
        clear = _seek_pair(scaled, edges, Dip(height, bend, sign, phi, force), finer) and clear
    return finer, clear


def _seek_pair(scaled: ScaledRod, edges: Array, dip: Dip, finer: Finer) -> bool:
    """Keep the stable state beside the bottom of a `dip` in what was found on `finer` edges.

    The slope at the bottom is followed over ever finer edges until it crosses zero, or until its limit for vanishing
    edges (Richardson) is clearly beside zero: then the continuous rod has none there. Returns False if it was lost.
    """
    height, bend, sign, phi, force = dip
    slope = sign * force[2]
    while bend > 0.0:
        n = edges.size
        problem = held_in_height(make_problem(scaled, edges))
        found = finer.setdefault(n, (edges, nothing_found(n)))[1]
        is_there = slope < 0.0 and let_go(problem, (height, bend), phi.copy(), force.copy(), sign, found)
        share = (COARSE / n) ** 2
        if n > FINEST or (is_there and not doubtful(problem, found, share * BARELY, share * DOUBTFUL)):
            return True
        phi = refine_angles(problem, phi, PARTS)
        edges = divided(edges, PARTS)
        height, below = bottom_near(held_in_height(make_problem(scaled, edges)), (height, bend), phi, force, sign)
        gain = (sign * below - slope) / (PARTS**2 - 1)
        if math.isnan(below):
            return False
        if sign * below + gain > 0.5 * abs(gain):
            return True
        slope = sign * below
    return False
