"""Why a rod shows no stable state, or not the wanted one, and what to change, in a sentence."""

from __future__ import annotations

import math

from curveline.rod.clamped_rod import ClampedRod
from curveline.rod.planar.approach import THIN, layer
from curveline.rod.states.identity import PEAK, STRAIGHT, VALLEY
from curveline.rod.states.planar_states import find_states
from curveline.rod.states.slack import OUT_OF_LINE, is_slack, is_straight, least_slack, missing, out_of_line
from curveline.units import TAUT, mm, rounded_up, to_deg, to_mm

EXCESSES = (1e-3, 0.01, 0.1)
"""By how much longer than the way from clamp to clamp a rod is tried that is too short, as parts of it."""
DIGITS = 4


def why_none(rod: ClampedRod, windings: tuple[int, ...] = (0,)) -> str:
    """What keeps `rod` from having a stable state that `find_states` can show, and what to change about it.

    `windings` are the further turns of the tangent that were looked for.
    """
    short = math.hypot(*rod.free_chord) - rod.free_length
    if short >= 0.0:
        what = "is too short to lead from clamp to clamp" if rod.free_length > 0.0 else "does not leave its bearings"
        return f"the rod {what}: lengthen it{_by(rod, short)}"
    if 0 not in windings:
        return "no loop was found that stays in its place: on a taut rod it slides; lengthen the rod"
    if layer(rod.scaled()) < THIN:
        unloaded = layer(rod.scaled()._replace(weight=0.0, forces=0.0 * rod.scaled().forces))
        if unloaded < THIN:
            return "the rod is too taut for clamps that point elsewhere: lengthen it, or lessen their angles"
        return "the rod is too weak for its weight and loads: stiffen or shorten it, or lessen the loads"
    return "no stable state was found: lessen the angles of the clamps, or change the length"


def why_not(rod: ClampedRod, wanted: str) -> str:
    """Why a `rod` that has other states is not in the `wanted` one, where a straight rod is no curved one or the other
    way round, and what to change; empty where it is something else."""
    if wanted == STRAIGHT:
        return _why_bent(rod)
    if wanted in (PEAK, VALLEY) and is_straight(rod):
        enough = rounded_up(to_mm(least_slack(rod)), DIGITS + 2)
        return (
            f'it has no rod to spare: write state = "{STRAIGHT}", or give it more than {enough:.10g} mm of rod to bend'
        )
    return ""


def _why_bent(rod: ClampedRod) -> str:
    """What keeps a rod from being straight, and what to change."""
    line = math.hypot(*rod.free_chord) + rod.clamp
    takes = f"give it the {to_mm(line):.6g} mm that lead straight from node to node"
    if missing(rod) > TAUT:
        return f"it is {to_mm(missing(rod)):.3g} mm too short: {takes}"
    if out_of_line(rod) > OUT_OF_LINE:
        rise = to_deg(math.atan2(rod.free_chord[1], rod.free_chord[0]))
        return (
            f"its nodes point {to_deg(out_of_line(rod)):.3g} deg past each other, and a straight rod takes "
            f"{to_deg(OUT_OF_LINE):.3g} deg at most: turn them towards the line between them, at {rise:.3g} deg"
        )
    bends = "bend it" if is_slack(rod) else "let it lie on either side"
    return (
        f"the {-to_mm(missing(rod)):.3g} mm of rod that it has to spare {bends}: {takes}, or ask for a peak or a valley"
    )


def _by(rod: ClampedRod, short: float) -> str:
    """By how much a rod that is `short` [m] is to be lengthened to have a stable state, if that was found: words."""
    way = math.hypot(*rod.free_chord)
    for excess in EXCESSES:
        longer = mm(rounded_up(to_mm(short + excess * way), DIGITS))
        if find_states(rod.moved_to(rod.pose._replace(length=rod.length + longer)), 1e-3 * rod.length):
            return f" by {to_mm(longer):.10g} mm"
    return ""
