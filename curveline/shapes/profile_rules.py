"""A natural curvature that varies along the rod: as pairs in a display file, or in a CSV file beside it."""

from __future__ import annotations

import csv
import math
import os
from collections.abc import Iterator

from curveline.errors import Diagnostic, InvalidInput
from curveline.scene import Profile
from curveline.shapes.file_keys import MAX_PLACES, RodTable
from curveline.shapes.toml_document import Document, shown
from curveline.system.files import decode_text, excerpt, read_file, refuse_file
from curveline.units import mm, told_apart

ALONG, FILE = "natural_curvature_along", "natural_curvature_file"
COLUMNS = ("place_mm", "curvature_per_m")
MAX_BYTES = 1_000_000
MOST = 1e6
"""Largest curvature that a file may have [1/m], as in a display file."""
LEAST_APART = 1e-6
"""Of two places [mm]: what is nearer is the same to any rod, and a curvature between has no slope that is a number."""
RISING = "give the places from the left end of the rod on, each once; for a step two that are a little apart"


def check_profile(document: Document) -> None:
    """Record what is wrong with the pairs in the table of the rod."""
    pairs = document.get("rod", ALONG)
    if document.has("rod", ALONG) and document.has("rod", FILE):
        message = f"{ALONG} and {FILE} both say how the free rod is bent along its length"
        document.problem_at_key(("rod", FILE), "two-ways", message, "keep one of the two")
    if not isinstance(pairs, list):
        return
    whole = document.number("rod", "total_length_mm")
    before = -math.inf
    for index in range(len(pairs)):
        place = document.number("rod", ALONG, index, 0)
        if place is None:
            continue
        if fault := _misplaced(place, before, whole):
            document.problem(("rod", ALONG, index, 0), "out-of-range", *fault)
        before = place


def profile_of(document: Document, table: RodTable, folder: str) -> tuple[Profile | None, bytes]:
    """The profile of a table that the rules found sound, and what was read for it from a file in its `folder`.

    InvalidInput lists every problem of that file; that there is none is a problem of the document.
    """
    if table.natural_curvature_file is None:
        pairs = [(place, value) for place, value in table.natural_curvature_along or ()]
        return _profile(pairs), b""
    path = os.path.join(folder, os.path.expanduser(table.natural_curvature_file))
    if not os.path.lexists(path):
        message = f"there is no file {shown(table.natural_curvature_file)}"
        hint = "a path is relative to the display file; the file has the columns place_mm and curvature_per_m"
        document.problem(("rod", FILE), "no-such-file", message, hint)
        raise document.error()
    data = read_file(path, MAX_BYTES)
    return _profile(_read(path, decode_text(data, path), table.total_length_mm)), data


def _profile(pairs: list[tuple[float, float]]) -> Profile | None:
    if not pairs:
        return None
    places, values = zip(*pairs, strict=True)
    return Profile(tuple(map(mm, places)), tuple(map(float, values)))


def _misplaced(place: float, before: float, whole: float | None) -> tuple[str, str] | None:
    """What is wrong with a place [mm] along a rod behind another one, and what to do; None if nothing is."""
    if place - before < LEAST_APART:
        at, last = told_apart(place, before, 6)
        how = "not" if place <= before else f"less than {LEAST_APART:g} mm"
        return f"the place {at} mm is {how} beyond the one before it, {last} mm", RISING
    if place < 0.0 or (whole is not None and place > whole):
        end = "" if whole is None else f" and ends at {whole:g} mm"
        return f"the place {place:g} mm is not on the rod, which begins at 0{end}", "is it in mm from its left end?"
    return None


def _read(path: str, text: str, whole: float) -> list[tuple[float, float]]:
    """The pairs of a CSV file, in mm and 1/m."""
    lines = text.splitlines()
    try:
        rows = list(csv.reader(lines))
    except csv.Error:
        refuse_file(path, "too-large", "this file has a cell that is too long", "write two short numbers in a line")
    header = [name.strip() for name in rows[0]] if rows else []
    if tuple(header) != COLUMNS:
        hint = f"begin it with the line {','.join(COLUMNS)}"
        refuse_file(path, "header", "the first line of this file does not name its two columns", hint)
    pairs: list[tuple[float, float]] = []
    problems = []
    for number, row in enumerate(rows[1:], start=2):
        if not any(cell.strip() for cell in row):
            continue
        pair, fault = _pair(row, pairs[-1][0] if pairs else -math.inf, whole)
        if fault:
            source, caret = excerpt(lines[number - 1] if number <= len(lines) else "", 1)
            problems.append(Diagnostic(path, number, 1, "out-of-range", *fault, source, caret))
        else:
            pairs.append(pair)
    if problems:
        raise InvalidInput(f"{path}: {problems[0].message}", problems[0].hint, problems[:MAX_SHOWN])
    if not 1 <= len(pairs) <= MAX_PLACES:
        refuse_file(path, "empty", f"this file has {len(pairs)} places", f"give 1 to {MAX_PLACES}")
    return pairs


MAX_SHOWN = 20
"""Problems of a CSV file that are listed."""


def _pair(row: list[str], before: float, whole: float) -> tuple[tuple[float, float], tuple[str, str] | None]:
    """The numbers of a row, and what is wrong with them with what to do, None if nothing is."""
    while len(row) > len(COLUMNS) and not row[-1].strip():
        row = row[:-1]
    numbers = list(_numbers(row))
    # A cell that is no number must not make way for the next column.
    if not len(numbers) == len(row) == len(COLUMNS):
        return (0.0, 0.0), ("this line is not two numbers", "write place and curvature, such as 120.5,1.8")
    place, value = numbers
    if abs(value) > MOST:
        return (0.0, 0.0), (f"a curvature of {value:g} /m is beyond {MOST:g} /m", "is it in 1/m?")
    return (place, value), _misplaced(place, before, whole)


def _numbers(row: list[str]) -> Iterator[float]:
    """What of a row is a finite number."""
    for cell in row:
        try:
            number = float(cell)
        except ValueError:
            continue
        if math.isfinite(number):
            yield number
