"""What was read of strips that were bent around a drum and let go: a CSV file, or every problem of it at once.

A row is one reading: `drum_radius_mm` to the middle of the strip, how long it was `held` there and how long `after`
that it was read, both with their units, and its curvature then, positive as on the drum: as `curvature_per_m`, as
`radius_mm`, or as the `arc_height_mm` over a chord of `chord_mm`. `temperature_C` may be there; 23 is meant without.
Rows that were held for 0s tell how the strip was curved before: their mean is subtracted from the others.
"""

from __future__ import annotations

import csv
import difflib
import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

from curveline.errors import Diagnostic, InvalidInput
from curveline.material.history import parse_duration
from curveline.material.relaxation import REFERENCE_C, check_temperature
from curveline.phrases import counted
from curveline.system.file_kinds import READINGS, refuse_other_kind
from curveline.system.files import AnyPath, decode_text, excerpt, printable
from curveline.system.given_files import read_given
from curveline.units import mm

MAX_BYTES = 1_000_000
LONGEST_LINE = 10_000
"""Characters."""
MOST_PROBLEMS = 100
ALWAYS = ("drum_radius_mm", "held", "after")
WAYS = (("curvature_per_m",), ("radius_mm",), ("arc_height_mm", "chord_mm"))
"""Columns that say the curvature, in one way of three."""
MAY = ("temperature_C",)
COLUMNS = (*ALWAYS, *(column for way in WAYS for column in way), *MAY)
HEADER = "drum_radius_mm,held,after,arc_height_mm,chord_mm"
HOW = f"the first line names the columns, such as {HEADER}"
IN_WAYS = "curvature_per_m, or radius_mm, or arc_height_mm and chord_mm"


@dataclass(frozen=True)
class DrumReading:
    """A strip that was bent by `bend` [1/m] for `held` [s], let go, and had `curvature` [1/m] `after` [s] that."""

    bend: float
    held: float
    after: float
    curvature: float
    temperature: float = REFERENCE_C  # [C] all the time


class _FaultError(Exception):
    """What is wrong with a cell: its column, what it is, what to do."""


def read_drum_readings(path: AnyPath) -> tuple[DrumReading, ...]:
    """The readings of a file, a pipe, or `-`, standard input, less the curvature that the strip had before.

    InvalidInput lists every problem of the file.
    """
    given = read_given(path, MAX_BYTES)
    text = decode_text(given.data, given.name)
    refuse_other_kind(text, given.name, READINGS)
    return _Table(given.name, text).readings()


class _Table:
    """A CSV text under examination."""

    def __init__(self, name: str, text: str) -> None:
        self._name, self._lines, self._problems = name, text.split("\n"), list[Diagnostic]()

    def readings(self) -> tuple[DrumReading, ...]:
        """What was read; InvalidInput if anything is wrong."""
        rows = [
            (number, line) for number, line in enumerate(self._lines, 1) if line.strip() and line.lstrip()[0] != "#"
        ]
        if not rows:
            self._problem(1, "empty", "there is nothing in it", HOW)
            raise self._error()
        self._check_lengths(rows)
        delimiter = ";" if ";" in rows[0][1] else ","
        head = [cell.strip() for cell in _cells(rows[0][1], delimiter)]
        self._check_head(rows[0][0], head)
        if self._problems:
            raise self._error()
        found = [self._reading(number, head, _cells(line, delimiter)) for number, line in rows[1:]]
        if self._problems:
            raise self._error()
        return self._less_before([each for each in found if each is not None])

    def _check_lengths(self, rows: Iterable[tuple[int, str]]) -> None:
        """Refuse lines with what no reading takes, which may be more than a cell can hold."""
        for number, line in rows:
            if len(line) > LONGEST_LINE:
                self._problem(number, "too-large", "this line is too long", HOW)
        if self._problems:
            raise self._error()

    def _check_head(self, line: int, head: Sequence[str]) -> None:
        for index, column in enumerate(head):
            if column not in COLUMNS:
                close = difflib.get_close_matches(column, COLUMNS, n=1)
                hint = f"did you mean {close[0]}?" if close else f"columns are {', '.join(COLUMNS)}; {HOW}"
                self._problem(line, "unknown-column", f"there is no column {_shown(column)}", hint)
            elif column in head[:index]:
                self._problem(line, "duplicate-column", f"{column} stands there twice", "keep one of them")
        for column in ALWAYS:
            if column not in head and not self._problems:
                self._problem(line, "missing-column", f"there is no column {column}", HOW)
        ways = [way for way in WAYS if any(column in head for column in way)]
        if len(ways) > 1:
            self._problem(line, "two-ways", "the curvature is given in two ways", f"keep one: {IN_WAYS}")
        elif not self._problems and not (ways and all(column in head for column in ways[0])):
            self._problem(line, "missing-column", "no column gives the curvature", f"add one of: {IN_WAYS}")

    def _reading(self, line: int, head: Sequence[str], cells: Sequence[str]) -> DrumReading | None:
        if len(cells) != len(head):
            message = f"{counted(len(cells), 'value')} for {counted(len(head), 'column')}"
            self._problem(line, "item-count", message, "write a value for each, with a comma between two")
            return None
        try:
            return _reading_of(dict(zip(head, (cell.strip() for cell in cells), strict=True)))
        except _FaultError as fault:
            column, message, hint = fault.args
            self._problem(line, "bad-value", f"{column}: {message}", hint)
            return None

    def _less_before(self, found: Iterable[DrumReading]) -> tuple[DrumReading, ...]:
        rows = list(found)
        before = [each.curvature for each in rows if each.held == 0.0]
        natural = math.fsum(before) / len(before) if before else 0.0
        after = [
            DrumReading(each.bend, each.held, each.after, each.curvature - natural, each.temperature)
            for each in rows
            if each.held > 0.0
        ]
        if not after:
            hint = "hold a strip on a drum for hours or days, let it go, and read its curvature several times"
            self._problem(1, "empty", "no strip was held in it", hint)
            raise self._error()
        return tuple(after)

    def _problem(self, line: int, code: str, message: str, hint: str) -> None:
        if len(self._problems) < MOST_PROBLEMS:
            source, caret = excerpt(self._lines[line - 1], 1)
            self._problems.append(Diagnostic(self._name, line, 1, code, message, hint, source, caret))

    def _error(self) -> InvalidInput:
        return InvalidInput(f"{self._name}: {counted(len(self._problems), 'problem')}", diagnostics=self._problems)


def _cells(line: str, delimiter: str) -> list[str]:
    return next(csv.reader([line], delimiter=delimiter))


def _reading_of(row: Mapping[str, str]) -> DrumReading:
    temperature = _number(row, "temperature_C") if row.get("temperature_C") else REFERENCE_C
    try:
        check_temperature(temperature)
    except InvalidInput as error:
        raise _FaultError("temperature_C", error.message, error.hint) from None
    radius = mm(_number(row, "drum_radius_mm", above=0.0))
    return DrumReading(1.0 / radius, _time(row, "held"), _time(row, "after"), _curvature(row), temperature)


def _curvature(row: Mapping[str, str]) -> float:
    if "curvature_per_m" in row:
        return _number(row, "curvature_per_m")
    if "radius_mm" in row:
        radius = mm(_number(row, "radius_mm"))
        if radius == 0.0:
            raise _FaultError("radius_mm", "a strip has no radius of 0", "of a straight strip give curvature_per_m = 0")
        return 1.0 / radius
    height, chord = mm(_number(row, "arc_height_mm")), mm(_number(row, "chord_mm", above=0.0))
    if abs(height) > 0.5 * chord:
        hint = "take a shorter chord: the arc is to be less than half a circle"
        raise _FaultError("arc_height_mm", "the arc is higher than half its chord", hint)
    # Of a circle through both ends of the chord and the top of the arc.
    return 8.0 * height / (chord * chord + 4.0 * height * height)


def _number(row: Mapping[str, str], column: str, above: float = -math.inf) -> float:
    text = row[column]
    try:
        value = float(text)
    except ValueError:
        point = text.replace(",", ".")
        hint = f"write {point}, with a point" if point != text and _is_number(point) else "write a number"
        raise _FaultError(column, f"{_shown(text)} is no number", hint) from None
    if not (math.isfinite(value) and abs(value) < 1e9):
        raise _FaultError(column, f"{_shown(text)} is no ordinary number", "write a finite number")
    if value <= above:
        raise _FaultError(column, f"{_shown(text)} must be above {above:g}", f"write a number above {above:g}")
    return value


def _is_number(text: str) -> bool:
    try:
        return math.isfinite(float(text))
    except ValueError:
        return False


def _time(row: Mapping[str, str], column: str) -> float:
    try:
        return parse_duration(row[column])
    except InvalidInput as error:
        raise _FaultError(column, error.message, error.hint) from None


def _shown(text: str) -> str:
    return repr(printable(text if len(text) <= 40 else f"{text[:37]}..."))
