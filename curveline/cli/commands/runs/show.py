"""`curveline runs show`: the log of one run."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from curveline.cli import completion
from curveline.cli.options import RunsOption, runs_folder
from curveline.cli.printing import screen
from curveline.errors import EXIT_USAGE, InvalidInput

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
    from curveline._version import __version__
    from curveline.cli.printing.run_text import lines
    from curveline.driving.logbook import log_of, plain
    from curveline.driving.runs import RunEnding, read_run
    from curveline.radio.host.journal import FILE_NAME, read_journal

    found = read_run(_folder(run, runs_folder(runs)))
    is_damaged = found.ending is RunEnding.DAMAGED
    try:
        records = read_journal(found.folder / FILE_NAME)
    except InvalidInput:
        records = []
    if json:
        screen.emit({"curveline": __version__, **found.document(), "records": plain(records)})
    else:
        screen.result("\n".join([*lines(found), *(line for entry in log_of(records) for line in _lines(entry))]))
    raise typer.Exit(EXIT_USAGE if is_damaged else 0)


def _folder(name: str, runs: Path) -> Path:
    """The folder of the run that is meant; `last` is the one that was begun last."""
    from curveline.driving.runs import LAST
    from curveline.radio.host.journal import FILE_NAME, find_run
    from curveline.radio.host.run_folder import folder_names

    names = folder_names(runs, FILE_NAME)
    if name != LAST:
        return runs / name if name in names else find_run(runs, name)
    if not names:
        raise InvalidInput(f"there is no run in {runs}", "send a plan or a shape first")
    return runs / names[0]


def _lines(entry: Entry) -> list[str]:
    from curveline.cli.printing.run_text import local_time
    from curveline.phrases import wrapped

    step = f"step {entry.step}" if entry.step else ""
    hint = wrapped(f"hint: {entry.hint}", 4) if entry.hint else []
    return [f"{local_time(entry.at):19}  {step:8}  {entry.what}", *hint]
