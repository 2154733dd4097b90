"""The shapes that come with the package, by name; a wheel has them within, a source tree in its folder `shapes`."""

from __future__ import annotations

import os
from collections.abc import Mapping
from difflib import get_close_matches
from functools import cache
from itertools import islice
from pathlib import Path
from types import MappingProxyType

from curveline.errors import InvalidInput
from curveline.shapes.toml_document import nearest
from curveline.system.files import AnyPath, refuse_file
from curveline.system.given_files import GivenFile, read_given

HERE = Path(__file__).parent
DISPLAYS = "displays"
"""Folders in which files are displays."""
MOST_NEIGHBOURS = 1000
"""Files of a folder that are looked at for the one that was meant."""


@cache
def builtin_shapes() -> Mapping[str, Path]:
    """Name of every built-in shape, sorted, and its file.

    `read_shape` takes the name or the file, and says which display, nodes and segments it has.
    """
    packaged = HERE / "builtin"
    folder = packaged if packaged.is_dir() else HERE.parents[1] / "shapes"
    files = (file for file in folder.rglob("*.toml") if file.parent.name != DISPLAYS)
    return MappingProxyType({file.stem: file for file in sorted(files, key=lambda file: file.stem)})


def given_shape(path: AnyPath, limit: int) -> GivenFile:
    """What is at a path, or else the built-in shape of that name; InvalidInput as of `read_given`, with a guess."""
    name = os.fspath(path)
    if name in builtin_shapes() and not os.path.lexists(name):
        return read_given(builtin_shapes()[name], limit)
    try:
        return read_given(name, limit)
    except InvalidInput as error:
        if [found.code for found in error.diagnostics] == ["no-such-file"]:
            refuse_file(name, "no-such-file", "there is no such file", _hint_for(name))
        raise


def _hint_for(name: str) -> str:
    """What was probably meant by the name of a file that is not there."""
    folder, base = os.path.split(name)
    stem = base.removesuffix(".toml")
    if stem in builtin_shapes():
        return f"a built-in shape is called {stem}: name it like that, without folder and suffix"
    if (HERE / DISPLAYS / f"{stem}.toml").is_file():
        return f"{stem} is a built-in display, not a shape: `curveline new shape --display {stem}` makes one for it"
    close = get_close_matches(base[:100], _neighbours(folder), n=1)
    guess = f"did you mean {os.path.join(folder, close[0])}? " if close else nearest(stem, list(builtin_shapes()))
    return f"{guess}check the spelling and the current folder; `curveline shapes` lists the built-in ones"


def _neighbours(folder: str) -> list[str]:
    """Shapes and plans in a folder, to be typed as they are."""
    try:
        with os.scandir(folder or os.curdir) as entries:
            names = [entry.name for entry in islice(entries, MOST_NEIGHBOURS)]
    except (OSError, ValueError):
        return []
    return [name for name in names if name.isprintable() and name.endswith((".toml", ".json"))]
