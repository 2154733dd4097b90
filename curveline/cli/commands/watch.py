"""`curveline watch`: look at a display again and again, and say when its rod snaps."""

from __future__ import annotations

from itertools import islice
from typing import TYPE_CHECKING, Annotated

import typer

from curveline.cli.options import (
    RESULTS,
    BriefOption,
    CameraOption,
    RadioOption,
    RunsOption,
    runs_folder,
)
from curveline.cli.printing import screen
from curveline.cli.terminal import TERMINAL
from curveline.errors import EXIT_DONE, EXIT_NO
from curveline.phrases import local_time

if TYPE_CHECKING:
    from curveline.driving.looking.watching import Sighting


def watch(
    source: Annotated[
        str,
        typer.Argument(
            metavar="COMMAND|FOLDER",
            help="A command in which {} stands for the picture, a folder into which a camera puts pictures, or `mock`.",
        ),
    ],
    shape: Annotated[str, typer.Argument(metavar="SHAPE", help="The shape that the display was sent.")],
    camera: CameraOption = None,
    every_s: Annotated[float, typer.Option(metavar="S", help="Seconds from one picture to the next.")] = 2.0,
    count: Annotated[
        int | None, typer.Option(min=1, metavar="N", show_default="until Ctrl-C", help="End after so many pictures.")
    ] = None,
    radio: RadioOption = None,
    json: Annotated[
        bool, typer.Option("--json", rich_help_panel=RESULTS, help="JSON on stdout, one document per picture and line.")
    ] = False,
    brief: BriefOption = False,
    runs: RunsOption = None,
) -> None:
    """Look at a display again and again: which states it shows, and when its rod was snapped over by hand.

    Nothing is sent to it. A line is printed when something is other than it was; --json has every picture.

    Exit code 1 says that the last of --count pictures does not show the shape as wanted.
    """
    from curveline.driving.looking.watching import WatchRequest
    from curveline.driving.looking.watching import watch as look_again

    request = WatchRequest(camera, every_s, radio or "mock", runs_folder(runs))
    last: Sighting | None = None
    for sighting in islice(look_again(source, shape, request, TERMINAL), count):
        _show(sighting, last, as_json=json)
        last = sighting
    raise typer.Exit(EXIT_DONE if last is not None and last.look.is_wanted else EXIT_NO)


def _show(sighting: Sighting, before: Sighting | None, *, as_json: bool) -> None:
    """Print what was seen, if it is news."""
    if as_json:
        screen.emit(sighting.document())
    elif before is None or sighting.line() != before.line():
        screen.result(f"{local_time(sighting.at)}  {sighting.line()}")
