"""`curveline runs show`: the log of one run."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated

import typer

from curveline.cli import completion
from curveline.cli.options import RunsOption, runs_folder
from curveline.cli.printing import screen
from curveline.errors import EXIT_DONE, EXIT_USAGE

if TYPE_CHECKING:
    from curveline.driving.logbook import Entry


def show(
    run: Annotated[
        str,
        typer.Argument(metavar="RUN", autocompletion=completion.runs, help="The run: its folder, its name, or `last`."),
    ],
    json: Annotated[bool, typer.Option("--json", help="JSON on stdout: the run and its records.")] = False,
    runs: RunsOption = None,
) -> None:
    """Show the log of a run: when which step was released and done, what stopped it, and who went on with it."""
    from curveline.cli.printing.reports.run_text import lines
    from curveline.driving.logbook import log_if_any, run_named
    from curveline.driving.runs import RunEnding

    log = log_if_any(run_named(run, runs_folder(runs)))
    if json:
        screen.emit(log.document())
    else:
        screen.result("\n".join([*lines(log.run), *(line for entry in log for line in _lines(entry))]))
    raise typer.Exit(EXIT_USAGE if log.run.ending is RunEnding.DAMAGED else EXIT_DONE)


def _lines(entry: Entry) -> list[str]:
    from curveline.phrases import local_time, wrapped

    step = f"step {entry.step}" if entry.step else ""
    hint = wrapped(f"hint: {entry.hint}", 4) if entry.hint else []
    return [f"{local_time(entry.at):19}  {step:8}  {entry.what}", *hint]
