"""A sweep as a whole: a row of plain values for every state at every point, and what the points came to."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from contextlib import closing
from dataclasses import dataclass
from typing import Any

from curveline.errors import CurvelineError
from curveline.listening import SILENT, Listener
from curveline.notebook import html_of
from curveline.simulation.batch import Order, jobs_for, run
from curveline.simulation.results import Settings
from curveline.simulation.sweep import Sweep, SweepTally, digests
from curveline.simulation.sweep_files import CLAMPS, SCALARS, SPACE, rows_of


@dataclass(frozen=True)
class SweepReport:
    """What a sweep found: `rows` by column, a tally of its points, and by number the points that failed, with why."""

    sweep: Sweep
    rows: Sequence[Mapping[str, Any]]
    tally: SweepTally
    failed: Mapping[int, CurvelineError]

    def _repr_html_(self) -> str:
        groups = [
            (number, states, group.points, group.lowest, group.highest)
            for number, segment in enumerate(self.tally.groups, start=1)
            for states, group in segment.items()
        ]
        head = ("segment", "stable states", "points", "lowest eigenvalue from", "to")
        title = f"{len(self.sweep)} points, {self.tally.good} as asked for: {'; '.join(map(str, self.sweep.axes))}"
        return html_of(title, [head, *groups])


def columns_of(sweep: Sweep) -> tuple[str, ...]:
    """The names of the values of a row."""
    return ("point", *(axis.key for axis in sweep.axes), "segment", "state", *SCALARS, *SPACE, *CLAMPS)


def run_sweep(sweep: Sweep, settings: Settings, jobs: int | None = None, listener: Listener = SILENT) -> SweepReport:
    """Simulate every point of a sweep on `jobs` processes, as many as are fastest for None.

    InvalidInput, before anything is computed, if a point breaks a rule for shape files.
    """
    with listener.progress("checking", len(sweep)) as heard:
        sweep.check(heard)
    listener.computing()
    tally, names = SweepTally.of(len(sweep.file.scene.segments)), columns_of(sweep)
    rows: list[Mapping[str, Any]] = []
    failed: dict[int, CurvelineError] = {}
    answers = run(sweep.tasks(), Order(settings, (digests, rows_of)), jobs_for(jobs, len(sweep)), len(sweep))
    with closing(answers), listener.progress("simulating", len(sweep)) as heard:
        for task, answer in answers:
            if isinstance(answer, CurvelineError):
                tally.failed += 1
                failed[task.number] = answer
            else:
                digest, found = answer.products
                tally.add(digest)
                rows.extend(dict(zip(names, row, strict=True)) for row in found)
            heard(task.number)
    return SweepReport(sweep, rows, tally, failed)
