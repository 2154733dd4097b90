"""Where the runs on record left the rod of a display, and for how long it was held there.

A run that came to its end left it in the states of its plan; one that was broken off, in those that its plan proves
after the last step that all nodes had done. The next run of the same display ends that; now, if there is none. What
another host does, or a hand on the rod, is not on record.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from curveline.drive_settings import DriveSettings, drive_settings
from curveline.driving.interrupted import plan_of, steps_on_record
from curveline.driving.known_states import states_after
from curveline.driving.live import LAST_NAME, LIVE_NAME, read_live, same_radio
from curveline.driving.runs import moment
from curveline.errors import InvalidInput
from curveline.plan_file import NodeTarget, Plan
from curveline.radio.host.journal import FILE_NAME, is_open, read_journal
from curveline.radio.host.run_folder import number_of, run_names
from curveline.radio.mock.spec import parse_spec
from curveline.scene import STRAIGHT, Display, Node, Scene, Segment
from curveline.units import deg, mm

LOOKED_AT = 400
"""How many runs, the newest first, are looked at."""


@dataclass(frozen=True)
class RodRecord:
    """Where the runs of a rod are on record: the radio that its display is behind, the folder, and from when on [s]."""

    spec: str
    runs: Path
    since: float = 0.0


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
    """Where the runs left a rod, the first one first; the number of the run in which its mock display was new."""

    stays: tuple[Stay, ...]
    new_in: int = NO_RUN


def stays_of(display: Display, record: RodRecord, now: float, before: str = "") -> Stays:
    """Where the runs left the rod of a display, the last one until `now` [s since 1970].

    Only runs `before` the one of that name count, if one is named.
    """
    found: list[Stay] = []
    new_in = NO_RUN
    drive, end = drive_settings(display), now
    names = run_names(record.runs)
    if before in names:
        names = names[names.index(before) + 1 :]
    for name in names[:LOOKED_AT]:
        left = _left_by(record.runs / name, drive, record.spec)
        if left is None:
            continue
        if left.place is not None:
            found.append(_stay(display, left, (name, end)))
            end = left.began
        if left.is_fresh:
            new_in = number_of(name)
            break
    return Stays(tuple(found[::-1]), new_in)


@dataclass(frozen=True)
class _Left:
    """Where a run left the nodes, None if it moved none, and the states of the rod; when it began and ended [s]."""

    plan: Plan
    place: Sequence[NodeTarget] | None
    states: tuple[str, ...]
    lengths: tuple[float, ...]  # [mm]
    began: float
    ended: float
    is_fresh: bool


def _left_by(folder: Path, drive: DriveSettings, spec: str) -> _Left | None:
    """Where a run left a rod; None if it is of another display or radio, being sent, damaged, or of an old release."""
    sent = read_live(folder / LAST_NAME) or read_live(folder / LIVE_NAME)
    if sent is None or sent.display != drive.display or not same_radio(sent.radio, spec) or is_open(folder):
        return None
    try:
        plan, records = plan_of(folder), read_journal(folder / FILE_NAME)
    except InvalidInput:
        return None
    times = list(_times(records))
    if not times or not _is_alike(plan.drive, drive):
        return None
    step, _ = steps_on_record(folder, plan)
    return _Left(
        plan=plan,
        place=plan.steps[step - 1].targets if step else None,
        states=states_after(plan, step) if step else (),
        lengths=plan.steps[step - 1].lengths_mm if step else (),
        began=times[0],
        ended=times[-1],
        is_fresh=is_fresh(sent.radio),
    )


def _times(records: Sequence[Mapping[str, Any]]) -> Iterator[float]:
    for record in records:
        at = moment(record)
        if at is not None:
            yield at


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


def _stay(display: Display, left: _Left, which: tuple[str, float]) -> Stay:
    name, end = which
    is_known = len(left.states) == display.node_count - 1 and all(left.states)
    is_straight = all(state == STRAIGHT for state in left.states)
    is_known = is_known and (is_straight or STRAIGHT not in left.states)
    scene = None if is_straight or not is_known else _scene(display, left)
    return Stay(name, number_of(name), left.plan.name, scene, left.ended, end, is_known)


def _scene(display: Display, left: _Left) -> Scene:
    """What a display shows whose nodes stand where a run left them."""
    assert left.place is not None
    nodes = tuple(Node(mm(each.translate_mm), deg(each.bias_deg)) for each in left.place)
    lengths = zip(left.lengths, left.states, strict=True)
    return Scene(left.plan.name, display, nodes, tuple(Segment(mm(length), state) for length, state in lengths))
