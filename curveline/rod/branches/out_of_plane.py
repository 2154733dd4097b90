"""A rod out of its plane while its nodes move: pushed off a plane in which it is unstable, until it is back in it.

It goes downhill at every pose, so that it falls on where a state in space is lost.
"""

from __future__ import annotations

import numpy as np

from curveline.rod.branches.continuation import FOLLOW_EDGES
from curveline.rod.branches.standing import stays_in_plane
from curveline.rod.branches.tracking import TrackedState, reached
from curveline.rod.clamped_rod import ClampedRod
from curveline.rod.problem import Array, Pose
from curveline.rod.spatial.energy import Shape, SpatialRod, moved, positions
from curveline.rod.spatial.lifting import NUDGE, frames_of, spatial_rod
from curveline.rod.spatial.relax import RelaxEnding, descend, largest_turn, lowest_mode

EDGES = 24
"""Of equal length, of a rod out of its plane, whose state is its `Shape` on these."""
LONGEST_STRIDE = 16
"""Poses, of those of a smooth motion, that are passed at once at most."""
LARGEST_TURN = 0.3
"""An edge that turns by more than this [rad] from pose to pose may have been taken past a state."""
FLAT = 1e-4
"""Distance from the plane, as a part of the length, up to which a rod is in it."""


def pushed_off(segment: ClampedRod, held: TrackedState) -> Shape | None:
    """Where the rod of a flat `segment` goes from a state of the plane, pushed off towards the viewer; None if lost."""
    rod = _rod_of(segment)
    angles = held.angles.reshape(EDGES, -1).mean(axis=1)
    shape = Shape(np.zeros(EDGES), frames_of(angles, np.zeros(EDGES), np.zeros(EDGES)))
    _, mode = lowest_mode(rod, shape)
    _, turn = moved(rod, shape, mode, 1.0)
    way = -1.0 if float(np.sum(mode[2::4])) < 0.0 else 1.0
    return _settled(rod, moved(rod, shape, mode, way * NUDGE / turn)[0])


def go_aside(poses: Array, segment: ClampedRod, aside: Shape, place: int) -> tuple[int, Shape | None]:
    """Take a rod out of the plane on through `poses (m, 5)` from a place until it is flat again, lost, or to the end.

    Returns the pose it came to and its state there.
    """
    last, stride = len(poses) - 1, 1
    while place < last:
        there = min(place + stride, last)
        rod = _rod_of(segment.moved_to(Pose(*poses[there].tolist())))
        state = _settled(rod, aside)
        if stride > 1 and (state is None or largest_turn(state, aside) > LARGEST_TURN):
            stride //= 2
            continue
        if state is None:
            return there, None
        place, aside = there, state
        if _depth(rod, state) < FLAT:
            break
        stride = min(2 * stride, LONGEST_STRIDE)
    return place, aside


def back_in_plane(segment: ClampedRod, aside: Shape) -> TrackedState | None:
    """The state of the plane that a rod is in; None if it is out of it, or would leave it."""
    if _depth(_rod_of(segment), aside) > FLAT:
        return None
    w, x, y, z = aside.frames.T
    angles = np.unwrap(np.arctan2(y * z - w * x, x * z + w * y))
    places, coarse = ((np.arange(n) + 0.5) / n for n in (FOLLOW_EDGES, EDGES))
    held = reached(segment, TrackedState(np.interp(places, coarse, angles), np.zeros(2)))
    return held if held is not None and stays(segment, held) else None


def stays(segment: ClampedRod, held: TrackedState) -> bool:
    """True if the rod of a flat segment stays in its plane in a state of it."""
    return bool(stays_in_plane(segment.pose, segment.bearing, held.angles, held.multipliers))


def seen(segment: ClampedRod, aside: Shape, points: int) -> Array:
    """The curve as it looks from the front, (points, 2) [m], equally spaced from pivot to pivot, seen from the left."""
    length, half = segment.length, 0.5 * segment.clamp
    free = positions(_rod_of(segment), aside)[:, :2] * segment.free_length
    places = np.concatenate([[0.0], half + np.linspace(0.0, segment.free_length, EDGES + 1), [length]])
    curve = np.vstack([[0.0, 0.0], np.array(segment.free_start) + free, segment.chord])
    at = np.linspace(0.0, length, points)
    return np.column_stack([np.interp(at, places, side) for side in curve.T])


def _rod_of(segment: ClampedRod) -> SpatialRod:
    """The rod of a segment on the edges that it has out of the plane."""
    return spatial_rod(segment, np.full(EDGES, 1.0 / EDGES))


def _settled(rod: SpatialRod, shape: Shape) -> Shape | None:
    """Downhill from a shape; None if that leads nowhere."""
    relaxed = descend(rod, shape)
    return relaxed.shape if relaxed.ending is RelaxEnding.SETTLED else None


def _depth(rod: SpatialRod, shape: Shape) -> float:
    """Largest distance from the plane, in units of the length."""
    return float(np.max(np.abs(positions(rod, shape)[:, 2])))
