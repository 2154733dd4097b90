"""A sweep as a whole: a row of plain values for every state at every point, the curves, what the points came to."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from contextlib import closing
from dataclasses import dataclass
from typing import Any, NamedTuple

from curveline.errors import CurvelineError, InvalidInput
from curveline.listening import SILENT, Listener
from curveline.notebook import html_of, svg_of
from curveline.simulation.batch import Order, Task, jobs_for, report_of, run
from curveline.simulation.results import Settings, ShapeReport
from curveline.simulation.sweep import Sweep, SweepTally, digests
from curveline.simulation.sweep_files import COLUMNS, rows_of
from curveline.simulation.sweep_view import StateMap, ValueCurves, gathering, view_of


class SweptPoint(NamedTuple):
    """A point of a sweep that could be simulated."""

    number: int  # from 1
    swept: tuple[tuple[str, float], ...]  # key and value, in the unit of the key
    report: ShapeReport  # of the shape with these values

    @property
    def task(self) -> Task:
        """What was simulated, as makers take it."""
        return Task(self.report.scene.path, self.report.scene, self.number, self.swept)


@dataclass(frozen=True)
class SweepReport:
    """What a sweep found: a row of plain values for every state at every point, and what the points came to.

    A row has `point`, the swept keys, `segment`, `state` and the numbers of the state, with the unit in the name, such
    as `energy_mJ`; docs/contracts.md lists them. `points` have the curves: the report of every point that could be
    simulated. `failed` are the others, by number from 1.
    """

    sweep: Sweep  # the grid
    settings: Settings  # as asked for
    rows: Sequence[Mapping[str, Any]]  # a mapping from column to value per state
    points: Sequence[SweptPoint]  # in order
    tally: SweepTally  # counts of points
    failed: Mapping[int, CurvelineError]

    def _repr_svg_(self) -> str | None:
        try:
            view = view_of(self.sweep)
        except InvalidInput:
            return None
        return svg_of("curveline.figures.sweeps:draw", self._gathered(gathering(view)))

    def _repr_html_(self) -> str:
        groups = [
            (number, states, group.points, group.lowest, group.highest)
            for number, segment in enumerate(self.tally.groups, start=1)
            for states, group in segment.items()
        ]
        head = ("segment", "stable states", "points", "lowest eigenvalue from", "to")
        title = f"{len(self.sweep)} points, {self.tally.good} as asked for: {'; '.join(map(str, self.sweep.axes))}"
        return html_of(title, [head, *groups], self._repr_svg_())

    def _gathered(self, shown: ValueCurves | StateMap) -> ValueCurves | StateMap:
        """What a figure shows, with all points."""
        for point in self.points:
            shown.take(shown.make(point.task, point.report))
        return shown


def columns_of(sweep: Sweep) -> tuple[str, ...]:
    """The names of the values of a row."""
    return ("point", *(axis.key for axis in sweep.axes), *COLUMNS)


def run_sweep(sweep: Sweep, settings: Settings, jobs: int | None = None, listener: Listener = SILENT) -> SweepReport:
    """Simulate every point of a sweep on `jobs` processes, as many as are fastest for None.

    InvalidInput, before anything is computed, if a point breaks a rule for shape files.
    """
    with listener.progress("checking", len(sweep)) as heard:
        sweep.check(heard)
    listener.computing()
    names, order = columns_of(sweep), Order(settings, (digests, rows_of, report_of))
    rows: list[Mapping[str, Any]] = []
    points: list[SweptPoint] = []
    tally = SweepTally.of(len(sweep.file.scene.segments))
    failed: dict[int, CurvelineError] = {}
    answers = run(sweep.tasks(), order, jobs_for(jobs, len(sweep)), len(sweep))
    with closing(answers), listener.progress("simulating", len(sweep)) as heard:
        for task, answer in answers:
            if isinstance(answer, CurvelineError):
                tally.failed += 1
                failed[task.number] = answer
            else:
                digest, states, report = answer.products
                tally.add(digest)
                rows.extend(dict(zip(names, row, strict=True)) for row in states)
                points.append(SweptPoint(task.number, task.swept, report))
            heard(task.number)
    return SweepReport(sweep, settings, rows, points, tally, failed)
