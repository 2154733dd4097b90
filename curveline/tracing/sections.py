"""What of the rod's section a camera sees: how far face and skins reach across the curve, what of it teeth fill.

Everything is told in the plane of the rod's front face, by how far it lies to the left of the neutral fibre.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from curveline.cameras.view import SeenRod, View
from curveline.tracing.lines import SeenLine
from curveline.units import deg

Array = npt.NDArray[np.float64]

FLANK = deg(20.0)
ADDENDUM = 1.0 / 2.25
"""Of a tooth: the angle of its flanks, and the part of its height beyond the line where it is half a pitch thick."""
SLICES, PHASES = 10, 12
"""By which what the body covers is counted: from front to back, and along a tooth."""


class Reach(NamedTuple):
    """How far something reaches, to the left and the right of each of some points, each (n,) [m]."""

    low: Array
    high: Array


def front(seen: SeenRod) -> float:
    """The plane of the front face, z [m]."""
    return 0.5 * seen.depth


def back_of(seen: SeenRod) -> tuple[float, float]:
    """From where to where what has no teeth reaches [m]."""
    side = seen.side or 1
    return side * (-seen.fibre - 0.5 * seen.back), side * (0.5 * seen.back - seen.fibre)


def has_teeth(seen: SeenRod) -> bool:
    """True if there is a toothed side to be seen."""
    return seen.teeth > 0.0 and seen.pitch > 0.0 and seen.side != 0


def parallax(seen: SeenRod, view: View, line: SeenLine) -> tuple[Array, Array]:
    """By how much the rear edge is seen beside the front one, to the left and along, each (n,) [m]."""
    x, y, z = view.eye
    part = 1.0 - (z - front(seen)) / (z + front(seen))
    shift = part * (np.array([x, y]) - line.points)
    return np.sum(shift * line.normals, axis=1), np.sum(shift * line.directions, axis=1)


def silhouette(seen: SeenRod, view: View, line: SeenLine) -> Reach:
    """How far the rod reaches with its skins and teeth."""
    left, _ = parallax(seen, view, line)
    near, far = back_of(seen)
    tip = far + seen.side * seen.teeth
    low, high = min(near, far, tip), max(near, far, tip)
    return Reach(low + np.minimum(left, 0.0), high + np.maximum(left, 0.0))


def coverage(seen: SeenRod, view: View, line: SeenLine, across: Array) -> tuple[Array, Array]:
    """The part of the way along the rod that its face fills, and that its body does, each (n, m) at `across (m,)`."""
    left, along = parallax(seen, view, line)
    depths = np.linspace(0.0, 1.0, SLICES)
    moved = across[None, None, :] - depths[None, :, None] * left[:, None, None]
    widths = _half_widths(seen, moved)
    pitch = seen.pitch if has_teeth(seen) else 1.0
    phases = (np.arange(PHASES) + 0.5) / PHASES * pitch
    shifted = phases[None, None, :] - depths[None, :, None] * along[:, None, None]
    from_tooth = np.abs((shifted + 0.5 * pitch) % pitch - 0.5 * pitch)
    filled = from_tooth[:, :, :, None] < widths[:, :, None, :]
    body = filled.any(axis=1).mean(axis=1)
    face = np.clip(2.0 * _half_widths(seen, across) / pitch, 0.0, 1.0)
    return np.tile(face, (len(left), 1)), body


def _half_widths(seen: SeenRod, across: Array) -> Array:
    """Half of what is filled along a pitch: more than all of it in the back, nothing outside."""
    near, far = sorted(back_of(seen))
    if not has_teeth(seen):
        return np.where((across >= near) & (across <= far), 1.0, 0.0)
    slope = np.tan(FLANK)
    _, root_line = back_of(seen)
    height = seen.side * (across - root_line)
    dedendum = (1.0 - ADDENDUM) * seen.teeth
    tooth = 0.25 * seen.pitch + slope * (dedendum - height)
    return np.where(
        (across >= near) & (across <= far), seen.pitch, np.where((height > 0.0) & (height < seen.teeth), tooth, 0.0)
    )
