"""The course of a plan, to be looked at: what the display shows after every step, and moment by moment.

After a step a segment's rod is in one of the states that the plan names, and all of them are there. Moment by moment it
rides through the nodes' trapezoids as in `playback`: it buckles, follows its state, and snaps.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from curveline.plan_file import NodeTarget, Plan
from curveline.radio.protocol.motion import axes_of, plan_move
from curveline.replay.playback import SNAPS, Counts, Snap, known_state, name_of, segment_at
from curveline.rod.branches.out_of_plane import seen
from curveline.rod.branches.quasi_static import State, move_through
from curveline.rod.branches.tracking import refined
from curveline.rod.clamped_rod import ClampedRod
from curveline.rod.models.showable import showable_states
from curveline.rod.problem import Array
from curveline.rod.spatial.energy import Shape
from curveline.rod.states.slack import is_slack
from curveline.scene import STRAIGHT, Display, Node
from curveline.simulation.simulate import DEFAULT_TOLERANCE, clamped_rod
from curveline.units import ms, to_ms

POINTS = 81
"""Points of a curve, equally spaced in arc length."""

SHOWN = 1e-3
"""Largest error [m] of a curve of a moment."""

BAR = "|"
"""What joins the alternatives among a step's states."""


@dataclass(frozen=True)
class Still:
    """A display at rest: its nodes, and for each segment the curves it may show, by the names of the states.

    Curves are (points, 2) [m] in the display's frame, from pivot to pivot.
    """

    nodes: tuple[Node, ...]
    curves: tuple[Mapping[str, Array], ...]


@dataclass(frozen=True)
class Moment:
    """A display on its way: when [s], in which step (0 before the first), its nodes, each segment's curve and state.

    Curves are (points, 2) [m] in the display's frame, from pivot to pivot; one whose rod is lost has no points.
    """

    seconds: float
    step: int
    nodes: tuple[Node, ...]
    curves: tuple[Array, ...]
    states: tuple[str, ...]


@dataclass(frozen=True)
class Course:
    """What a display does while it carries out a plan, and every snap-through on the way, in order of time."""

    moments: tuple[Moment, ...]
    snaps: tuple[Snap, ...]


def stills(plan: Plan, display: Display) -> list[Still]:
    """The display at the start of `plan`, in any state in which that may begin, and after every step."""
    stops = [(plan.start, plan.granted), *((step.targets, step.states) for step in plan.steps)]
    pictures = []
    for targets, names in stops:
        segments = _segments(plan, display, _counts(targets))
        curves = tuple(_possible(each, name) for each, name in zip(segments, names, strict=True))
        pictures.append(Still(_nodes(segments), curves))
    return pictures


def play(plan: Plan, display: Display, interval: float, heard: Callable[[int], None] = lambda _: None) -> Course:
    """The course of `plan`, a moment every `interval` [s] or a little less, so that steps end at moments.

    `heard` is told how many moments are done. Raises InvalidInput for a drive whose nodes cannot carry out any plan.
    """
    begin = _segments(plan, display, _counts(plan.start))
    riders = [
        _PlayedRod(number, known_state(each.rod, name))
        for number, (each, name) in enumerate(zip(begin, plan.granted, strict=True), start=1)
    ]
    moments: list[Moment] = []
    for instant in _instants(plan, interval):
        segments = _segments(plan, display, instant.counts)
        for rider, each in zip(riders, segments, strict=True):
            rider.go(instant, each.rod)
        moments.append(
            Moment(
                seconds=instant.seconds,
                step=instant.step,
                nodes=_nodes(segments),
                curves=tuple(each.origin + rider.curve() for each, rider in zip(segments, riders, strict=True)),
                states=tuple(rider.name for rider in riders),
            )
        )
        heard(len(moments))
    snaps = sorted((snap for rider in riders for snap in rider.snaps), key=lambda snap: snap.seconds)
    return Course(tuple(moments), tuple(snaps))


class _PlayedRod:
    """The rod of the segment of a number (from 1) on its way from the state `start`; None lets it sag where it can.

    `name` is that of its state, as last found out.
    """

    def __init__(self, number: int, start: State | None) -> None:
        self.name = ""
        self.snaps: list[Snap] = []
        self._number = number
        self._segments: list[ClampedRod] = []
        self._state = start

    def go(self, instant: _Instant, segment: ClampedRod) -> None:
        """Come to where the nodes are at an instant."""
        self._segments = [*self._segments[-1:], segment]
        self._state, events = move_through(np.array([each.pose for each in self._segments]), segment, self._state)
        before = self.name
        if events or instant.ends_step:
            self.name = name_of(segment, self._state)
        if any(event.kind in SNAPS for event in events) and before != self.name:
            self.snaps.append(Snap(instant.seconds, self._number, before, self.name))

    def curve(self) -> Array:
        """The rod seen from its left pivot (points, 2) [m]; no points while it is lost."""
        rod = self._segments[-1]
        if isinstance(self._state, Shape):
            return seen(rod, self._state, POINTS)
        if self._state is not None:
            return refined(rod, self._state, SHOWN).curve(POINTS)
        return np.empty((0, 2)) if is_slack(rod) else _chord(rod)


def moment_count(plan: Plan, interval: float) -> int:
    """How many moments `play` gives."""
    return sum(1 for _ in _instants(plan, interval))


class _Instant(NamedTuple):
    """Where the motors are at a time [s]: the step (0 before the first) and the counts of every node."""

    seconds: float
    step: int
    counts: tuple[Counts, ...]
    ends_step: bool


def _instants(plan: Plan, interval: float) -> Iterator[_Instant]:
    """The motors' way through a plan, on the nodes' own trapezoids; a step in which nothing moves takes no time."""
    axes = axes_of(plan.drive)
    clock_ms, before = 0, _counts(plan.start)
    yield _Instant(0.0, 0, before, ends_step=True)
    for step in plan.steps:
        after = _counts(step.targets)
        if after == before:
            continue
        least = round(to_ms(step.seconds))
        ways = [plan_move(old, new, axes, least) for old, new in zip(before, after, strict=True)]
        whole = max(way.duration_ms for way in ways)
        parts = math.ceil(whole / to_ms(interval))
        for part in range(1, parts + 1):
            now = round(whole * part / parts)
            counts = tuple(way.at(now) for way in ways)
            yield _Instant(ms(clock_ms + now), step.number, counts, ends_step=part == parts)
        clock_ms, before = clock_ms + whole, after


class _SegmentAt(NamedTuple):
    """One segment of a display at some counts: its nodes, the rod between them, where its left pivot is [m]."""

    nodes: tuple[Node, Node]
    rod: ClampedRod
    origin: Array


def _segments(plan: Plan, display: Display, counts: tuple[Counts, ...]) -> list[_SegmentAt]:
    """All segments, with the nodes where the plan's drive has them at `counts`."""
    stretches = []
    for index in range(len(counts) - 1):
        nodes, length, begin = segment_at(display, plan.drive, counts[index : index + 2], index)
        origin = np.array([index * display.span, nodes[0].height])
        stretches.append(_SegmentAt(nodes, clamped_rod(display, nodes, length, begin), origin))
    return stretches


def _nodes(segments: Sequence[_SegmentAt]) -> tuple[Node, ...]:
    return (segments[0].nodes[0], *(each.nodes[1] for each in segments))


def _possible(stretch: _SegmentAt, names: str) -> Mapping[str, Array]:
    """The curves of the states called `names` (alternatives joined by `|`; empty for all) that a segment may show."""
    rod = stretch.rod
    if not is_slack(rod):
        return {STRAIGHT: stretch.origin + _chord(rod)}
    return {
        state.name: stretch.origin + state.curve(POINTS)
        for state in showable_states(rod, DEFAULT_TOLERANCE).states
        if not names or state.name in names.split(BAR)
    }


def _chord(rod: ClampedRod) -> Array:
    """A rod that is drawn straight, seen from its left pivot (points, 2) [m]."""
    return np.linspace((0.0, 0.0), rod.chord, POINTS)


def _counts(targets: Sequence[NodeTarget]) -> tuple[Counts, ...]:
    return tuple(target.counts for target in targets)
