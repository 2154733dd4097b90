"""`curveline display check`: what is wrong with a display file, what the display can do, and what looks odd."""

from __future__ import annotations

from typing import Annotated

import typer

from curveline.cli import completion
from curveline.cli.options import JsonOption
from curveline.cli.printing import screen
from curveline.cli.terminal import TERMINAL


def check(
    file: Annotated[
        str,
        typer.Argument(
            metavar="NAME|FILE",
            autocompletion=completion.displays,
            help="A display file (.toml), or a built-in display.",
        ),
    ],
    json: JsonOption = False,
) -> None:
    """Check a display file and say what the display can do.

    Every problem of the file is listed, with exit code 2. A file without problems gives the rod's stiffness, the rod
    left for the tails, the reach of the motors in encoder counts, the lengths of rod that they hold between level
    nodes, and a warning for everything that is legal but looks odd.
    """
    from curveline.cli.printing.reports.display_report import describe
    from curveline.displays.check import check_of
    from curveline.shapes.files import given_display

    display = given_display(file)
    TERMINAL.computing()
    checked = check_of(display)
    if json:
        screen.emit(checked.document())
    else:
        screen.result("\n".join(describe(checked)))
