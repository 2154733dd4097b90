"""Angles of a file that look like radians, although files have degrees: legal, and hardly meant."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence

from curveline.listening import Listener
from curveline.scene import STRAIGHT, Scene
from curveline.units import to_deg

QUARTER, TURN = 0.5 * math.pi + 0.01, 2.0 * math.pi + 0.01
"""What an angle in radians hardly exceeds, of a direction and of a roll; as numbers of degrees these are small."""


def look_like_radians(values: Sequence[float], most: float = QUARTER) -> bool:
    """Whether angles [deg] are so small, and of so many digits, that they are more likely in radians."""
    some = [value for value in values if value != 0.0]
    return bool(some) and all(abs(value) <= most for value in some) and any(value != round(value) for value in some)


def remark_on_radians(scene: Scene) -> str:
    """What is odd about the angles of a shape, as a sentence; empty if nothing is."""
    nodes = scene.nodes
    angles = {
        "angle_deg": ([to_deg(node.angle) for node in nodes], QUARTER),
        "yaw_deg": ([to_deg(node.yaw) for node in nodes], QUARTER),
        "roll_deg": ([to_deg(node.roll) for node in nodes], TURN),
    }
    if any(segment.state == STRAIGHT for segment in scene.segments):
        # Nodes of straight segments hardly turn.
        del angles["angle_deg"]
    # What went to SI and back is a number of few digits again.
    shown = {key: [float(f"{value:.12g}") for value in values] for key, (values, _) in angles.items()}
    odd = [key for key, (_, most) in angles.items() if look_like_radians(shown[key], most)]
    if not odd:
        return ""
    first = next(value for value in shown[odd[0]] if value != round(value))
    ask, say = ("is", "it is") if len(odd) == 1 else ("are", "they are")
    keys, other = " and ".join(odd), f"{first:g} rad would be {to_deg(first):.4g} deg"
    return f"{ask} {keys} in radians? {say} taken as degrees: {other}"


def tell_of_radians(scenes: Iterable[Scene], listener: Listener) -> None:
    """Tell, once per file, of what is odd about the angles of shapes."""
    for path, scene in {scene.path or scene.name: scene for scene in scenes}.items():
        if sentence := remark_on_radians(scene):
            listener.note(f"{path}: {sentence}")
