"""`curveline keys node`: put a node's settings and the site's key into its program."""

from __future__ import annotations

from typing import Annotated

import typer

from curveline.cli.options import DisplayOption
from curveline.cli.printing import screen
from curveline.cli.terminal import TERMINAL


def node(
    number: Annotated[int, typer.Argument(metavar="N", min=1, help="Number of the node in its display, from 1.")],
    hex: Annotated[str, typer.Option("--hex", metavar="FILE", help="The node.hex that the firmware's build wrote.")],
    output: Annotated[str, typer.Option("-o", "--output", metavar="FILE", help="Where to write the node's own image.")],
    display: DisplayOption = "single",
) -> None:
    """Write the image of one node: program, number, address, limits, key.

    The file holds the site's key: only you may read it. Delete it once the node is flashed.
    """
    from curveline.driving.site_keys import node_image

    image = node_image(number, hex, output, display, TERMINAL)
    screen.result(f"{image.path}: node {image.node} of display {image.display}, address {image.address}")
    screen.note(f"flash it with: teensy_loader_cli --mcu=TEENSYLC -w {output}; then delete it, it holds the site's key")
