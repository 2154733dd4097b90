"""Which curve the rod of a display took: the nodes' actual motion, played through the rod's physics.

Nothing here knows the plan. The rod starts in the state it was last seen in, or buckles from straight as its weight
makes it; it follows its state while that stays stable, and falls downhill when it does not.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from curveline.plan import DriveTable, drive_table
from curveline.rod.continuation import FOLLOW_EDGES, coarse_start, land, sway, travel
from curveline.rod.equilibrium import ClampedRod
from curveline.rod.problem import Array
from curveline.rod.states import find_states
from curveline.rod.way import straight
from curveline.scene import Display, Node
from curveline.simulation import DEFAULT_TOLERANCE, clamped_rod
from curveline.units import deg, mm

Counts = tuple[int, int, int]
Motion = Sequence[tuple[float, tuple[Counts, ...]]]

STRAIGHT = "straight"
LOST = "lost"

SLACKEST_STRAIGHT = 2e-4
"""Below this excess of length over chord, as a fraction, the rod counts as straight: play and stretch take it up."""

SAME_ANGLES = 0.1
"""Edges of the same state, on a coarse rod and on a fine one, differ by less than this [rad], also near a fold."""


@dataclass(frozen=True)
class Snap:
    """The rod of a segment left its state: when [s], which segment (from 1), from what, to what."""

    seconds: float
    segment: int
    before: str
    after: str


@dataclass(frozen=True)
class Playback:
    """What the rod did: the states of all segments at the start and at the end, and every snap-through between."""

    start: tuple[str, ...]
    states: tuple[str, ...]
    snaps: tuple[Snap, ...]


def replay(display: Display, motion: Motion, before: Sequence[str] = ()) -> Playback:
    """Play `motion`, (seconds, counts of every node) in order of time, through the rod.

    `before` names the state of each segment at the start, where it is known.
    """
    drive = drive_table(display)
    starts, ends, snaps = [], [], []
    for segment in range(display.node_count - 1):
        rods = [
            (seconds, clamped_rod(display, *_at(display, drive, counts[segment : segment + 2])))
            for seconds, counts in motion
        ]
        known = before[segment] if segment < len(before) else ""
        actor = _Actor(segment + 1, rods[0][1], known)
        starts.append(actor.name())
        for seconds, rod in rods[1:]:
            actor.move(seconds, rod)
        ends.append(actor.name())
        snaps.extend(actor.snaps)
    return Playback(tuple(starts), tuple(ends), tuple(sorted(snaps, key=lambda snap: snap.seconds)))


def _at(display: Display, drive: DriveTable, counts: Sequence[Counts]) -> tuple[tuple[Node, Node], float]:
    """The two nodes of a segment and the rod between them, from their encoder counts."""
    feed, bias, lift = drive.axes
    left, right = (Node(mm(lift.value(node[2])), deg(bias.value(node[1]))) for node in counts)
    return (left, right), display.span + mm(feed.value(counts[0][0]) - feed.value(counts[1][0]))


class _Actor:
    """The rod of one segment while its nodes move; `angles` is None while it is straight or lost."""

    def __init__(self, segment: int, rod: ClampedRod, known: str) -> None:
        self.segment = segment
        self.rod = rod
        self.angles: Array | None = None
        self.forces = np.zeros(2)
        self.snaps: list[Snap] = []
        self.label = STRAIGHT
        if known not in ("", STRAIGHT, LOST):
            state = next((state for state in find_states(rod, DEFAULT_TOLERANCE) if state.name == known), None)
            if state is not None:
                self.angles, self.forces = coarse_start(state)
                self.label = known
        if self.angles is None:
            self._buckle()

    def move(self, seconds: float, rod: ClampedRod) -> None:
        """Bring the nodes straight to where `rod` has them, at `seconds`."""
        before, self.rod = self.rod, rod
        if self.angles is None or _is_straight(rod):
            self._buckle()
            return
        way = straight(before.pose, rod.pose)
        reached, self.angles, self.forces = travel(way, rod.bearing, self.angles, self.forces)
        if reached < 1.0:
            self._snap(seconds)

    def name(self) -> str:
        """What the curve is called where the nodes stand now."""
        if self.angles is None:
            return STRAIGHT if _is_straight(self.rod) else LOST
        return _name(self.rod, self.angles)

    def _snap(self, seconds: float) -> None:
        """Fall from a state that is no longer stable to wherever the rod goes."""
        before = self.label
        landed = self.angles is not None and self._land(self.angles, self.forces)
        if not landed:
            self.angles, self.forces = None, np.zeros(2)
        self.label = self.name()
        self.snaps.append(Snap(seconds, self.segment, before, self.label))

    def _land(self, angles: Array, forces: Array) -> bool:
        """Take the state into which the rod falls from `angles (n,)` where the nodes stand now; False if none."""
        here = straight(self.rod.pose, self.rod.pose)
        landed, angles, forces = land(here, 0.0, self.rod.bearing, angles, forces, sway(angles.size))
        if landed:
            self.angles, self.forces = angles, forces
        return bool(landed)

    def _buckle(self) -> None:
        """Let a straight rod sag under its weight into the excess length, and settle, once there is rod to spare."""
        self.angles = None
        if _is_straight(self.rod):
            return
        places = (np.arange(FOLLOW_EDGES) + 0.5) / FOLLOW_EDGES
        chord = math.atan2(self.rod.chord[1], self.rod.chord[0])
        excess = self.rod.free_length / math.hypot(*self.rod.free_chord) - 1.0
        sagging = chord - 2.0 * math.sqrt(excess) * np.sin(2.0 * math.pi * places)
        if self._land(sagging, np.zeros(2)):
            self.label = self.name()


def _is_straight(rod: ClampedRod) -> bool:
    """True if there is no rod to spare between the clamps."""
    return rod.free_length <= math.hypot(*rod.free_chord) * (1.0 + SLACKEST_STRAIGHT)


def _name(rod: ClampedRod, angles: Array) -> str:
    """The name of the state of `rod` that has these edges' `angles (n,)`; "lost" if no stable state has them."""
    nearest, name = SAME_ANGLES, LOST
    for state in find_states(rod, DEFAULT_TOLERANCE):
        distance = float(np.max(np.abs(coarse_start(state, angles.size)[0] - angles)))
        if distance < nearest:
            nearest, name = distance, state.name
    return name
