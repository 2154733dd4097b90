"""Where a new file goes, and what it is called."""

from __future__ import annotations

import os
import shlex
from typing import Annotated, NamedTuple

import typer

from curveline.cli.printing import screen

NameArgument = Annotated[
    str | None, typer.Argument(metavar="NAME", help="Its name, which is also that of the file, or the file.")
]
OutputOption = Annotated[
    str | None,
    typer.Option("-o", "--output", metavar="FILE", help="Where to; - is stdout.  [default: NAME.toml]"),
]
SUFFIX = ".toml"


class NewPlace(NamedTuple):
    """The name that a new file gives itself, and its path; None for stdout."""

    name: str
    path: str | None


def place_of(name: str | None, output: str | None, default: str) -> NewPlace:
    """Where to, from a name that may be a path, and `--output`."""
    stem = os.path.basename(name or (output if output and output != "-" else default)).removesuffix(SUFFIX)
    path = output or f"{(name or default).removesuffix(SUFFIX)}{SUFFIX}"
    return NewPlace(stem, None if path == "-" else path)


def show(text: str, place: NewPlace, following: str) -> None:
    """Print a new file, or say where it is and what to do with it: `following` is a command with {} for its name."""
    if place.path is None:
        screen.result(text.rstrip("\n"))
    else:
        screen.note(f"wrote {place.path}; next: {following.replace('{}', shlex.quote(place.path))}")
