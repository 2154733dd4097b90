"""`simulate --sweep`: every combination of some ranges in one shape, summed up on one screen or listed in full."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack, closing
from typing import Any

from curveline.cli.batch import BatchRequest
from curveline.cli.printing import failures, screen, terminal
from curveline.cli.printing.progress.progress_bar import Bar
from curveline.cli.terminal import TERMINAL
from curveline.errors import EXIT_DONE, EXIT_NO, InvalidInput
from curveline.kernels.compile_time import clock
from curveline.outputs import PICTURES, SWEEP, open_sweep
from curveline.phrases import counted
from curveline.shapes.radians import tell_of_radians
from curveline.simulation.batch import Maker, Order, jobs_for, line_of
from curveline.simulation.sweep import Sweep, SweepTally, digests
from curveline.simulation.sweep_run import Stretch, SweepRun
from curveline.simulation.sweep_view import view_of

MOST_COMPLAINTS = 5
"""Points that failed, of which each is told of; then they are only counted."""

Sink = tuple[Maker, Callable[[Any], None]]
"""What is made of every report, and who takes it."""


def run_sweep(shapes: Sequence[str], ranges: Sequence[str], request: BatchRequest, plot: str = "") -> int:
    """Simulate a shape over ranges of its numbers; the exit code.

    `plot` is what figures show over one key, empty for the usual.
    """
    if len(shapes) != 1:
        raise InvalidInput(f"--sweep is for one shape, not {len(shapes)}", "sweep one shape after the other")
    sweep = Sweep(shapes[0], ranges)
    if any(SWEEP.suffix_of(path) in PICTURES for path in request.files):
        # Refused now, not when all points have been simulated.
        view_of(sweep, plot)
    tell_of_radians([sweep.file.scene], TERMINAL)
    with Bar("checking", len(sweep)) as bar:
        sweep.check(bar.reach)
    TERMINAL.computing()
    tally = SweepTally.of(len(sweep.file.scene.segments))
    jobs = jobs_for(request.jobs, len(sweep))
    begin = clock()
    with ExitStack() as stack:
        sinks = [(digests, tally.add), *_sinks(sweep, request, plot, stack)]
        order = Order(request.settings, tuple(make for make, _ in sinks))
        run = SweepRun(sweep, order, jobs)
        stretches = stack.enter_context(closing(run.stretches()))
        bar = stack.enter_context(Bar("simulating", len(sweep)))
        if jobs > 1:
            # The first answers wait for the processes to start.
            bar.show()
        for stretch in stretches:
            with terminal.aside() if request.as_json else ExitStack():
                _take(stretch, sinks, tally)
            bar.reach(stretch.last)
    helpers = counted(jobs, "thread") if run.is_on_threads else f"{jobs} process{'' if jobs == 1 else 'es'}"
    _sum_up(sweep, tally, request, (clock() - begin, helpers))
    return EXIT_DONE if tally.good == len(sweep) else EXIT_NO


def _sinks(sweep: Sweep, request: BatchRequest, plot: str, stack: ExitStack) -> Iterator[Sink]:
    """Who wants to know of every point, besides the summary."""
    if request.as_json:
        yield line_of, screen.result
    for path in request.files:
        file = stack.enter_context(open_sweep(path, sweep, request.settings, plot=plot, force=request.force))
        yield file.make, file.take


def _take(stretch: Stretch, sinks: Sequence[Sink], tally: SweepTally) -> None:
    if stretch.error is not None:
        failures.answer(stretch.error, point=stretch.first, swept=dict(stretch.swept))
        tally.failed += 1
        if tally.failed <= MOST_COMPLAINTS:
            where = ", ".join(f"{key}={value:g}" for key, value in stretch.swept)
            screen.note(f"point {stretch.first}, {where}: {stretch.error.message}")
        return
    for (_, take), products in zip(sinks, stretch.products, strict=True):
        for product in products:
            take(product)


def _sum_up(sweep: Sweep, tally: SweepTally, request: BatchRequest, cost: tuple[float, str]) -> None:
    """The screen, if results are not elsewhere, and beside it how many points are as asked for."""
    if not request.as_json:
        from curveline.cli.printing.reports.sweep_overview import describe

        seconds, helpers = cost
        screen.result("\n".join(describe(sweep, tally, request.settings)))
        screen.result(f"{seconds:.1f} s on {helpers}, {len(sweep) / seconds:.0f} points per second")
    for path in request.files:
        screen.note(f"wrote {path}")
    screen.note(f"{tally.good} of {len(sweep)} points as asked for")
    shortfalls = [
        ("without the wanted state", tally.without),
        *((outcome.value, count) for outcome, count in tally.short.most_common()),
        ("failed", tally.failed),
    ]
    for label, count in shortfalls:
        if count:
            screen.note(f"  {label}: {count}")
