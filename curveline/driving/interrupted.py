"""A run that was broken off, as its folder tells it, and how it goes on."""

from __future__ import annotations

import shlex
from collections.abc import Iterator, Sequence
from contextlib import closing, contextmanager, suppress
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

from curveline.driving.live import forget
from curveline.errors import InvalidInput
from curveline.plan_file import Plan, read_plan
from curveline.radio.host.actions import Record
from curveline.radio.host.journal import FILE_NAME, ReopenedJournal, find_run, read_journal, runs_folder
from curveline.radio.host.line_records import is_of_lines, records_of
from curveline.radio.host.resume import SEND_AGAIN, ResumePoint, resume_point
from curveline.radio.protocol.codes import Counts
from curveline.system.files import printable

PLAN_NAME = "plan.json"
TOLD = ("pause", "halt")
"""Records with which a process ends that has told what the rod did."""
SAMPLES = 50
"""Places between two barriers."""


@dataclass(frozen=True)
class InterruptedRun:
    """What was sent, how far it has come by its record, and where that record is."""

    plan: Plan
    point: ResumePoint
    folder: Path
    unseen: tuple[int, ...] = ()
    """Steps (0 for the start) through which the nodes came in a process that was killed, in order."""

    @contextmanager
    def opened(self) -> Iterator[ReopenedJournal]:
        """The record, locked and ready to be gone on with."""
        with closing(ReopenedJournal(self.folder)) as journal:
            forget(self.folder)
            yield journal

    def way_here(self, now: tuple[Counts, ...]) -> list[tuple[Counts, ...]]:
        """Where the nodes were on the way to where they are `now`, so closely that a rod can be followed along it."""
        places = [self._place(step) for step in self.unseen] + [now] * bool(self.unseen)
        return [
            tuple(_between(begin, end, part / SAMPLES) for begin, end in zip(*pair, strict=True))
            for pair in pairwise(places)
            for part in range(SAMPLES)
        ]

    def _place(self, step: int) -> tuple[Counts, ...]:
        targets = self.plan.steps[step - 1].targets if step else self.plan.start
        return tuple(target.counts for target in targets)

    def summary(self) -> str:
        """One line on what is left to do."""
        point, count = self.point, len(self.plan.steps)
        if point.released > point.barrier:
            left = f"goes on in the midst of step {point.released} of {count}"
        elif point.barrier < count:
            left = f"goes on with step {point.barrier + 1} of {count}"
        else:
            left = f"all {count} steps are done; only its record is to be ended"
        return f"{self.plan.name}: {left}"


def find_interrupted_run(name: str, runs: Path) -> InterruptedRun:
    """The run that `name` means; InvalidInput if there is none, or if its record says that it cannot go on."""
    folder = find_run(runs, name)
    records = read_journal(folder / FILE_NAME)
    if is_of_lines(records):
        hint = f"all of them go on together: `{resuming(folder)}`, or curveline.resume_lines"
        raise InvalidInput(f"run {printable(folder.name)} is one of several lines", hint)
    try:
        plan = plan_of(folder)
        point = resume_point(plan, records)
    except InvalidInput as error:
        raise InvalidInput(f"run {printable(folder.name)}: {error.message}", error.hint) from None
    return InterruptedRun(plan, point, folder, unseen_steps(point, records))


def steps_on_record(run: Path, plan: Plan) -> tuple[int, int]:
    """The last steps that all nodes have done, and that they were released to do; (0, 0) if the record is damaged.

    `run` is the folder of a run, or of a line of one.
    """
    with suppress(InvalidInput):
        records, most = records_of(run), len(plan.steps)
        return _last_step(records, "barrier", most), _last_step(records, "release", most)
    return 0, 0


def _last_step(records: Sequence[Record], kind: str, most: int) -> int:
    steps = [record.get("step") for record in records if record.get("type") == kind]
    return max((step for step in steps if type(step) is int and 0 < step <= most), default=0)


def resuming(run: Path) -> str:
    """The command that goes on with a run, whose folder needs no path if it is where runs are looked for."""
    name = run.name if run.parent == runs_folder() else str(run)
    return f"curveline send --resume {shlex.quote(name)}"


def plan_of(folder: Path) -> Plan:
    """What was sent in a run; InvalidInput if it is not sealed, as in runs of older releases, or damaged."""
    try:
        return read_plan(folder / PLAN_NAME)
    except InvalidInput as error:
        raise InvalidInput(error.message, SEND_AGAIN) from None


def unseen_steps(point: ResumePoint, records: Sequence[Record]) -> tuple[int, ...]:
    """The steps done since a process ended last that told what the rod did; all others were killed, however many."""
    kinds = [record.get("type") for record in records]
    if kinds[-1] in TOLD:
        return ()
    gone_on = (index for index, pair in enumerate(pairwise(kinds)) if pair[0] in TOLD and pair[1] == "resume")
    begin = kinds[: max(gone_on, default=0)].count("barrier")
    return tuple(range(begin, point.barrier + 1))


def _between(begin: Counts, end: Counts, part: float) -> Counts:
    x, y, z = (round(low + part * (high - low)) for low, high in zip(begin, end, strict=True))
    return x, y, z
