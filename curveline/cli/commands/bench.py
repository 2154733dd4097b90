"""`curveline bench`: speed and accuracy, measured on this machine."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from curveline.cli.options import ForceOption, JsonOption
from curveline.cli.printing import screen
from curveline.cli.printing.progress.ticker import patience
from curveline.cli.printing.reports.trade_table import measured, missed
from curveline.cli.terminal import TERMINAL
from curveline.errors import InvalidInput

if TYPE_CHECKING:
    from curveline.bench.measurement import Measurement
    from curveline.bench.trade import TradePoint


def bench(
    shapes: Annotated[
        list[Path] | None, typer.Argument(metavar="SHAPE", help="Shape files; the project's own if none is named.")
    ] = None,
    quick: Annotated[bool, typer.Option("-q", "--quick", help="Only the figures that are held against goals.")] = False,
    link: Annotated[bool, typer.Option("--link", help="The radio link instead, on a model of the radios.")] = False,
    output: Annotated[
        list[Path] | None,
        typer.Option("-o", "--output", metavar="FILE", help="Write the trade as .svg, .png, .pdf or .json."),
    ] = None,
    force: ForceOption = False,
    json: JsonOption = False,
) -> None:
    """Measure speed and accuracy on this machine: about two minutes, one with --quick.

    First the figures that are held against goals. Then the trade: for shape files, for two scenes that other codes were
    measured on, and for random ones, and for each model, vertices against true error against time; * marks what nothing
    else beats in both. "one level" is the bare discrete rod, "one state" is refined to a tolerance in mm, "simulate"
    finds every state. PyElastica and MuJoCo are measured where they are installed (curveline[peers]).

    Timings vary from run to run; the ratios are taken in one run and vary less. Nothing here passes or fails; ! marks a
    figure that misses its goal.

    With --link host and nodes talk through modelled air at 2 Mbit/s: how often nodes are polled, what lost packets
    cost, how soon a step is released. The times of SPI (0.6 ms a poll) and of a dongle (2 ms a request of up to 16
    frames, 0.05 ms a frame) are assumed. What a node's processor spends is measured in the source tree, by
    `python -m tests.firmware.cycles`.
    """
    if link and (shapes or quick):
        raise InvalidInput("--link measures no shapes and is always quick", "leave the other arguments out")
    if output and (link or quick):
        raise InvalidInput("--output writes the trade, which --link and --quick leave out", "leave one of them out")
    if link:
        from curveline.bench import link as radio_link

        rows = _show_rows(radio_link.rows(), hidden=json)
        if json:
            screen.emit({"rows": [vars(row) for row in rows]})
        return
    from curveline.bench.measuring import own_shapes
    from curveline.bench.quick import quick as goals
    from curveline.bench.report import BenchReport, document
    from curveline.outputs import TRADE, check_output, write_output
    from curveline.system.given_files import is_stream

    for path in output or ():
        check_output(TRADE, path, force=force)
    files = [str(path) for path in shapes or own_shapes()]
    if any(map(is_stream, files)):
        raise InvalidInput("shapes are read many times here, and what is piped in only once", "name files")
    TERMINAL.computing()
    rows = _show_rows(goals(files), hidden=json)
    points = [] if quick else _show_trade(files, hidden=json)
    if json:
        screen.emit(document(BenchReport(rows, points)))
    for path in output or ():
        write_output(TRADE, path, (BenchReport(rows, points),), force=force)
        screen.note(f"wrote {path}")


def _show_rows(rows: Iterable[Measurement], *, hidden: bool) -> list[Measurement]:
    """The rows, shown as they are measured, and how many goals they miss."""
    seen: list[Measurement] = []
    pending = iter(rows)
    while True:
        # Each by itself: a line of progress must be gone before a row is printed to the same terminal.
        with patience(f"measuring, {len(seen)} figures done"):
            row = next(pending, None)
        if row is None:
            break
        seen.append(row)
        if not hidden:
            screen.result("\n".join(measured(row)))
    if not hidden:
        screen.result(missed(seen))
    return seen


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
