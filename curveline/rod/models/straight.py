"""The state of a rod without any to spare: from the straight line between its clamps, as it stretches or is pressed.

Whether such a rod is a little too short or too long, it takes up by strain, which it does at no force that a planar
model could tell. How it lies follows from that, from its weight and from clamps that point a little beside the line.
"""

from __future__ import annotations

import math

import numpy as np

from curveline.rod.clamped_rod import ClampedRod
from curveline.rod.planar.newton import Effort, descend
from curveline.rod.problem import Array, make_problem, mesh
from curveline.rod.states.equilibrium import Equilibrium, refine
from curveline.rod.states.identity import GONE

FEWEST, MOST = 48, 3000
PER_LAYER = 8.0
"""Edges in the length sqrt(EI / T) in which a rod under a tension T bends back to the line; their fewest and most."""
SETTLE = Effort(turn=0.5, close=1e-9, iterations=200)


def straight_state(rod: ClampedRod, tolerance: float) -> Equilibrium:
    """The state of a `rod` that `slack.is_straight`, by the extensible model, to `tolerance` [m]; its outcome tells
    whether it was found."""
    rod = rod.extensible()
    edges = mesh(rod.scaled().at, _edges(rod))
    state = refine(rod, edges, _bent_to_clamps(rod, edges), np.zeros(2), tolerance)
    if state.outcome in GONE:
        phi, multipliers = _bent_to_clamps(rod, edges), np.zeros(2)
        descend(make_problem(rod.scaled(), edges), phi, multipliers, SETTLE)
        state = refine(rod, edges, phi, multipliers, tolerance)
    return state


def _edges(rod: ClampedRod) -> int:
    """How many edges follow the layers at the clamps of a rod that is pulled to the length of its chord."""
    strain = max(math.hypot(*rod.free_chord) / rod.free_length - 1.0, 0.0)
    tension = strain * rod.free_length**2 / rod.stretching_compliance
    return round(min(max(FEWEST, PER_LAYER * math.sqrt(tension)), MOST))


def _bent_to_clamps(rod: ClampedRod, edges: Array) -> Array:
    """Angles (n,) of the cubic that leads straight on but for the directions of its clamps, on `edges (n,)`."""
    x, y = rod.free_chord
    line = math.atan2(y, x)
    places = np.cumsum(edges) - 0.5 * edges
    left, right = 1.0 - 4.0 * places + 3.0 * places**2, 3.0 * places**2 - 2.0 * places
    return np.asarray(line + (rod.start - line) * left + (rod.end - line) * right)
