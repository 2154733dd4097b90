"""`curveline keys new`: make the key file of a site."""

from __future__ import annotations

from typing import Annotated

import typer

from curveline.cli.printing import screen
from curveline.cli.terminal import TERMINAL


def new(
    file: Annotated[
        str | None,
        typer.Option("--file", metavar="FILE", help="Where to, instead of the usual place or CURVELINE_KEYS."),
    ] = None,
) -> None:
    """Make a site's key file, once; nobody but you may read it.

    Keep a copy in a safe place: whoever has it can move the display, and without it every node must be given another.
    """
    from curveline.driving.site_keys import new_keys

    site = new_keys(file, TERMINAL)
    screen.result(f"{site.path}: master key {site.fingerprint} (a fingerprint, not the key)")
    screen.note(
        "next: `curveline keys node` puts it into each node's program, `curveline keys adopt` learns who they are"
    )
