"""Which curve the rod of a display took: the nodes' actual motion, played through the rod's physics.

Nothing here knows the plan. The rod starts in the state it was last seen in, or buckles from straight as its weight
makes it; it follows its state while that stays stable, and falls downhill when it does not.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from curveline.drive_settings import DriveSettings, drive_settings
from curveline.rod.branches.quasi_static import FELL, LEFT, PULLED, RETURNED, Event, State, move_through
from curveline.rod.branches.tracking import identify, tracked
from curveline.rod.clamped_rod import ClampedRod
from curveline.rod.models.showable import showable_states
from curveline.rod.spatial.energy import Shape
from curveline.rod.states.slack import is_slack
from curveline.scene import BUCKLED, LOST, STRAIGHT, UNNAMED, Display, Node
from curveline.simulation.simulate import DEFAULT_TOLERANCE, clamped_rod
from curveline.units import deg, mm

Counts = tuple[int, int, int]
Motion = Sequence[tuple[float, tuple[Counts, ...]]]

SNAPS = (FELL, LEFT, RETURNED)
"""What happens to a rod when it snaps."""


@dataclass(frozen=True)
class Snap:
    """The rod of a segment left its state: when [s], which segment (from 1), from what, to what."""

    seconds: float  # [s] since the start
    segment: int  # from 1
    before: str  # name of the state
    after: str  # name of the state


@dataclass(frozen=True)
class Playback:
    """What the rod did: the states of all segments at the start and at the end, and every snap-through between."""

    start: tuple[str, ...]  # left to right
    states: tuple[str, ...]  # left to right
    snaps: tuple[Snap, ...]  # in order of time


def replay(display: Display, motion: Motion, before: Sequence[str] = ()) -> Playback:
    """Play `motion`, (seconds, counts of every node) in order of time, through the rod.

    `before` names the state of each segment at the start, where it is known.
    """
    drive = drive_settings(display)
    starts, ends, snaps = [], [], []
    for segment in range(display.node_count - 1):
        course = list(_course(motion, segment))
        rods = [clamped_rod(display, *segment_at(display, drive, pair, segment)) for _, pair in course]
        start = known_state(rods[0], before[segment] if segment < len(before) else "")
        state, events = move_through(np.array([each.pose for each in rods]), rods[0], start)
        first = events[0].state if start is None and events and events[0].place == 0 else start
        starts.append(name_of(rods[0], first))
        ends.append(name_of(rods[-1], state))
        for place, names in _snaps(starts[-1], rods, events):
            snaps.append(Snap(course[place][0], segment + 1, *names))
    return Playback(tuple(starts), tuple(ends), tuple(sorted(snaps, key=lambda snap: snap.seconds)))


def touched(display: Display, playback: Playback, at: tuple[float, tuple[Counts, ...]], number: int) -> Playback:
    """The same, but that a hand snapped the rod of segment `number`, from 1, into its other state in the end.

    `at` is when [s] the nodes came to rest, and where. Of a rod that has no other state there nothing changes.
    """
    seconds, counts = at
    drive, place = drive_settings(display), number - 1
    rod = clamped_rod(display, *segment_at(display, drive, counts[place : place + 2], place))
    before = playback.states[place]
    others = [state.name for state in showable_states(rod, DEFAULT_TOLERANCE).states if state.name != before]
    if not is_slack(rod) or not others:
        return playback
    states = (*playback.states[:place], others[-1], *playback.states[number:])
    return replace(playback, states=states, snaps=(*playback.snaps, Snap(seconds, number, before, others[-1])))


def _course(motion: Motion, segment: int) -> Iterator[tuple[float, tuple[Counts, ...]]]:
    """When the two nodes of a segment (from 0) were elsewhere than before, and where: in a row most mostly rest."""
    before: tuple[Counts, ...] = ()
    for seconds, counts in motion:
        pair = counts[segment : segment + 2]
        if pair != before:
            yield seconds, pair
        before = pair


def known_state(segment: ClampedRod, name: str) -> State | None:
    """The state of the rod of a flat segment that is called `name`; None if the display can show none."""
    if name in ("", STRAIGHT, *UNNAMED):
        return None
    state = showable_states(segment, DEFAULT_TOLERANCE).called(name)
    return None if state is None else tracked(state)


def name_of(segment: ClampedRod, held: State | None) -> str:
    """The name of the state in which the rod of a flat segment is held; "lost" if no stable state of it is that one."""
    if held is None:
        return LOST if is_slack(segment) else STRAIGHT
    if isinstance(held, Shape):
        return BUCKLED
    shown = showable_states(segment, DEFAULT_TOLERANCE)
    state = identify(segment, held, shown.states)
    return LOST if state is None else state.name


def segment_at(
    display: Display, drive: DriveSettings, counts: Sequence[Counts], segment: int
) -> tuple[tuple[Node, Node], float, float]:
    """The two nodes of a segment, from 0, the length of rod between them and where it begins, from their counts."""
    feed, bias, lift = drive.axes
    left, right = (Node(mm(lift.value(node[2])), deg(bias.value(node[1]))) for node in counts)
    length = display.span + mm(feed.value(counts[0][0]) - feed.value(counts[1][0]))
    return (left, right), length, display.material_at(segment, mm(feed.value(counts[0][0])))


def _snaps(name: str, rods: Sequence[ClampedRod], events: Sequence[Event]) -> Iterator[tuple[int, tuple[str, str]]]:
    """Where in the motion the rod left a state, from what and to what; at first it is called `name`."""
    for kind, place, state in events:
        before = name
        if kind != PULLED:
            name = name_of(rods[place], state)
        if kind in SNAPS and name != before:
            yield place, (before, name)
