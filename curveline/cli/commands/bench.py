"""`curveline bench`: speed and accuracy, measured on this machine."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from curveline.cli.options import RESULTS, ForceOption, JsonOption, RunsOption, runs_folder
from curveline.cli.printing import screen
from curveline.cli.printing.progress.ticker import patience
from curveline.cli.printing.reports import bench_text
from curveline.cli.terminal import TERMINAL
from curveline.errors import CurvelineError, InvalidInput

if TYPE_CHECKING:
    from curveline.bench.measurement import Measurement
    from curveline.bench.quick import FigureGroup
    from curveline.bench.report import BenchReport
    from curveline.bench.trade import TradePoint


def bench(
    shapes: Annotated[
        list[Path] | None, typer.Argument(metavar="SHAPE", help="Shape files; the project's own if none is named.")
    ] = None,
    quick: Annotated[bool, typer.Option("-q", "--quick", help="Only the figures that are held against goals.")] = False,
    link: Annotated[bool, typer.Option("--link", help="The radio link instead, on a model of the radios.")] = False,
    compare: Annotated[
        str | None,
        typer.Option(
            "--compare",
            metavar="FILE|last",
            rich_help_panel=RESULTS,
            help="Also against an older run: its record, or `last`, the newest that was kept.",
        ),
    ] = None,
    output: Annotated[
        list[Path] | None,
        typer.Option("-o", "--output", metavar="FILE", help="Write the trade as .svg, .png, .pdf or .json."),
    ] = None,
    force: ForceOption = False,
    json: JsonOption = False,
    runs: RunsOption = None,
) -> None:
    """Measure speed and accuracy on this machine: about two minutes, one with --quick.

    First the figures that are held against goals. Then the trade: for shape files, for two scenes that other codes were
    measured on, and for random ones, and for each model, vertices against true error against time; * marks what nothing
    else beats in both. "one level" is the bare discrete rod, "one state" is refined to a tolerance in mm, "simulate"
    finds every state. PyElastica and MuJoCo are measured where they are installed (curveline[peers]).

    Timings vary from run to run; the ratios are taken in one run and vary less: those of what solves a rod are over
    Newton's method alone and over scipy's solve_bvp. Nothing here passes or fails; ! marks a figure that misses its
    goal, and the exit code stays 0.

    Each run is kept in the folder `bench` of the records of runs, with machine, load and versions. --compare tells what
    became slower than an older one by more than the noise of repeats.

    With --link host and nodes talk through modelled air at 2 Mbit/s: how often nodes are polled, what lost packets
    cost, how soon a step is released. The times of SPI (0.6 ms a poll) and of a dongle (2 ms a request of up to 16
    frames, 0.05 ms a frame) are assumed. What a node's processor spends is measured in the source tree, by
    `python -m tests.firmware.cycles`.
    """
    if link and (shapes or quick):
        raise InvalidInput("--link measures no shapes and is always quick", "leave the other arguments out")
    if output and (link or quick):
        raise InvalidInput("--output writes the trade, which --link and --quick leave out", "leave one of them out")
    from curveline.bench.measuring import names_of, own_shapes
    from curveline.bench.quick import quick as goals
    from curveline.bench.quick import radio_link
    from curveline.bench.report import LINK, ROD
    from curveline.outputs import TRADE, check_output, write_output

    for path in output or ():
        check_output(TRADE, path, force=force)
    kind, folder = LINK if link else ROD, runs_folder(runs)
    older = None if compare is None else _older(compare, folder, kind)
    files = [] if link else _readable(shapes or own_shapes())
    groups = radio_link() if link else goals(files)
    report = replace(_measured(groups, [] if quick else files, hidden=json), kind=kind, shapes=names_of(files))
    _show(report, older, hidden=json)
    for path in output or ():
        write_output(TRADE, path, (report,), force=force)
        screen.note(f"wrote {path}")
    _keep(report, folder)


def _older(name: str, folder: Path, kind: str) -> BenchReport:
    """The run to compare with; InvalidInput if there is none, or it has no figures in common with this one."""
    from curveline.bench.history import read_bench

    report = read_bench(name, folder, kind)
    if report.kind != kind:
        hint = f"{'leave out' if report.kind != 'link' else 'add'} --link, or compare with `last`"
        raise InvalidInput(f"{name} measured the {report.kind}, and this the {kind}", hint)
    return report


def _readable(files: Sequence[Path | str]) -> list[str]:
    from curveline.system.given_files import is_stream

    names = [str(path) for path in files]
    if any(map(is_stream, names)):
        raise InvalidInput("shapes are read many times here, and what is piped in only once", "name files")
    return names


def _measured(groups: Sequence[FigureGroup], traded: Sequence[str], *, hidden: bool) -> BenchReport:
    """The figures and the trade of some shape files, shown as they are measured, after the conditions."""
    from curveline.bench.machine import Watch, conditions
    from curveline.bench.report import BenchReport

    TERMINAL.computing()
    begun, watch = conditions(), Watch()
    begun = replace(begun, load=watch.before)
    if not hidden:
        screen.result("\n".join([*bench_text.conditions(begun), ""]))
    if begun.is_busy:
        screen.note(bench_text.BUSY)
    rows = list(_rows(groups, hidden=hidden))
    points = _show_trade(traded, hidden=hidden) if traded else []
    return BenchReport(rows, points, replace(begun, load=watch.load()))


def _rows(groups: Sequence[FigureGroup], *, hidden: bool) -> Iterator[Measurement]:
    done = 0
    for part, group in enumerate(groups, start=1):
        pending = group.rows()
        while True:
            # Each by itself: a line of progress must be gone before a row is printed to the same terminal.
            with patience(f"measuring {group.name}, part {part} of {len(groups)}, {done} figures done"):
                row = next(pending, None)
            if row is None:
                break
            done += 1
            if not hidden:
                screen.result("\n".join(bench_text.measured(row)))
            yield row


def _show(report: BenchReport, older: BenchReport | None, *, hidden: bool) -> None:
    """What all of it comes to: ratios, what changed, goals."""
    from curveline.bench.comparison import compare_bench

    comparison = None if older is None else compare_bench(report, older)
    if hidden:
        screen.emit(report.document() | ({} if comparison is None else {"compared": comparison.document()}))
        return
    lines = bench_text.ratios(report.rows)
    if comparison is not None:
        lines += ["", *bench_text.compared(comparison)]
    screen.result("\n".join([*lines, "", bench_text.missed(report.rows)]))
    if report.conditions.is_busy:
        screen.note(bench_text.was_busy(report.conditions.load))


def _keep(report: BenchReport, folder: Path) -> None:
    """Keep it in the history; what was measured is not lost if that is refused, so that is no failure."""
    from curveline.bench.history import keep_bench

    try:
        screen.note(f"kept as {keep_bench(report, folder)}")
    except CurvelineError as error:
        screen.note(f"this run is not kept: {error.message}; {error.hint}")


def _show_trade(files: Sequence[str], *, hidden: bool) -> list[TradePoint]:
    """The points of the trade, shown set by set as they are measured."""
    from curveline.bench.measuring import trade_jobs
    from curveline.bench.trade import measure
    from curveline.cli.printing.reports.trade_table import progress, table

    points: list[TradePoint] = []
    for job in trade_jobs(files):
        # The bar is gone before the table is printed, which may go to the same terminal.
        with progress(job.steps) as told:
            measured = measure(job, told)
        points += measured
        if not hidden:
            screen.result("\n" + "\n".join(table(measured)))
    return points
