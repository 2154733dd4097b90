"""`curveline display show`: the file of a built-in display."""

from __future__ import annotations

from typing import Annotated

import typer

from curveline.cli import completion
from curveline.cli.printing import screen


def show(
    name: Annotated[
        str,
        typer.Argument(metavar="NAME", autocompletion=completion.displays, help="A built-in display: single or quad."),
    ],
) -> None:
    """Print the file of a built-in display.

    Copy it and change the copy.
    """
    from curveline.shapes.files import builtin_text

    screen.result(builtin_text(name).rstrip("\n"))
