"""Trials as people keep them: a shape and some files, or folders in which names say what belongs to which shape."""

from __future__ import annotations

import os
import re
from collections.abc import Sequence
from typing import NamedTuple

from curveline.errors import InvalidInput
from curveline.shapes.library import builtin_shapes
from curveline.system.files import AnyPath, refuse_file

TABLES = (".csv", ".tsv", ".txt")
PHOTOGRAPHS = (".jpg", ".jpeg", ".png", ".heic", ".heif")
NUMBERED = re.compile(r"(?P<shape>.+?)[-_. ]+(?:trial[-_ ]?)?[0-9]+")
"""A file's name without its suffix: that of the shape, and the number of the trial."""
SHAPE_SUFFIX = ".toml"
CAMERA = "camera.toml"
"""The camera file of a folder."""
LAYOUT = "a folder has trials such as level-up-peak-1.csv, or a folder level-up-peak with the files of its trials"


class TrialFiles(NamedTuple):
    """The files of a shape's trials, in the order of their names, and the shape, by name or file."""

    shape: str
    files: tuple[str, ...]


def is_photograph(path: str) -> bool:
    """Whether a trial is told by a photograph, going by its suffix."""
    return path.lower().endswith(PHOTOGRAPHS)


def files_of(what: Sequence[AnyPath]) -> list[TrialFiles]:
    """What was named: a shape and its trials, or folders of them.

    InvalidInput if it is neither, a folder has none, or what a file is of cannot be told.
    """
    names = [os.fspath(each) for each in what]
    folders = [os.path.isdir(name) for name in names]
    if names and all(folders):
        return [found for name in names for found in _in_folder(name)]
    if any(folders):
        raise InvalidInput(f"{names[folders.index(True)]}: a folder of trials is taken by itself", LAYOUT)
    if len(names) < 2:
        raise InvalidInput("no trials to compare", "name a shape and the files of its trials, or a folder of trials")
    for name in names[1:]:
        _check_kind(name)
    return [TrialFiles(names[0], tuple(names[1:]))]


def camera_in(what: Sequence[AnyPath]) -> str | None:
    """The camera file of the folders that were named, if there is one."""
    found = (os.path.join(os.fspath(each), CAMERA) for each in what if os.path.isdir(each))
    return next((path for path in found if os.path.isfile(path)), None)


def _check_kind(name: str) -> None:
    if not name.lower().endswith((*TABLES, *PHOTOGRAPHS)):
        hint = f"name points ({', '.join(TABLES)}) or photographs ({', '.join(PHOTOGRAPHS)})"
        refuse_file(name, "kind", "trials are not read from such a file", hint)


def _in_folder(folder: str) -> list[TrialFiles]:
    """The trials of a folder by their shapes, sorted."""
    found: dict[str, list[str]] = {}
    with os.scandir(folder) as entries:
        named = sorted((entry.name, entry.is_dir()) for entry in entries if not entry.name.startswith("."))
    for name, is_folder in named:
        path = os.path.join(folder, name)
        if is_folder:
            if trials := _trials_in(path):
                found.setdefault(name, []).extend(trials)
        elif name.lower().endswith((*TABLES, *PHOTOGRAPHS)):
            stem = os.path.splitext(name)[0]
            numbered = NUMBERED.fullmatch(stem)
            shape = stem if _shape_file(folder, stem) or numbered is None else numbered["shape"]
            found.setdefault(shape, []).append(path)
    if not found:
        raise InvalidInput(f"{folder}: there are no trials in this folder", LAYOUT)
    return [TrialFiles(_shape_of(folder, shape, files[0]), tuple(files)) for shape, files in sorted(found.items())]


def _trials_in(folder: str) -> list[str]:
    """The files of trials in the folder of one shape."""
    with os.scandir(folder) as entries:
        return sorted(
            entry.path for entry in entries if entry.is_file() and entry.name.lower().endswith((*TABLES, *PHOTOGRAPHS))
        )


def _shape_file(folder: str, shape: str) -> str:
    """The file or the name of a shape; "" if there is none."""
    beside = [os.path.join(folder, shape + SHAPE_SUFFIX), os.path.join(folder, shape, "shape" + SHAPE_SUFFIX)]
    if path := next((each for each in beside if os.path.isfile(each)), ""):
        return path
    return shape if shape in builtin_shapes() else ""


def _shape_of(folder: str, shape: str, first: str) -> str:
    """As `_shape_file`; InvalidInput, which names the `first` of its trials, if there is none."""
    if path := _shape_file(folder, shape):
        return path
    hint = f"put the shape file beside the trials as {os.path.join(folder, shape + SHAPE_SUFFIX)}; {LAYOUT}"
    raise InvalidInput(f"{first}: there is no shape {shape}", hint)
