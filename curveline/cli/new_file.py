"""Where a new file goes, and what it is called."""

from __future__ import annotations

import os
import shlex
from typing import Annotated, NamedTuple

import typer

from curveline.cli.printing import screen
from curveline.system.files import refuse_file, write_file

NameArgument = Annotated[
    str | None, typer.Argument(metavar="NAME", help="Its name, which is also that of the file, or the file.")
]
OutputOption = Annotated[
    str | None,
    typer.Option("-o", "--output", metavar="FILE", help="Where to; - is stdout.  [default: NAME.toml]"),
]
SUFFIX = ".toml"


class NewPlace(NamedTuple):
    """The name that a new file gives itself, and its path; empty for stdout."""

    name: str
    path: str

    @property
    def folder(self) -> str:
        """The folder of the file; empty for the current one."""
        return os.path.dirname(self.path)


def place_of(name: str | None, output: str | None, default: str) -> NewPlace:
    """Where to, from a name that may be a path, and `--output`; InvalidInput if there is a file already."""
    stem = os.path.basename(name or (output if output and output != "-" else default)).removesuffix(SUFFIX)
    path = output or f"{(name or default).removesuffix(SUFFIX)}{SUFFIX}"
    if path == "-":
        return NewPlace(stem, "")
    if os.path.lexists(path):
        refuse_file(path, "exists", "the file exists already", "choose another name: a new file replaces none")
    return NewPlace(stem, path)


def put(text: str, place: NewPlace, following: str) -> None:
    """Write a new file, and say what to do with it: `following` is a command with {} for its name."""
    if not place.path:
        screen.result(text.rstrip("\n"))
        return
    write_file(place.path, text.encode())
    screen.note(f"wrote {place.path}; next: {following.replace('{}', shlex.quote(place.path))}")
