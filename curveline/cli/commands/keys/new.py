"""`curveline keys new`: make the key file of a site."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from curveline.cli.printing import screen
from curveline.cli.printing.key_note import warn_of_commits


def new(
    file: Annotated[
        str | None,
        typer.Option("--file", metavar="FILE", help="Where to, instead of the usual place or CURVELINE_KEYS."),
    ] = None,
) -> None:
    """Make a site's key file, once; nobody but you may read it.

    Keep a copy in a safe place: whoever has it can move the display, and without it every node must be given another.
    """
    from curveline.radio.site.key_file import default_path, new_site

    site = new_site(Path(file) if file else default_path())
    screen.result(f"{site.path}: master key {site.fingerprint} (a fingerprint, not the key)")
    warn_of_commits(site.path)
    screen.note(
        "next: `curveline keys node` puts it into each node's program, `curveline keys adopt` learns who they are"
    )
