"""Why a rod shows no stable state, and what to change, in a sentence."""

from __future__ import annotations

import math

from curveline.rod.approach import THIN, layer
from curveline.rod.equilibrium import ClampedRod
from curveline.units import to_mm


def why_none(rod: ClampedRod, windings: tuple[int, ...] = (0,)) -> str:
    """What keeps `rod` from having a stable state that `find_states` can show, and what to change about it.

    `windings` are the further turns of the tangent that were looked for.
    """
    way = math.hypot(*rod.free_chord)
    if not rod.free_length > 0.0:
        return "the bearings hold the whole rod: lengthen it"
    if rod.free_length <= way:
        short = to_mm(way - rod.free_length)
        return f"the rod is too short to lead from clamp to clamp: lengthen it by more than {short:.4g} mm"
    if 0 not in windings:
        return "no loop was found that stays in its place: on a taut rod it slides; lengthen the rod"
    if layer(rod.scaled()) < THIN:
        unloaded = layer(rod.scaled()._replace(weight=0.0, forces=0.0 * rod.scaled().forces))
        if unloaded < THIN:
            return "the rod is too taut for clamps that point elsewhere: lengthen it, or lessen their angles"
        return "the rod is too weak for its weight and loads: stiffen or shorten it, or lessen the loads"
    return "no stable state was found: lessen the angles of the clamps, or change the length"
