"""`curveline new shape`: a shape file to begin with."""

from __future__ import annotations

import os
from enum import StrEnum
from typing import Annotated

import typer

from curveline.cli.new_file import NameArgument, OutputOption, place_of, put
from curveline.cli.options import DisplayOption


class NewState(StrEnum):
    """What `--state` takes."""

    PEAK = "peak"
    VALLEY = "valley"


def shape(
    name: NameArgument = None,
    display: DisplayOption = "single",
    state: Annotated[NewState, typer.Option(help="What every segment is to show.")] = NewState.PEAK,
    output: OutputOption = None,
) -> None:
    """Write a shape file to begin with: valid as it is, and every key explained.

    It goes to NAME.toml, and never over a file that exists.
    """
    from curveline.shapes.files import read_display
    from curveline.shapes.templates import check_new_shape, new_shape

    place = place_of(name, output, "my-shape")
    read = read_display(display)
    named = _as_named_in(place.folder, read.path) if read.path else display
    text = new_shape(place.name, read, named, state.value)
    check_new_shape(text, place.folder)
    put(text, place, "curveline simulate {}")


def _as_named_in(folder: str, display: str) -> str:
    """The path of a display file as a shape in a folder names it."""
    try:
        path = os.path.relpath(display, folder or os.curdir)
    except ValueError:  # on another drive
        path = display
    return path.replace(os.sep, "/")
