"""Is there rod to spare between two clamps: slack, straight, or pulled between clamps that point elsewhere."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from curveline.rod.clamped_rod import ClampedRod
from curveline.rod.problem import Array, Bearing, Pose
from curveline.units import TAUT, deg

STRAIGHT = 5e-4
"""Up to this excess of the free rod over its chord, as a fraction, it counts as straight: play and stretch decide which
way it bends, a quarter of a millimetre on the built-in displays."""
PER_LAYER = 8.0
"""Edges in the length sqrt(EI / T) in which a rod under a tension T bends back to the line."""
MOST_EDGES = 3000
OUT_OF_LINE = deg(5.0)
"""Without rod to spare, a clamp that points further away from the chord [rad] asks for more than motors give: under a
pull T, bending back to the chord takes up sqrt(EI/T)/4 times the angle squared of the rod; of two such clamps of the
built-in displays, at the 8 N of their motors, all that a straight rod may have to spare."""


def has_spare(poses: Array, bearing: Bearing) -> NDArray[np.bool_]:
    """True (m,) where there is rod to spare between the clamps at `poses (m, 5 or 6)`."""
    at = Pose(*poses.T)
    half = 0.5 * bearing.clamp
    chord = np.hypot(
        at.x - half * (np.cos(at.start) + np.cos(at.end)), at.y - half * (np.sin(at.start) + np.sin(at.end))
    )
    spare: NDArray[np.bool_] = at.length - bearing.clamp > chord * (1.0 + STRAIGHT)
    return spare


def is_slack(rod: ClampedRod) -> bool:
    """True if `rod` has any to spare; it is straight if not."""
    return rod.free_length > math.hypot(*rod.free_chord) * (1.0 + STRAIGHT)


def straight_edges(rod: ClampedRod, fewest: int) -> int:
    """How many equal edges, at least so many, follow the layers at the clamps of a rod that is straight.

    It is pulled to the length of its chord, or hangs there like a chain: of that length and of the weight W, one that
    stretches by EA has a pull of (EA W^2 / 24)^(1/3).
    """
    strain = max(math.hypot(*rod.free_chord) / rod.free_length - 1.0, 0.0)
    stiffness, weight = rod.section.stretching_stiffness, rod.weight * rod.free_length
    pull = strain * stiffness + (stiffness * weight**2 / 24.0) ** (1.0 / 3.0)
    return round(min(max(fewest, PER_LAYER * math.sqrt(pull / rod.stiffness) * rod.free_length), MOST_EDGES))


def least_slack(rod: ClampedRod) -> float:
    """The length from pivot to pivot [m] up to which `rod` has none to spare between its clamps."""
    return rod.clamp + math.hypot(*rod.free_chord) * (1.0 + STRAIGHT)


def missing(rod: ClampedRod) -> float:
    """How much rod is missing to lead from clamp to clamp [m], below 0 if none is."""
    return math.hypot(*rod.free_chord) - rod.free_length


def out_of_line(rod: ClampedRod) -> float:
    """How far the clamps point away from the straight line between them, the larger of two angles [rad]."""
    x, y = rod.free_chord
    line = math.atan2(y, x)
    return max(abs(rod.start - line), abs(rod.end - line))


def is_straight(rod: ClampedRod) -> bool:
    """True if `rod` has none to spare, lacks no more than it can stretch, and its clamps point along it.

    None whose clamps point out of the plane is, since where it leads to is told by its angles in the plane.
    """
    if is_slack(rod) or any(rod.yaw):
        return False
    return missing(rod) <= min(TAUT, STRAIGHT * rod.free_length) and out_of_line(rod) <= OUT_OF_LINE


def are_straight(poses: Array, bearing: Bearing) -> NDArray[np.bool_]:
    """As `is_straight`, (m,), at `poses (m, 5 or 6)` in the plane."""
    at = Pose(*poses.T)
    half, free = 0.5 * bearing.clamp, at.length - bearing.clamp
    x = at.x - half * (np.cos(at.start) + np.cos(at.end))
    y = at.y - half * (np.sin(at.start) + np.sin(at.end))
    line, short = np.arctan2(y, x), np.hypot(x, y) - free
    straight: NDArray[np.bool_] = ~has_spare(poses, bearing) & (short <= np.minimum(TAUT, STRAIGHT * free))
    return straight & (np.maximum(np.abs(at.start - line), np.abs(at.end - line)) <= OUT_OF_LINE)
