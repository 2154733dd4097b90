"""`curveline new display`: a display file to begin with."""

from __future__ import annotations

from typing import Annotated

import typer

from curveline.cli.new_file import NameArgument, OutputOption, place_of, show


def display(
    name: NameArgument = None,
    nodes: Annotated[int, typer.Option(min=2, max=128, metavar="N", help="How many nodes it has.")] = 2,
    output: OutputOption = None,
) -> None:
    """Write a display file to begin with: valid as it is, and every key explained.

    It goes to NAME.toml, and never over a file that exists.
    """
    from curveline.shapes.new_files import new_display

    place = place_of(name, output, "my-display")
    show(new_display(place.path, nodes, name=place.name), place, "curveline display check {}")
