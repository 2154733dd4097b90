"""Which curve the rod of a display took: the nodes' actual motion, played through the rod's physics.

Nothing here knows the plan. The rod starts in the state it was last seen in, or buckles from straight as its weight
makes it; it follows its state while that stays stable, and falls downhill when it does not.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from curveline.plan import DriveTable, drive_table
from curveline.rod.continuation import coarse_start
from curveline.rod.course import BUCKLED, FELL, Event, State, is_slack, ride
from curveline.rod.equilibrium import ClampedRod
from curveline.rod.states import find_states
from curveline.scene import STRAIGHT, Display, Node
from curveline.simulation import DEFAULT_TOLERANCE, clamped_rod
from curveline.units import deg, mm

Counts = tuple[int, int, int]
Motion = Sequence[tuple[float, tuple[Counts, ...]]]

LOST = "lost"

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
        course = list(_course(motion, segment))
        rods = [clamped_rod(display, *segment_at(display, drive, pair)) for _, pair in course]
        start = known_state(rods[0], before[segment] if segment < len(before) else "")
        state, events = ride(np.array([rod.pose for rod in rods]), rods[0].bearing, start)
        first = events[0].state if start is None and events and events[0].place == 0 else start
        starts.append(name_of(rods[0], first))
        ends.append(name_of(rods[-1], state))
        for place, names in _snaps(starts[-1], rods, events):
            snaps.append(Snap(course[place][0], segment + 1, *names))
    return Playback(tuple(starts), tuple(ends), tuple(sorted(snaps, key=lambda snap: snap.seconds)))


def _course(motion: Motion, segment: int) -> Iterator[tuple[float, tuple[Counts, ...]]]:
    """When the two nodes of a segment (from 0) were elsewhere than before, and where: in a row most mostly rest."""
    before: tuple[Counts, ...] = ()
    for seconds, counts in motion:
        pair = counts[segment : segment + 2]
        if pair != before:
            yield seconds, pair
        before = pair


def known_state(rod: ClampedRod, name: str) -> State | None:
    """The state of `rod` that is called `name`; None if there is none."""
    if name in ("", STRAIGHT, LOST):
        return None
    states = find_states(rod, DEFAULT_TOLERANCE)
    return next((coarse_start(state) for state in states if state.name == name), None)


def name_of(rod: ClampedRod, held: State | None) -> str:
    """The name of the state in which `rod` is held; "lost" if no stable state of it is that one."""
    if held is None:
        return LOST if is_slack(rod) else STRAIGHT
    nearest, name = SAME_ANGLES, LOST
    for state in find_states(rod, DEFAULT_TOLERANCE):
        distance = float(np.max(np.abs(coarse_start(state, held[0].size)[0] - held[0])))
        if distance < nearest:
            nearest, name = distance, state.name
    return name


def segment_at(display: Display, drive: DriveTable, counts: Sequence[Counts]) -> tuple[tuple[Node, Node], float]:
    """The two nodes of a segment and the rod between them, from their encoder counts."""
    feed, bias, lift = drive.axes
    left, right = (Node(mm(lift.value(node[2])), deg(bias.value(node[1]))) for node in counts)
    return (left, right), display.span + mm(feed.value(counts[0][0]) - feed.value(counts[1][0]))


def _snaps(name: str, rods: Sequence[ClampedRod], events: Sequence[Event]) -> Iterator[tuple[int, tuple[str, str]]]:
    """Where in the motion the rod left a state, from what and to what; at first it is called `name`."""
    for kind, place, state in events:
        before = name
        if kind in (BUCKLED, FELL):
            name = name_of(rods[place], state)
        if kind == FELL:
            yield place, (before, name)
