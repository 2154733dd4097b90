"""A rod while its nodes move from pose to pose: it buckles where it gets slack, follows its state, falls, goes taut.

state, events = move_through(poses, segment, start=None)
events                                              # [Event(FELL, 17, state)], what happened at which pose

In the plane a state is that of a coarse rod, on finer edges where these alone keep it. A rod that leaves its plane goes
on in space, see `out_of_plane`, until it is back.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from curveline.rod.branches.continuation import FOLLOW_EDGES
from curveline.rod.branches.control_path import between, straight_path
from curveline.rod.branches.out_of_plane import back_in_plane, go_aside, pushed_off, stays
from curveline.rod.branches.standing import landed
from curveline.rod.branches.strides import looks_kept, pass_through
from curveline.rod.branches.tracking import TrackedState, on_edges
from curveline.rod.clamped_rod import ClampedRod
from curveline.rod.natural_curvature import curvatures_at
from curveline.rod.problem import Array, Bearing, Pose
from curveline.rod.spatial.energy import Shape
from curveline.rod.states.slack import has_spare

FINER_EDGES = (4 * FOLLOW_EDGES, 16 * FOLLOW_EDGES)
"""Edges of a state that coarser ones lose: their folds come earlier than those of the rod."""

LOOKS = 4
"""Steps of a way from pose to pose in which it is tried whether finer edges keep a state; if they do not even keep it
through the first, still finer ones are not tried."""

BUCKLED = "buckled"
FELL = "fell"
PULLED = "pulled"
LEFT = "left"
RETURNED = "returned"
"""What happens to a rod: it leaves the straight, or the state it was in, or there is no rod to spare any more; it
leaves the plane, or comes back to it."""

State = TrackedState | Shape
"""Of a rod in its plane, and out of it."""


class Event(NamedTuple):
    """What happened at which pose, and the state that the rod is in since; None where it is straight or lost."""

    kind: str
    place: int
    state: State | None


def move_through(
    poses: Array, segment: ClampedRod, start: State | None, bow: float = 0.0
) -> tuple[State | None, list[Event]]:
    """The state at the last of `poses (m, 5)`, each as a `Pose`, and what happened on the way.

    The nodes go straight from each pose to the next, with the rod of a flat `segment` between them. Without a state to
    `start` from the rod is straight, or takes one at the first pose. `bow` [m] is how far the middle of the rod itself
    stands out to the left of its chord when it first gets slack: see `buckle`.
    """
    rider = _MovedRod(poses, segment, start)
    while rider.place < rider.last or (rider.state is None and not rider.is_done):
        if rider.state is None:
            rider.wait(bow)
        elif isinstance(rider.state, Shape):
            rider.go_aside(rider.state)
        else:
            rider.follow(rider.state)
    return rider.state, rider.events


class _MovedRod:
    """A rod on its way through `poses`: at which it is, in which state, what happened.

    It `is_done` if it has no state at the last pose, and gets none.
    """

    def __init__(self, poses: Array, segment: ClampedRod, start: State | None) -> None:
        self.poses = poses
        self.segment = segment
        self.bearing = segment.bearing
        self.state = start
        self.events: list[Event] = []
        self.place = 0
        self.last = len(poses) - 1
        self.is_done = False
        self._spare = has_spare(poses, self.bearing)

    def wait(self, bow: float) -> None:
        """Go on straight until the rod buckles, or to the end."""
        for place in range(self.place, self.last + 1):
            if self._spare[place] and (state := buckle(self._pose(place), self.bearing, bow)) is not None:
                self._turn_to(BUCKLED, place, state)
                return
        self.place, self.is_done = self.last, True

    def follow(self, held: TrackedState) -> None:
        """Follow a state in the plane until it is lost, the rod is taut, or to the end."""
        end = self._slack_until()
        done, held, leaves = _passed(self.poses[self.place : end + 1], self.segment, held)
        self.place += done
        self.state = held
        if self.place < end:
            self.place += 1
            if leaves:
                self._leave(held)
            else:
                self._turn_to(FELL, self.place, _landed(self._pose(self.place), self.bearing, held))
        elif end < self.last:
            self._be_pulled(end)

    def go_aside(self, aside: Shape) -> None:
        """Go on out of the plane until the rod comes back to it or is taut, or to the end."""
        end = self._slack_until()
        self.place, state = go_aside(self.poses[: end + 1], self.segment, aside, self.place)
        self.state = state
        if state is None:
            self.events.append(Event(FELL, self.place, None))
        elif (held := back_in_plane(self._at(self.place), state)) is not None:
            self.state = held
            self.events.append(Event(RETURNED, self.place, held))
        elif self.place == end < self.last:
            self._be_pulled(end)

    def _turn_to(self, kind: str, place: int, state: TrackedState | None) -> None:
        """Be in a state of the plane, or of none, since something happened; it may be one in which no rod stays."""
        self.place, self.state = place, state
        self.events.append(Event(kind, place, state))
        if state is None:
            self._step_on()
        elif not stays(self._at(place), state):
            self._leave(state)

    def _leave(self, held: TrackedState) -> None:
        """Leave the plane from a state that is none in space."""
        self.state = pushed_off(self._at(self.place), held)
        self.events.append(Event(LEFT, self.place, self.state))
        if self.state is None:
            self._step_on()

    def _be_pulled(self, end: int) -> None:
        self.place, self.state = end + 1, None
        self.events.append(Event(PULLED, self.place, None))

    def _step_on(self) -> None:
        """Without a state at a pose: the pose itself has been tried."""
        self.is_done = self.place == self.last
        self.place = min(self.place + 1, self.last)

    def _slack_until(self) -> int:
        """The last pose before the rod is taut."""
        taut = np.flatnonzero(~self._spare[self.place + 1 :])
        return self.place + int(taut[0]) if taut.size else self.last

    def _pose(self, place: int) -> Pose:
        return Pose(*self.poses[place].tolist())

    def _at(self, place: int) -> ClampedRod:
        return self.segment.moved_to(self._pose(place))


def buckle(pose: Pose, bearing: Bearing, bow: float = 0.0) -> TrackedState | None:
    """The state into which a straight rod settles once it has rod to spare at `pose`; None if none is reached.

    It buckles in its first mode, to the side to which it leans: of a rod with a small bow of its own under its weight
    the two add up (Timoshenko and Gere 1961, section 1.12), so it buckles upwards where its `bow` [m] exceeds the sag
    of a straight one, w L^4 / (384 EI). A natural curvature that varies along the rod adds to its bow what it has of
    that of the mode, (1 - cos(2 pi s)) / 2.
    """
    half = 0.5 * bearing.clamp
    free = pose.length - bearing.clamp
    chord = math.hypot(
        pose.x - half * (math.cos(pose.start) + math.cos(pose.end)),
        pose.y - half * (math.sin(pose.start) + math.sin(pose.end)),
    )
    bow += _bow_of(pose, bearing)
    side = 1.0 if bow > bearing.weight * free**4 / (384.0 * bearing.stiffness) else -1.0
    places = (np.arange(FOLLOW_EDGES) + 0.5) / FOLLOW_EDGES
    bend = 2.0 * math.sqrt(free / chord - 1.0) * np.sin(2.0 * math.pi * places)
    guess = TrackedState(math.atan2(pose.y, pose.x) + side * bend, np.zeros(2))
    return _landed(pose, bearing, guess)


def _bow_of(pose: Pose, bearing: Bearing) -> float:
    """How far the middle of the straight rod stands out upwards by its natural curvature, between clamps [m]."""
    if len(bearing.profile) == 0:
        return 0.0
    free = pose.length - bearing.clamp
    shares = (np.arange(FOLLOW_EDGES) + 0.5) / FOLLOW_EDGES
    own = curvatures_at(bearing.profile, pose.begin + 0.5 * bearing.clamp + free * shares)
    return float(free**2 / math.pi**2 * np.mean(own * np.cos(2.0 * math.pi * shares)))


def _landed(pose: Pose, bearing: Bearing, held: TrackedState) -> TrackedState | None:
    """Where the rod falls in its plane from a state that is gone at `pose`; None if nowhere."""
    is_down, angles, multipliers = landed(pose, bearing, held.angles, held.multipliers)
    return TrackedState(angles, multipliers) if is_down else None


def _passed(poses: Array, segment: ClampedRod, held: TrackedState) -> tuple[int, TrackedState, bool]:
    """How many of the ways between `poses` a state passes, on finer edges where it takes them, and where it is then.

    The last is True if the rod leaves its plane on the next way.
    """
    done, held, leaves = _passed_on(poses, segment.bearing, held)
    for n in FINER_EDGES:
        if done == len(poses) - 1:
            break
        begin, end = (Pose(*poses[place].tolist()) for place in (done, done + 1))
        fine = on_edges(segment.moved_to(begin), held, n) if n > held.angles.size else None
        if fine is None:
            continue
        # Whether finer edges help is soon told, and mostly they do not: the rod falls.
        kept, angles, forces = looks_kept(
            straight_path(begin, end), segment.bearing, fine.angles, fine.multipliers, LOOKS
        )
        if kept == 0:
            break
        if kept < LOOKS:
            # A look that comes too late for a long way is no fall yet: where it was lost it is looked at more often.
            lost = straight_path(between(begin, end, kept / LOOKS), between(begin, end, (kept + 1) / LOOKS))
            kept, _, _ = looks_kept(lost, segment.bearing, angles, forces, LOOKS)
        if kept == LOOKS:
            further, led, leads_out = _passed_on(poses[done:], segment.bearing, fine)
            if further > 0:
                done, held, leaves = done + further, led, leads_out
    return done, held, leaves


def _passed_on(poses: Array, bearing: Bearing, held: TrackedState) -> tuple[int, TrackedState, bool]:
    """As `_passed`, on the edges that the state is on; the state is that at the last pose it came to."""
    done, angles, multipliers, leaves = pass_through(poses, bearing, held.angles, held.multipliers)
    return done, TrackedState(angles, multipliers), leaves
