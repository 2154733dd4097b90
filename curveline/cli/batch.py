"""Shape files simulated one after another or on several processes, and what became of each."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import closing
from dataclasses import dataclass

from curveline.cli.printing import failures, screen, terminal
from curveline.cli.printing.manner import MANNER
from curveline.cli.printing.progress.progress_bar import Bar
from curveline.cli.terminal import TERMINAL
from curveline.errors import EXIT_DONE, EXIT_NO, EXIT_USAGE, CurvelineError, InvalidInput
from curveline.material.history import Dwell
from curveline.outputs import SIMULATION, write_output
from curveline.simulation.batch import (
    Order,
    Simulated,
    Task,
    after_history,
    jobs_for,
    line_of,
    report_of,
    run,
    tasks_of,
)
from curveline.simulation.results import Settings, ShapeReport


@dataclass(frozen=True)
class BatchRequest:
    """What the options of `simulate` ask for: how to compute, where the results go, on how many processes."""

    settings: Settings
    files: tuple[str, ...]
    force: bool
    as_json: bool
    is_drawn: bool
    jobs: int | None
    history: tuple[Dwell, ...] = ()


def run_batch(shapes: Sequence[str], request: BatchRequest) -> int:
    """Simulate shape files; the exit code."""
    batch = _Batch(request, len(shapes))
    # The documents are made where the states were found; reports come along only if somebody looks at them.
    makers = [*([line_of] if request.as_json else []), *([] if request.as_json and not request.files else [report_of])]
    order = Order(request.settings, tuple(makers))
    tasks = tasks_of(shapes, TERMINAL)
    if request.history:
        tasks = after_history(tasks, request.history)
    answers = run(tasks, order, jobs_for(request.jobs, len(shapes)), len(shapes))
    with closing(answers), Bar("simulating", len(shapes)) as bar:
        for number, (task, answer) in enumerate(answers, start=1):
            with terminal.aside():
                batch.take(task, answer)
            bar.reach(number)
    batch.write_files()
    batch.sum_up()
    return batch.exit_code


class _Batch:
    """Shows what came of one shape after another, and remembers it."""

    def __init__(self, request: BatchRequest, total: int) -> None:
        self.request = request
        self.total = total
        self.reports: list[ShapeReport] = []
        self.invalid: list[str] = []
        self.short: list[str] = []

    def take(self, task: Task, answer: Simulated | CurvelineError) -> None:
        """Say what came of a file."""
        if isinstance(answer, CurvelineError):
            self._complain(task, answer)
            (self.invalid if isinstance(answer, InvalidInput) else self.short).append(task.label)
            return
        if self.request.files:
            self.reports.append(answer.products[-1])
        for sentence in (*answer.remarks, *answer.shortfalls):
            screen.note(f"{task.label}: {sentence}")
        for sentence in answer.advice:
            screen.advise(f"{task.label}: {sentence}" if self.total > 1 else sentence)
        if answer.shortfalls:
            self.short.append(task.label)
        if self.request.as_json:
            screen.result(answer.products[0])
        else:
            _show(answer.products[-1], drawn=self.request.is_drawn)

    def _complain(self, task: Task, error: CurvelineError) -> None:
        failures.answer(error, file=task.label)
        # Diagnostics name their file; what happened while a sound file was simulated does not.
        is_named = isinstance(error, InvalidInput) and error.diagnostics
        screen.complain(error if is_named else CurvelineError(f"{task.label}: {error.message}", error.hint))

    def write_files(self) -> None:
        """Write what was found to every file that was named."""
        for path in self.request.files if self.reports else ():
            write_output(SIMULATION, path, (self.reports,), force=self.request.force)
            screen.note(f"wrote {path}")

    def sum_up(self) -> None:
        """How the batch went, if it was one."""
        if self.total == 1:
            return
        good = self.total - len(self.invalid) - len(self.short)
        screen.note(f"{good} of {self.total} shapes as asked for")
        for label, paths in (("could not be used", self.invalid), ("not as asked for", self.short)):
            if paths:
                screen.note(f"  {label}: {', '.join(paths)}")

    @property
    def exit_code(self) -> int:
        """A single file answers for itself; a batch says only that some shape of it failed."""
        if self.invalid and self.total == 1:
            return EXIT_USAGE
        return EXIT_NO if self.invalid or self.short else EXIT_DONE


def _show(report: ShapeReport, *, drawn: bool) -> None:
    from curveline.cli.printing.reports.state_table import describe, sketch

    screen.result("\n".join(describe(report)))
    if MANNER.is_brief:
        return
    if drawn:
        screen.result("\n".join(sketch(report)))
    screen.result()
