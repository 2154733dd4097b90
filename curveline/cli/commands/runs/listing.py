"""`curveline runs`: a list of the runs on record."""

from __future__ import annotations

from itertools import islice
from typing import Annotated

import typer

from curveline.cli import completion
from curveline.cli.options import BriefOption, JsonOption, RunsOption, runs_folder
from curveline.cli.printing import screen
from curveline.errors import InvalidInput

SHOWN = 20


def listing(
    context: typer.Context,
    display: Annotated[
        str | None,
        typer.Option(
            "-d",
            "--display",
            metavar="NAME|FILE",
            autocompletion=completion.displays,
            help="Only runs of this display.",
        ),
    ] = None,
    everything: Annotated[bool, typer.Option("-a", "--all", help=f"All of them, not only the newest {SHOWN}.")] = False,
    json: JsonOption = False,
    brief: BriefOption = False,
    runs: RunsOption = None,
) -> None:
    """List the runs on record, the newest first: how each ended, how far it came, whether it can go on and how.

    `curveline runs show RUN` has the log of one.
    """
    if context.invoked_subcommand is not None:
        if display is not None or everything or json or brief or runs is not None:
            hint = f"name them after `{context.invoked_subcommand}`"
            raise InvalidInput("options before a command of `curveline runs` mean nothing", hint)
        return
    from curveline._version import __version__
    from curveline.cli.printing.reports.run_text import lines
    from curveline.driving.runs import read_runs
    from curveline.shapes.files import given_display

    name = given_display(display).name if display is not None else ""
    folder = runs_folder(runs)
    found = list(islice(read_runs(folder, name), None if everything else SHOWN + 1))
    is_more = not everything and len(found) > SHOWN
    found = found if everything else found[:SHOWN]
    if json:
        screen.emit({"curveline": __version__, "runs": [run.document() for run in found], "is_more": is_more})
    else:
        screen.result("\n".join(line for run in found for line in lines(run)) or "no runs")
    if is_more:
        screen.note("there are older ones: --all")
