"""Is there rod to spare between two clamps: slack, straight, or pulled between clamps that point elsewhere."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from curveline.rod.clamped_rod import ClampedRod
from curveline.rod.problem import Array, Bearing, Pose

STRAIGHT = 5e-4
"""Up to this excess of the free rod over its chord, as a fraction, it counts as straight: play and stretch decide which
way it bends, a quarter of a millimetre on the built-in displays."""


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


def missing(rod: ClampedRod) -> float:
    """How much rod is missing to lead from clamp to clamp [m], below 0 if none is."""
    return math.hypot(*rod.free_chord) - rod.free_length


def out_of_line(rod: ClampedRod) -> float:
    """How far the clamps point away from the straight line between them, the larger of two angles [rad]."""
    x, y = rod.free_chord
    line = math.atan2(y, x)
    return max(abs(rod.start - line), abs(rod.end - line))
