"""A rod while its nodes move from pose to pose: it buckles where it gets slack, follows its state, falls, goes taut.

state, events = ride(poses, bearing, start=None)
events                                              # [Event(FELL, 17, state)], what happened at which pose
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from curveline.rod._jit import njit
from curveline.rod.continuation import FOLLOW_EDGES, land, sway, travel
from curveline.rod.equilibrium import ClampedRod
from curveline.rod.problem import Array, Bearing, Pose
from curveline.rod.way import straight

SLACKEST_STRAIGHT = 2e-4
"""Below this excess of length over chord, as a fraction, the rod counts as straight: play and stretch take it up."""

BUCKLED = "buckled"
FELL = "fell"
PULLED = "pulled"
"""What happens to a rod: it leaves the straight, or the state it was in, or there is no rod to spare any more."""

State = tuple[Array, Array]
"""Angles (n,) of the edges and multipliers (2,)."""


class Event(NamedTuple):
    """What happened at which pose, and the state that the rod is in since; None where it is straight or lost."""

    kind: str
    place: int
    state: State | None


def ride(poses: Array, bearing: Bearing, start: State | None, bow: float = 0.0) -> tuple[State | None, list[Event]]:
    """The state at the last of `poses (m, 5)`, each as a `Pose`, and what happened on the way.

    The nodes go straight from each pose to the next. Without a state to `start` from the rod is straight, or takes one
    at the first pose. `bow` [m] is how far the middle of the rod itself stands out to the left of its chord when it
    first gets slack: see `buckle`.
    """
    spare = has_spare(poses, bearing)
    last = len(poses) - 1
    events: list[Event] = []
    state, index = start, 0
    while True:
        if state is None:
            index, state = _buckled(poses, bearing, (index, spare), bow)
            if state is None:
                return None, events
            events.append(Event(BUCKLED, index, state))
        if index == last:
            return state, events
        taut = np.flatnonzero(~spare[index + 1 :])
        end = index + int(taut[0]) if taut.size else last
        done, angles, forces = pass_through(poses[index : end + 1], bearing, *state)
        index += done + 1
        state = (angles, forces)
        if index <= end:
            state = _landed(Pose(*poses[index]), bearing, angles, forces)
            events.append(Event(FELL, index, state))
        elif end < last:
            state = None
            events.append(Event(PULLED, index, None))
        else:
            return state, events
        if state is None:
            # The pose itself has been tried, or has no rod to spare.
            if index == last:
                return None, events
            index += 1


def has_spare(poses: Array, bearing: Bearing) -> NDArray[np.bool_]:
    """True (m,) where there is rod to spare between the clamps at `poses (m, 5)`."""
    x, y, start, end, length = poses.T
    half = 0.5 * bearing.clamp
    chord = np.hypot(x - half * (np.cos(start) + np.cos(end)), y - half * (np.sin(start) + np.sin(end)))
    spare: NDArray[np.bool_] = length - bearing.clamp > chord * (1.0 + SLACKEST_STRAIGHT)
    return spare


def is_slack(rod: ClampedRod) -> bool:
    """True if `rod` has any to spare."""
    return bool(has_spare(np.array([rod.pose]), rod.bearing)[0])


def buckle(pose: Pose, bearing: Bearing, bow: float = 0.0) -> State | None:
    """The state into which a straight rod settles once it has rod to spare at `pose`; None if none is reached.

    It buckles in its first mode, to the side to which it leans: of a rod with a small bow of its own under its weight
    the two add up (Timoshenko and Gere 1961, section 1.12), so it buckles upwards where its `bow` [m] exceeds the sag
    of a straight one, w L^4 / (384 EI).
    """
    half = 0.5 * bearing.clamp
    free = pose.length - bearing.clamp
    chord = math.hypot(
        pose.x - half * (math.cos(pose.start) + math.cos(pose.end)),
        pose.y - half * (math.sin(pose.start) + math.sin(pose.end)),
    )
    side = 1.0 if bow > bearing.weight * free**4 / (384.0 * bearing.stiffness) else -1.0
    places = (np.arange(FOLLOW_EDGES) + 0.5) / FOLLOW_EDGES
    bend = 2.0 * math.sqrt(free / chord - 1.0) * np.sin(2.0 * math.pi * places)
    return _landed(pose, bearing, math.atan2(pose.y, pose.x) + side * bend, np.zeros(2))


def _buckled(
    poses: Array, bearing: Bearing, since: tuple[int, NDArray[np.bool_]], bow: float
) -> tuple[int, State | None]:
    """The first pose since an index at which the rod has a state again, and that state; None if it gets none."""
    first, spare = since
    for index in range(first, len(poses)):
        if spare[index] and (state := buckle(Pose(*poses[index]), bearing, bow)) is not None:
            return index, state
    return len(poses) - 1, None


def _landed(pose: Pose, bearing: Bearing, angles: Array, forces: Array) -> State | None:
    """Where the rod falls from `angles (n,)` at `pose`; None if nowhere."""
    landed, angles, forces = land(straight(pose, pose), 0.0, bearing, angles, forces, sway(angles.size))
    return (angles, forces) if landed else None


@njit
def pass_through(poses, bearing, phi, multipliers):
    """Follow the stable state `phi (n,)`, `multipliers (2,)` through `poses (m, 5)` from the first on.

    Returns how many of the ways between them it passed to the end, all or those before it was lost, and the state.
    """
    for k in range(1, poses.shape[0]):
        begin, end = poses[k - 1], poses[k]
        way = straight(
            Pose(begin[0], begin[1], begin[2], begin[3], begin[4]), Pose(end[0], end[1], end[2], end[3], end[4])
        )
        reached, phi, multipliers = travel(way, bearing, phi, multipliers)
        if reached < 1.0:
            return k - 1, phi, multipliers
    return poses.shape[0] - 1, phi, multipliers
