"""A state that is followed while nodes move: the angles of a coarse rod's edges; and which state of the real rod it is.

held = tracked(state)                       # of an Equilibrium
held = on_edges(rod, held, 192)             # the same state on other edges; None if it is none on these
which = identify(rod, held, states)         # the Equilibrium that it is; None if it is none of the states
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from curveline.rod.branches.continuation import FOLLOW_EDGES, coarse_start
from curveline.rod.branches.standing import state_near
from curveline.rod.clamped_rod import ClampedRod
from curveline.rod.problem import Array, mesh
from curveline.rod.states.equilibrium import Equilibrium, Outcome, refine
from curveline.rod.states.identity import same_curve

CLOSE = 0.02
"""Edges of one state differ by less than this [rad] on a coarse rod and on a fine one, but near folds, or followed on
two ways."""
CLEAR = 3.0
"""How often as far away the next state must be for the nearest to be told by its angles alone."""
TOLERANCE = 1e-5
"""Bound on the error of a curve, as a part of the length, that tells which state it is."""


@dataclass(frozen=True)
class TrackedState:
    """A state of a rod without loads as `angles (n,)` of n equal edges [rad] and `multipliers (2,)`."""

    angles: Array
    multipliers: Array

    @cached_property
    def key(self) -> tuple[float, ...]:
        """Tells states at the same pose apart, and the edges they are on."""
        return self.angles.size, *np.round(self.angles[:: max(1, self.angles.size // 6)], 5)

    def gap(self, other: TrackedState) -> float:
        """Largest difference of the angles of two states on as many edges [rad]."""
        return float(np.max(np.abs(self.angles - other.angles)))


def tracked(state: Equilibrium, n: int = FOLLOW_EDGES) -> TrackedState:
    """A state that was found, as one that can be followed on `n` edges."""
    return TrackedState(*coarse_start(state, n))


def on_edges(rod: ClampedRod, held: TrackedState, n: int) -> TrackedState | None:
    """The same state on `n` edges, as many times more or fewer; None if the rod has no such stable state on these."""
    if held.angles.size == n:
        return held
    if held.angles.size > n:
        return reached(rod, TrackedState(held.angles.reshape(n, -1).mean(axis=1), held.multipliers))
    return reached(rod, held, n // held.angles.size)


def reached(rod: ClampedRod, held: TrackedState, parts: int = 1) -> TrackedState | None:
    """The stable state of a rod next to the one that is `held`, on edges cut into `parts`; None if these have none."""
    found, angles, multipliers = state_near(rod.pose, rod.bearing, held.angles, held.multipliers, parts)
    return TrackedState(angles, multipliers) if found else None


def identify(rod: ClampedRod, held: TrackedState, states: Sequence[Equilibrium]) -> Equilibrium | None:
    """The one of the `states` of a rod that is followed as `held`; None if that is none of them.

    Where the angles do not tell, the state is refined: near a fold a coarse rod is far from the real one.
    """
    gaps = [float(np.max(np.abs(coarse_start(state, held.angles.size)[0] - held.angles))) for state in states]
    nearest = sorted(gaps)
    if nearest and nearest[0] < CLOSE and (len(nearest) == 1 or nearest[1] > CLEAR * nearest[0]):
        return states[gaps.index(nearest[0])]
    state = refined(rod, held, TOLERANCE * rod.length)
    return next((other for other in states if same_curve(state, other)), None) if state.stable else None


def refined(rod: ClampedRod, held: TrackedState, tolerance: float) -> Equilibrium:
    """The state of the real rod that is followed as `held`, to `tolerance` [m], without a name; see its outcome."""
    edges = mesh(rod.scaled().at, held.angles.size)
    return refine(rod, edges, held.angles.copy(), held.multipliers.copy(), tolerance)


def why_not_shown(state: Equilibrium) -> str:
    """What keeps a planar display from showing a state, as the end of a sentence; empty if nothing does."""
    if state.outcome is Outcome.LOST or not state.stable:
        return "that is none of the real rod"
    if state.crosses_itself:
        return "whose curve crosses itself"
    if state.wraps_clamp:
        return "that wraps round a node"
    return "that has a further turn" if state.winding else ""
