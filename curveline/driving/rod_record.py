"""Where the runs on record left the rod of a display, and for how long it was held there.

A run that came to its end left it in the states of its plan; one that was broken off, in those that its plan proves
after the last step that all nodes had done, as does one that is being sent, or was not gone on with for a while. The
next run of the same display ends that; now, if there is none. What another host does, or a hand on the rod, is not on
record.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from pathlib import Path
from typing import Any, NamedTuple

from curveline.drive_settings import DriveSettings, drive_settings
from curveline.driving.interrupted import plan_of
from curveline.driving.known_states import states_after
from curveline.driving.live import LAST_NAME, LIVE_NAME, read_live, same_radio
from curveline.driving.runs import moment
from curveline.errors import InvalidInput
from curveline.plan_file import Plan, Step
from curveline.radio.host.line_records import parts_of, records_of
from curveline.radio.host.run_folder import number_of, run_names
from curveline.radio.mock.spec import parse_spec
from curveline.scene import STRAIGHT, Display, Node, Scene, Segment
from curveline.units import MINUTE, deg, mm

LOOKED_AT = 400
"""How many runs, the newest first, are looked at."""
GONE_ON = "resume"
"""The kind of record with which a run is gone on with."""
LONG = 10 * MINUTE
"""Between two records of a run [s]: in that the rod is at rest, since no step takes as long."""


@dataclass(frozen=True)
class RodRecord:
    """Where the runs of a rod are on record: the radio that its display is behind, the folder, and from when on [s].

    What is worked out of them `is_kept` beside them, unless nothing is to be written.
    """

    spec: str
    runs: Path
    since: float = 0.0
    is_kept: bool = True


@dataclass(frozen=True)
class Stay:
    """A shape in which a run left a rod, None for a straight one; from when to when [s since 1970].

    `is_known` is False where the run left several states possible: the rod is then taken for straight.
    """

    run: str  # by name
    number: int  # of the run, 0 if it has none
    shape: str  # by name
    scene: Scene | None  # None for a straight rod
    begin: float  # [s]
    end: float  # [s]
    is_known: bool = True

    @property
    def seconds(self) -> float:
        """How long it lasted, 0 if the clock was set back meanwhile."""
        return max(0.0, self.end - self.begin)


NO_RUN = -1
"""Below the number of any run."""


@dataclass(frozen=True)
class Stays:
    """Where the runs left a rod, the first one first; the name of the run in which its mock display was new, if any."""

    stays: tuple[Stay, ...]
    new_in: str | None = None


def stays_of(display: Display, record: RodRecord, now: float, before: str = "") -> Stays:
    """Where the runs left the rod of a display, the last one until `now` [s since 1970].

    Only runs until the one of that name count, if one is named, and what it rested in before it went on the last time.
    """
    found: list[Stay] = []
    new_in = None
    drive, later = drive_settings(display), [now]
    names = run_names(record.runs)
    if before in names:
        names = names[names.index(before) :]
    for name in names[:LOOKED_AT]:
        parts = (_left_by(part, drive, record.spec) for part in parts_of(record.runs / name))
        left = next((part for part in parts if part is not None), None)
        if left is None:
            continue
        # By a clock that was ahead or behind for a run, nothing that came before lasted longer.
        rests = [rest._replace(end=min(rest.end, _first(later, rest.begin, now))) for rest in left.rests]
        found += [_stay(display, left.plan, name, rest) for rest in rests[: -1 if name == before else None][::-1]]
        if rests:
            later.append(left.began)
        if left.is_fresh:
            new_in = name
            break
    return Stays(tuple(_in_order(found[::-1])), new_in)


def _first(times: Sequence[float], begin: float, now: float) -> float:
    """The first of some times that is not before a begin; now if there is none."""
    return min((time for time in times if begin <= time <= now), default=now)


def _in_order(stays: Sequence[Stay]) -> Iterator[Stay]:
    """Stays in the order of their runs, none of which begins before another had ended: a clock may have been behind."""
    begins: list[float] = []
    for stay in stays:
        latest = max((begin for begin in begins if begin <= stay.end), default=stay.begin)
        begins.append(stay.begin)
        yield replace(stay, begin=max(stay.begin, latest))


class _Rest(NamedTuple):
    """When [s since 1970] nodes rested after a step that all had done, which is from 1."""

    step: int
    begin: float
    end: float


@dataclass(frozen=True)
class _Left:
    """Where nodes rested in a run, at last until the next one; nowhere if it moved none. When it began [s]."""

    plan: Plan
    rests: tuple[_Rest, ...]
    began: float
    is_fresh: bool


def _left_by(folder: Path, drive: DriveSettings, spec: str) -> _Left | None:
    """Where a run, or one line of it, left a rod, or has come to.

    None if it is of another display or radio, damaged, or too old.
    """
    sent = read_live(folder / LAST_NAME) or read_live(folder / LIVE_NAME)
    if sent is None or sent.display != drive.display or not same_radio(sent.radio, spec):
        return None
    try:
        plan, records = plan_of(folder), records_of(folder)
    except InvalidInput:
        return None
    if not _is_alike(plan.drive, drive):
        return None
    noted = [(record, at) for record in records if (at := moment(record)) is not None]
    rests = tuple(rest for rest in _rests(noted) if 0 < rest.step <= len(plan.steps))
    return _Left(plan, rests, noted[0][1], is_fresh(sent.radio)) if noted else None


def _rests(noted: Sequence[tuple[Mapping[str, Any], float]]) -> Iterator[_Rest]:
    """Where nodes rested for long, or until the run was gone on with, by its records and their times; then for good."""
    step = 0
    for (record, begin), (then, end) in pairwise((*noted, ({}, math.inf))):
        done = record.get("step")
        if record.get("type") == "barrier" and type(done) is int:
            step = max(step, done)
        if then.get("type") == GONE_ON or end - begin >= LONG:
            yield _Rest(step, begin, end)


def is_fresh(spec: str) -> bool:
    """True for a mock display that is new when it is opened."""
    name, _, settings = spec.partition(":")
    try:
        return name == "mock" and parse_spec(settings).fresh
    except InvalidInput:
        return False


def _is_alike(one: DriveSettings, other: DriveSettings) -> bool:
    """True if counts of the nodes of one display mean the same on the other: its file may have been changed since."""
    return one.node_count == other.node_count and [axis.counts_per_unit for axis in one.axes] == [
        axis.counts_per_unit for axis in other.axes
    ]


def _stay(display: Display, plan: Plan, name: str, rest: _Rest) -> Stay:
    """What the rod of a display was held in while nodes rested in a run of that name."""
    states = states_after(plan, rest.step)
    is_known = len(states) == display.node_count - 1 and all(states)
    step = plan.steps[rest.step - 1]
    # On the way to a shape a rod that is straight between two nodes may be pulled between others of any kind.
    is_shape = bool(step.shape) or rest.step == len(plan.steps)
    is_straight = all(state == STRAIGHT for state in states) and (not is_shape or _is_level(step))
    is_known = is_known and (is_straight or is_shape or STRAIGHT not in states)
    scene = None if is_straight or not is_known else _scene(display, plan.name, step, states)
    return Stay(name, number_of(name), plan.name, scene, rest.begin, rest.end, is_known)


def _is_level(step: Step) -> bool:
    """True if all nodes are level and upright after a step."""
    return all(each.translate_mm == each.bias_deg == 0.0 for each in step.targets)


def _scene(display: Display, name: str, step: Step, states: Sequence[str]) -> Scene:
    """What a display shows whose nodes stand where a step left them."""
    nodes = tuple(Node(mm(each.translate_mm), deg(each.bias_deg)) for each in step.targets)
    lengths = zip(step.lengths_mm, states, strict=True)
    return Scene(name, display, nodes, tuple(Segment(mm(length), state) for length, state in lengths))
