"""`curveline new shape`: a shape file to begin with."""

from __future__ import annotations

from enum import StrEnum
from typing import Annotated

import typer

from curveline.cli.new_file import NameArgument, OutputOption, place_of, show
from curveline.cli.options import DisplayOption


class NewState(StrEnum):
    """What `--state` takes."""

    PEAK = "peak"
    VALLEY = "valley"
    STRAIGHT = "straight"


def shape(
    name: NameArgument = None,
    display: DisplayOption = "single",
    state: Annotated[NewState, typer.Option(help="What every segment is to show.")] = NewState.PEAK,
    output: OutputOption = None,
) -> None:
    """Write a shape file to begin with: valid as it is, and every key explained.

    It goes to NAME.toml, and never over a file that exists.
    """
    from curveline.shapes.new_files import new_shape

    place = place_of(name, output, "my-shape")
    show(new_shape(place.path, display, state.value, name=place.name), place, "curveline simulate {}")
