"""Options that many commands have, and the sections of a help in which options stand."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from curveline.cli import completion
from curveline.cli.printing.manner import MANNER
from curveline.errors import InvalidInput

RESULTS = "Results"
LINK = "Radio and records"


def shorten(is_wanted: bool) -> bool:
    """What the option --brief does."""
    MANNER.is_brief = is_wanted
    return is_wanted


RadioOption = Annotated[
    str | None,
    typer.Option(
        "-r",
        "--radio",
        envvar="CURVELINE_RADIO",
        metavar="SPEC",
        autocompletion=completion.radios,
        rich_help_panel=LINK,
        help="How to reach the nodes: mock, which is a model of them, serial:PORT or nrf24:CE,CSN.",
    ),
]
RunsOption = Annotated[
    str | None,
    typer.Option(
        "--runs",
        metavar="DIR",
        rich_help_panel=LINK,
        help="Folder of the records of runs, instead of the user's or CURVELINE_RUNS.",
    ),
]
DisplayOption = Annotated[
    str,
    typer.Option(
        "-d",
        "--display",
        metavar="NAME|FILE",
        autocompletion=completion.displays,
        rich_help_panel=LINK,
        help="A built-in display, or a display file.",
    ),
]
CameraOption = Annotated[
    str | None,
    typer.Option(
        metavar="FILE",
        rich_help_panel="Looking at the display",
        show_default="that of a mock display",
        help="The camera file of the pictures: see `curveline camera`.",
    ),
]
TrialsCameraOption = Annotated[
    str | None,
    typer.Option(
        metavar="FILE",
        rich_help_panel="Photographs",
        show_default="camera.toml of the folder",
        help="The camera file of the photographs.",
    ),
]
YesOption = Annotated[bool, typer.Option("-y", "--yes", help="Do not ask before anything moves.")]
AgreeOption = Annotated[bool, typer.Option("-y", "--yes", help="Do not ask before anything changes.")]
ForceOption = Annotated[
    bool, typer.Option("-f", "--force", rich_help_panel=RESULTS, help="Overwrite files that exist.")
]
JsonOption = Annotated[
    bool, typer.Option("--json", rich_help_panel=RESULTS, help="JSON on stdout, one document; errors, too.")
]
BriefOption = Annotated[
    bool,
    typer.Option(
        "-b", "--brief", callback=shorten, rich_help_panel=RESULTS, help="A few short lines, easy to look through."
    ),
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
