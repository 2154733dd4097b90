"""The manifest of a folder of lines: which displays are driven together, with which plans, over which radios.

A manifest may have been written by hand, or by a stranger: what it names is only looked for within its folder.
"""

from __future__ import annotations

import math
import os
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import PurePosixPath, PureWindowsPath

from curveline.errors import InvalidInput
from curveline.shapes.file_keys import LinesTable, LineTable
from curveline.shapes.toml_document import Document, shown
from curveline.system.file_kinds import LINES, refuse_other_kind
from curveline.system.files import AnyPath, decode_text, read_file

MANIFEST = "lines.toml"
MAX_BYTES = 1_000_000
EXAMPLE = """write one with a table per line: `[[lines]]`, `name = "1"`, `plan = "line-1.json"`, and, where it is not \
named when the folder is sent, `radio = "serial:PORT"`"""


@dataclass(frozen=True)
class LineEntry:
    """A line as the manifest has it; None and "" stand for what it does not say."""

    name: str
    plan: str  # path
    display: str  # path, or the name of a built-in one
    radio: str
    current: float | None  # [A] while it moves


@dataclass(frozen=True)
class LinesFile:
    """A manifest that was read, with paths that begin where the folder does."""

    folder: str
    name: str
    lines: tuple[LineEntry, ...]  # front to back
    current_limit: float | None  # [A] of all that move at the same time


def read_lines_file(folder: AnyPath) -> LinesFile:
    """The manifest of a folder; InvalidInput says all that is wrong with it, or what to write if there is none."""
    where = os.fspath(folder)
    path = os.path.join(where, MANIFEST)
    if not os.path.lexists(path):
        raise InvalidInput(f"{where}: there is no {MANIFEST} in this folder, which says what to send", EXAMPLE)
    text = decode_text(read_file(path, MAX_BYTES), path)
    refuse_other_kind(text, path, LINES)
    document = Document(path, text, ("lines",))
    if not document.data:
        raise InvalidInput(f"{path}: the file says nothing", EXAMPLE)
    table = document.validate(LinesTable)
    if table is not None:
        _check(document, table, where)
    if table is None or document.diagnostics():
        raise document.error()
    name = table.name or os.path.basename(os.path.abspath(where)) or "lines"
    return LinesFile(where, name, tuple(_entry(each, where) for each in table.lines), table.current_limit_A)


def _entry(line: LineTable, folder: str) -> LineEntry:
    display = line.display or ""
    if display.endswith(".toml"):
        display = os.path.join(folder, display)
    return LineEntry(line.name, os.path.join(folder, line.plan), display, line.radio or "", line.current_A)


def _check(document: Document, table: LinesTable, folder: str) -> None:
    """Record what does not fit together."""
    for index, line in enumerate(table.lines):
        for key, value in (("plan", line.plan), ("display", line.display), ("radio", line.radio)):
            if value is not None and not value.isprintable():
                message = f"{key} is {shown(value)}, in which are characters that nobody can read"
                document.problem(("lines", index, key), "bad-name", message, "write text on one line")
    if table.name is not None and not _is_plain(table.name):
        document.problem(("name",), "bad-name", "a name is text on one line", "write a name, or leave it out")
    _check_names(document, [line.name for line in table.lines])
    _check_plans(document, table.lines, folder)
    if table.current_limit_A is not None:
        _check_currents(document, table.lines, table.current_limit_A)


def _check_names(document: Document, names: Sequence[str]) -> None:
    for index, name in enumerate(names):
        place = ("lines", index, "name")
        if not _is_plain(name):
            document.problem(place, "bad-name", f"no line can be called {shown(name)}", "write a short name")
        elif name.casefold() in (each.casefold() for each in names[:index]):
            document.problem(place, "duplicate-name", f"another line is called {name}, too", "give each its own name")


def _is_plain(name: str) -> bool:
    return name.isprintable() and name.strip() == name != ""


def _check_plans(document: Document, lines: Sequence[LineTable], folder: str) -> None:
    seen: dict[str, int] = {}
    for index, line in enumerate(lines):
        outside = [(key, path) for key, path in _paths(line) if not _is_within(path, folder)]
        for key, path in outside:
            message, hint = f"{shown(path)} is not within the folder", "copy the file into the folder of the lines"
            document.problem(("lines", index, key), "outside", message, hint)
        if ("plan", line.plan) in outside:
            continue
        real = os.path.realpath(os.path.join(folder, line.plan))
        if real in seen:
            message = f"line {lines[seen[real]].name} has this plan, too"
            hint = "a plan is for the nodes of one display: give each line its own display and plan"
            document.problem(("lines", index, "plan"), "same-plan", message, hint)
        seen.setdefault(real, index)


def _paths(line: LineTable) -> Iterator[tuple[str, str]]:
    yield "plan", line.plan
    if line.display is not None and line.display.endswith(".toml"):
        yield "display", line.display


def _is_within(path: str, folder: str) -> bool:
    """Whether a path means something in the folder on every system, links included."""
    if "\0" in path or not path or PurePosixPath(path).is_absolute() or PureWindowsPath(path).drive:
        return False
    if PureWindowsPath(path).root or ".." in PureWindowsPath(path).parts:
        return False
    home = os.path.realpath(folder)
    return os.path.commonpath([home, os.path.realpath(os.path.join(home, path))]) == home


def _check_currents(document: Document, lines: Sequence[LineTable], limit: float) -> None:
    for index, line in enumerate(lines):
        if line.current_A is None:
            message = f"line {line.name} does not say what it draws, which current_limit_A must know"
            document.problem(("lines", index), "no-current", message, "add current_A: amperes while the line moves")
        elif line.current_A > limit and not math.isclose(line.current_A, limit):
            message = f"line {line.name} draws {line.current_A:g} A, more than all lines may: {limit:g} A"
            hint = "it could never move: raise current_limit_A if the supply allows that, or give the line its own"
            document.problem(("lines", index, "current_A"), "beyond-limit", message, hint)
