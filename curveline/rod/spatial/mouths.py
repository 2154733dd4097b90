"""Kernels for where the mouths of bearings that give are: the rod is clamped there, and its bearing may be tilted.

A bearing turns about its pivot, on the shaft of a motor that points to the viewer, along z, so it tilts about z alone:
out of the display's plane and about its own tangent it is rigid. `tilt` [rad] counts from where the motor holds it, as
`SpatialRod.frames` and `chord` do; rotations that shapes carry along at the ends count from there, too.
"""

from __future__ import annotations

import numpy as np

from curveline.kernels.kernel import leaf
from curveline.rod.geometry.rotations import product

GIVE, PLAY, REACH = range(3)
"""Places in a rod's `bearings`, see `planar.clamps`."""


@leaf
def gives(rod):
    """True for a rod whose clamps do not stand where the motors hold them."""
    return rod.bearings[GIVE] > 0.0 or rod.bearings[PLAY] > 0.0


@leaf
def mouth_frame(frames, tilt, end):
    """Frame, four numbers, of the mouth at an `end`, 0 the first and 1 the last; motors hold it as `frames (2, 4)`."""
    w, x, y, z = frames[end, 0], frames[end, 1], frames[end, 2], frames[end, 3]
    if tilt == 0.0:
        return w, x, y, z
    c, s = np.cos(0.5 * tilt), np.sin(0.5 * tilt)
    return c * w - s * z, c * x - s * y, c * y + s * x, c * z + s * w


@leaf
def copy_mouth(rod, shape, end, out):
    """Overwrite `out (4,)` with the frame of the mouth that a shape has at an `end`."""
    out[0], out[1], out[2], out[3] = mouth_frame(rod.frames, shape.tilts[end], end)


@leaf
def upright(frame):
    """Direction to the viewer, z, as seen from a `frame` of four numbers."""
    w, x, y, z = frame[0], frame[1], frame[2], frame[3]
    return 2.0 * (x * z - w * y), 2.0 * (y * z + w * x), w * w - x * x - y * y + z * z


@leaf
def seen_from_mouth(frames, turn, tilt, end):
    """Rotation, four numbers, between a mouth and the edge beside it, of their `turn (4,)` were it not for the tilt.

    Motors hold the mouths as `frames (2, 4)`.
    """
    q = turn[0], turn[1], turn[2], turn[3]
    if tilt == 0.0:
        return q
    v0, v1, v2 = upright((frames[end, 0], frames[end, 1], frames[end, 2], frames[end, 3]))
    c, s = np.cos(0.5 * tilt), np.sin(0.5 * tilt)
    q = product((c, -s * v0, -s * v1, -s * v2), q) if end == 0 else product(q, (c, s * v0, s * v1, s * v2))
    return (-q[0], -q[1], -q[2], -q[3]) if q[0] < 0.0 else q


@leaf
def arm(rod, tilt, end):
    """From pivot to mouth, or at the last end back from the mouth, what of that is in the plane: x, y."""
    w, x, y, z = mouth_frame(rod.frames, tilt, end)
    reach = rod.bearings[REACH]
    return 2.0 * reach * (x * z + w * y), 2.0 * reach * (y * z - w * x)


@leaf
def mouth_shift(rod, tilt, end):
    """By what a `tilt` takes the chord's end: of the first mouth how far it moves, of the last one that backwards."""
    if tilt == 0.0:
        return 0.0, 0.0
    x, y = arm(rod, tilt, end)
    a, b = arm(rod, 0.0, end)
    return x - a, y - b
