"""Options that several commands have: the radio, the display, the folder of runs."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from curveline.errors import InvalidInput

RadioOption = Annotated[
    str | None,
    typer.Option("--radio", envvar="CURVELINE_RADIO", metavar="SPEC", help="How to reach the nodes, such as mock."),
]
RunsOption = Annotated[
    str | None,
    typer.Option(
        "--runs", metavar="DIR", help="Folder of the records of runs, instead of the user's or CURVELINE_RUNS."
    ),
]
DisplayOption = Annotated[
    str, typer.Option("--display", metavar="NAME|FILE", help="A built-in display, or a display file.")
]


def require_radio(spec: str | None) -> str:
    """The radio that was named; InvalidInput if none was."""
    if spec:
        return spec
    raise InvalidInput(
        "no radio was named", hint="add --radio mock, a model of the display, or set CURVELINE_RADIO to your radio"
    )


def runs_folder(chosen: str | None) -> Path:
    """The folder of the records of runs."""
    from curveline.radio.host import journal

    return Path(chosen) if chosen else journal.runs_folder()
