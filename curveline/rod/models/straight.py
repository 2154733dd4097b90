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
from curveline.rod.states.slack import straight_edges

EDGES = 48
"""With which a straight rod is solved first."""
SOFTER = np.arange(5.0, -0.25, -0.5)
"""By how many powers of ten a rod stretches more, from one step to the next, until it does as it should."""
SETTLE = Effort(turn=0.5, close=1e-9, iterations=200)
SURELY = 0.9
"""Of Euler's load, which is that of small slopes."""


def is_too_short_to_buckle(rod: ClampedRod) -> bool:
    """True if a `rod` that `slack.is_straight` has one state only: what it has to spare it takes up by less force than
    makes it buckle.

    Between gentle clamps what a rod takes up, by strain P / EA and by bending, grows with the thrust P up to Euler's
    load, and below that there is one curve for each; so a second one takes a strain above that of the load. Weight and
    loads along the rod may all push on the part of it that is pressed most.
    """
    x, y = rod.free_chord
    way = math.hypot(x, y)
    along = [abs(x * load.x + y * load.y) / way for load in rod.loads]
    along.append(abs(x * rod.weight_x - y * rod.weight) / way * rod.free_length)
    thrust = (1.0 - way / rod.free_length) * rod.section.stretching_stiffness + math.fsum(along)
    modes = 1.0 if rod.has_giving_clamps else 4.0
    return thrust < SURELY * modes * math.pi**2 * rod.stiffness / rod.free_length**2


def straight_state(rod: ClampedRod, tolerance: float) -> Equilibrium:
    """The state of a `rod` that `slack.is_straight`, by the extensible model, to `tolerance` [m]; its outcome tells
    whether it was found."""
    rod = rod.extensible()
    edges = mesh(rod.scaled().at, straight_edges(rod, EDGES))
    state = refine(rod, edges, _bent_to_clamps(rod, edges), np.zeros(2), tolerance)
    return _stiffened(rod, edges, tolerance) if state.outcome in GONE else state


def _stiffened(rod: ClampedRod, edges: Array, tolerance: float) -> Equilibrium:
    """The state to which that of a rod leads which stretches at next to no force, as it resists more and more."""
    scaled = rod.scaled()
    phi, multipliers = _bent_to_clamps(rod, edges), np.zeros(2)
    for power in SOFTER:
        softer = scaled._replace(compliance=scaled.compliance * 10.0 ** float(power))
        descend(make_problem(softer, edges), phi, multipliers, SETTLE)
    return refine(rod, edges, phi, multipliers, tolerance)


def _bent_to_clamps(rod: ClampedRod, edges: Array) -> Array:
    """Angles (n,) of the cubic that leads straight on but for the directions of its clamps, on `edges (n,)`."""
    x, y = rod.free_chord
    line = math.atan2(y, x)
    places = np.cumsum(edges) - 0.5 * edges
    left, right = 1.0 - 4.0 * places + 3.0 * places**2, 3.0 * places**2 - 2.0 * places
    return np.asarray(line + (rod.start - line) * left + (rod.end - line) * right)
