"""A sweep as a whole: a row of plain values for every state at every point, and what the points came to."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from contextlib import closing
from dataclasses import dataclass
from typing import Any

from curveline.errors import CurvelineError, InvalidInput
from curveline.listening import SILENT, Listener
from curveline.notebook import html_of, svg_of
from curveline.simulation.batch import Order, jobs_for, run
from curveline.simulation.results import Settings
from curveline.simulation.sweep import Sweep, SweepTally, digests
from curveline.simulation.sweep_files import CLAMPS, SCALARS, SPACE, rows_of
from curveline.simulation.sweep_view import StateMap, ValueCurves, gathering, view_of


@dataclass(frozen=True)
class SweepReport:
    """What a sweep found: a row of plain values for every state at every point, and what the points came to.

    A row has `point`, the swept keys, `segment`, `state` and the numbers of the state, with the unit in the name, such
    as `energy_mJ`; docs/contracts.md lists them. `failed` are the points that could not be simulated, by number from 1.
    `shown` is what a figure draws, None over more than two keys.
    """

    sweep: Sweep  # the grid
    rows: Sequence[Mapping[str, Any]]  # a mapping from column to value per state
    tally: SweepTally  # counts of points
    failed: Mapping[int, CurvelineError]
    shown: ValueCurves | StateMap | None = None

    def _repr_svg_(self) -> str | None:
        return None if self.shown is None else svg_of("curveline.figures.sweeps:draw", self.shown)

    def _repr_html_(self) -> str:
        groups = [
            (number, states, group.points, group.lowest, group.highest)
            for number, segment in enumerate(self.tally.groups, start=1)
            for states, group in segment.items()
        ]
        head = ("segment", "stable states", "points", "lowest eigenvalue from", "to")
        title = f"{len(self.sweep)} points, {self.tally.good} as asked for: {'; '.join(map(str, self.sweep.axes))}"
        return html_of(title, [head, *groups], self._repr_svg_())


def columns_of(sweep: Sweep) -> tuple[str, ...]:
    """The names of the values of a row."""
    return ("point", *(axis.key for axis in sweep.axes), "segment", "state", *SCALARS, *SPACE, *CLAMPS)


def _gathering(sweep: Sweep) -> ValueCurves | StateMap | None:
    """What takes the points for a figure; None for a sweep that cannot be drawn."""
    try:
        return gathering(view_of(sweep))
    except InvalidInput:
        return None


def run_sweep(sweep: Sweep, settings: Settings, jobs: int | None = None, listener: Listener = SILENT) -> SweepReport:
    """Simulate every point of a sweep on `jobs` processes, as many as are fastest for None.

    InvalidInput, before anything is computed, if a point breaks a rule for shape files.
    """
    with listener.progress("checking", len(sweep)) as heard:
        sweep.check(heard)
    listener.computing()
    names, shown = columns_of(sweep), _gathering(sweep)
    rows: list[Mapping[str, Any]] = []
    failed: dict[int, CurvelineError] = {}
    found = SweepReport(sweep, rows, SweepTally.of(len(sweep.file.scene.segments)), failed, shown)
    makers = (digests, rows_of) if shown is None else (digests, rows_of, shown.make)
    answers = run(sweep.tasks(), Order(settings, makers), jobs_for(jobs, len(sweep)), len(sweep))
    with closing(answers), listener.progress("simulating", len(sweep)) as heard:
        for task, answer in answers:
            if isinstance(answer, CurvelineError):
                found.tally.failed += 1
                failed[task.number] = answer
            else:
                digest, states, *drawn = answer.products
                found.tally.add(digest)
                rows.extend(dict(zip(names, row, strict=True)) for row in states)
                if shown is not None:
                    shown.take(drawn[0])
            heard(task.number)
    return found
