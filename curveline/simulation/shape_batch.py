"""Many shapes simulated, on as many processes as are wanted, and what became of each, as data."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from contextlib import closing
from dataclasses import dataclass

from curveline.errors import CurvelineError
from curveline.listening import SILENT, Listener
from curveline.notebook import html_of
from curveline.scene import Scene
from curveline.simulation.batch import Order, jobs_for, report_of, run, tasks_of
from curveline.simulation.results import Settings, ShapeReport
from curveline.simulation.simulate import STATE_HEAD
from curveline.system.arguments import expect_several
from curveline.system.files import AnyPath


@dataclass(frozen=True)
class ShapeAnswer:
    """What became of one shape: a report, or why there is none."""

    shape: str  # the path or name it goes by
    report: ShapeReport | None  # None if it could not be simulated
    error: CurvelineError | None = None  # why not
    advice: tuple[str, ...] = ()  # with which numbers a wanted state would exist

    @property
    def is_as_wanted(self) -> bool:
        """True if every wanted state exists, and all states are known to the tolerance."""
        return self.report is not None and not self.report.shortfalls


@dataclass(frozen=True)
class ShapeBatch:
    """What became of many shapes: a sequence of answers, in the order in which the shapes were given."""

    answers: tuple[ShapeAnswer, ...]  # one per shape

    @property
    def reports(self) -> tuple[ShapeReport, ...]:
        """The reports of all shapes that could be simulated."""
        return tuple(each.report for each in self.answers if each.report is not None)

    @property
    def failed(self) -> Mapping[str, CurvelineError]:
        """Why the others could not be, by the path or name that they go by."""
        return {each.shape: each.error for each in self.answers if each.error is not None}

    def __iter__(self) -> Iterator[ShapeAnswer]:
        return iter(self.answers)

    def __len__(self) -> int:
        return len(self.answers)

    def __getitem__(self, index: int) -> ShapeAnswer:
        return self.answers[index]

    def _repr_html_(self) -> str:
        rows = [
            (report.scene.name, number, *row)
            for report in self.reports
            for number, segment in enumerate(report, start=1)
            for row in segment.rows()
        ]
        good = sum(each.is_as_wanted for each in self.answers)
        remarks = [f"{shape}: {error.message}" for shape, error in self.failed.items()]
        title = f"{good} of {len(self.answers)} shapes as asked for"
        return html_of(title, [("shape", "segment", *STATE_HEAD), *rows], remarks=remarks)


def simulate_many(
    shapes: Sequence[AnyPath | Scene],
    settings: Settings | None = None,
    jobs: int | None = None,
    listener: Listener = SILENT,
) -> ShapeBatch:
    """Many shapes simulated: files, names of built-in shapes, or scenes; a shape that fails does not stop the others.

    `settings` say how, as usual if it is None: tolerance [m], windings, model, points of a curve in files. `jobs`
    processes share the work, one per core for 0, as many as are fastest for None. The answers are in the order of
    `shapes`, and the same for any number of processes; `write` keeps the reports of all of them in one file.
    """
    expect_several(shapes, "shapes")
    order = Order(settings or Settings(), (report_of,))
    answers = run(tasks_of(shapes, listener), order, jobs_for(jobs, len(shapes)), len(shapes))
    found = []
    with closing(answers), listener.progress("simulating", len(shapes)) as heard:
        for task, answer in answers:
            if isinstance(answer, CurvelineError):
                found.append(ShapeAnswer(task.label, None, answer))
            else:
                found.append(ShapeAnswer(task.label, answer.products[0], advice=answer.advice))
            heard(len(found))
    return ShapeBatch(tuple(found))
