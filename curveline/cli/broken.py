"""A run that was broken off, as its folder tells it."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import closing, contextmanager
from dataclasses import dataclass
from pathlib import Path

from curveline.plan import Plan, read_plan
from curveline.radio.journal import FILE_NAME, ReopenedJournal, find_run, read_journal
from curveline.radio.resume import ResumePoint, resume_point

PLAN_NAME = "plan.json"


@dataclass(frozen=True)
class BrokenRun:
    """What was sent, how far it has come by its record, and where that record is."""

    plan: Plan
    point: ResumePoint
    folder: Path

    @contextmanager
    def opened(self) -> Iterator[ReopenedJournal]:
        """The record, locked and ready to be gone on with."""
        with closing(ReopenedJournal(self.folder)) as journal:
            yield journal

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


def find_broken_run(name: str, runs: Path) -> BrokenRun:
    """The run that `name` means; InvalidInput if there is none, or if its record says that it cannot go on."""
    folder = find_run(runs, name)
    plan = read_plan(folder / PLAN_NAME)
    return BrokenRun(plan, resume_point(plan, read_journal(folder / FILE_NAME)), folder)
