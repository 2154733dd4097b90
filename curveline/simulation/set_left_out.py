"""How far the set of a rod could move a curve of which nobody said what the rod went through before."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from curveline.material.history import duration_text
from curveline.material.relaxation import Relaxation
from curveline.rod.clamped_rod import ClampedRod
from curveline.rod.geometry.vertex_table import CURVATURE
from curveline.rod.models.model_error import SAFETY, Bound, farthest, probe
from curveline.rod.natural_curvature import NaturalCurvature, curvatures_at
from curveline.rod.problem import Array
from curveline.rod.states.equilibrium import SPATIAL, Equilibrium
from curveline.units import WEEK

HELD = WEEK
"""For how long another state may have been there before [s]."""
GIVES_WAY = 1e-3
"""Part of its length by which a curve may differ, besides, since the one before gave way to its weight meanwhile."""


def set_bound(law: Relaxation, states: Sequence[Equilibrium]) -> Bound | None:
    """How far the curve of any of some states moves if the rod was held in any other one for `HELD` before.

    Each is solved once more with the natural curvature that this leaves. None if there are no states in the plane.
    """
    planar = [each for each in states if each.model != SPATIAL and each.simple]
    share = law.set_after(HELD)
    probes = [probe(state) for state in planar]
    # While it is held a curve gives way to its weight, and its bend grows with what it keeps: a geometric series. Near
    # a fold it gives way the more the farther it has: of random heavy rods the sum is too small by a fifth at worst.
    gives = [each.moved(_bent(each.state.rod, each.state, share).scaled()) / (1.0 - share) ** 2 for each in probes]
    worst: tuple[float, str] = (-1.0, "")
    for probed in probes:
        state = probed.state
        for other, give in zip(planar, gives, strict=True):
            moved = 0.0 if other is state else probed.moved(_bent(state.rod, other, share).scaled())
            moved = SAFETY * (moved + give) + GIVES_WAY * state.rod.length
            if not math.isfinite(moved):
                moved = farthest(state.rod)
            if moved > worst[0]:
                worst = moved, f"{state.name}, held in the {other.name} for {duration_text(HELD)} before"
    if not planar:
        return None
    why = f"solved again with {100.0 * share:.0f} % of another state's curvature kept: {worst[1]}"
    return Bound(worst[0], why)


def _bent(rod: ClampedRod, other: Equilibrium, share: float) -> ClampedRod:
    """The rod with a share of the bend of another of its states as its natural curvature, besides what it has."""
    begin = rod.pose.begin + 0.5 * rod.clamp
    places = begin + np.concatenate(([0.0], np.cumsum(other.edges)))
    own: Array = np.zeros(places.size)
    if rod.is_unevenly_curved:
        own = np.asarray(curvatures_at(rod.bearing.profile, places))
    values = own + share * (other.vertices_table[:, CURVATURE] - rod.natural_curvature - own)
    table = NaturalCurvature(places, values).table
    return replace(rod, bearing=rod.bearing._replace(profile=table))
