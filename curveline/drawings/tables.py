"""Points from a table: CSV, with commas, semicolons or tabs."""

from __future__ import annotations

import csv
import math
from collections.abc import Iterator

import numpy as np

from curveline.drawings.drawing import MOST_POINTS
from curveline.drawings.lengths import UNITS, metres_of
from curveline.drawings.sketch import HowToRead, Piece, Sketch
from curveline.errors import Diagnostic, InvalidInput
from curveline.system.files import decode_text, excerpt, refuse_file

MAX_SHOWN = 20
"""Problems of a file that are listed."""
CURVE = "curve"
"""The column that names the curve which a point is of."""
SEPARATORS = ("\t", ";", ",")
LONGEST_LINE = 10_000


def read(data: bytes, how: HowToRead, name: str) -> Sketch:
    """The curves through the points of a table, whose first line names its columns: x_mm and y_mm, or other units.

    Columns x and y take their unit from whoever asks; a column `curve` tells curves apart. InvalidInput for a table
    that does not say its unit, or has lines that are no points.
    """
    lines = decode_text(data, name).splitlines()
    if len(lines) > MOST_POINTS + 1:
        refuse_file(name, "too-large", f"it has more than {MOST_POINTS} lines", "leave out points")
    if max(map(len, lines), default=0) > LONGEST_LINE:
        refuse_file(name, "too-large", f"it has lines of more than {LONGEST_LINE} letters", "give a point per line")
    header = lines[0] if lines else ""
    separator = next((each for each in SEPARATORS if each in header), ",")
    cells = [cell.strip() for cell in _cells(header, separator)]
    unit, said, columns = _columns(cells, how, name)
    curve = cells.index(CURVE) if CURVE in cells else -1
    curves: dict[str, list[tuple[float, float]]] = {}
    problems = []
    for number, line in enumerate(lines[1:], start=2):
        if not line.strip(" \t,;") or line.startswith("#"):
            continue
        found = _point(_cells(line, separator), (*columns, curve), separator)
        if isinstance(found, str):
            problems.append(_problem(name, number, line, found))
            if len(problems) == MAX_SHOWN:
                break
        else:
            curves.setdefault(found[0], []).append(found[1])
    if problems:
        raise InvalidInput(f"{name}: {problems[0].message}", problems[0].hint, problems)
    pieces = tuple(Piece(np.array(points), (key,) if key else ()) for key, points in curves.items())
    said = f"CSV of {sum(map(len, curves.values()))} points, {said}"
    return Sketch(pieces, unit, said, is_joined=False)


def _cells(line: str, separator: str) -> list[str]:
    if '"' not in line:
        return line.split(separator)
    try:
        return next(csv.reader([line], delimiter=separator), [])
    except csv.Error:
        return []


def _point(cells: list[str], columns: tuple[int, int, int], separator: str) -> tuple[str, tuple[float, float]] | str:
    """The curve and the point of a line, or what is wrong with it."""
    if len(cells) <= max(columns):
        return "this line ends before its x and y"
    texts = [cells[column].strip() for column in columns[:2]]
    if separator != ",":
        # Where commas do not part columns, they are what begins a fraction in half of Europe.
        texts = [text.replace(",", ".") for text in texts]
    try:
        x, y = map(float, texts)
    except ValueError:
        return "this line has no x and y"
    if not math.isfinite(x + y):
        return "x or y of this line is no number"
    return (cells[columns[2]].strip() if columns[2] >= 0 else ""), (x, y)


def _problem(name: str, number: int, line: str, message: str) -> Diagnostic:
    source, caret = excerpt(line, 1)
    hint = "give two numbers, such as 120.5,33.1, and leave lines out that have none"
    return Diagnostic(name, number, 1, "no-point", message, hint, source, caret)


def _columns(header: list[str], how: HowToRead, name: str) -> tuple[float, str, tuple[int, int]]:
    """What a unit of the table is in metres, 0 if only a width is known; how that was said; the columns of x and y."""
    units = [unit for unit in UNITS if {f"x_{unit}", f"y_{unit}"} <= set(header)]
    pairs: Iterator[tuple[str, str]] = ((f"x_{unit}", f"y_{unit}") for unit in units)
    x, y = next(pairs, ("x", "y"))
    if not {x, y} <= set(header):
        hint = "begin it with the line x_mm,y_mm, and give a point per line"
        refuse_file(name, "header", "the first line of this file does not name the columns of x and y", hint)
    at = header.index(x), header.index(y)
    if how.width_mm is not None:
        return 0.0, f"columns {x} and {y}", at
    if units and how.unit not in ("", units[0]):
        refuse_file(name, "two-units", f"its columns are in {units[0]}, and {how.unit} was asked for", "ask for none")
    if not (units or how.unit):
        hint = "name them x_mm and y_mm, or say --unit mm"
        refuse_file(name, "no-unit", "its columns x and y have no unit", hint)
    unit = how.unit or units[0]
    return metres_of(unit), f"columns {x} and {y} in {unit}", at
