"""How people write what a display may be in truth: in the table `[errors]` of its file, and as options."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping
from typing import NamedTuple

from curveline.errors import InvalidInput
from curveline.scene import POSSIBLE, Display, DisplayErrors, Range
from curveline.shapes.file_keys import ErrorsTable
from curveline.shapes.toml_document import Document
from curveline.units import deg, mm, nmm, rounded_down, to_deg, to_mm, to_nmm, told_apart

Ends = tuple[float, float]

LARGEST = 1e8
"""A bound from which on it is only there for the sake of arithmetic."""
DIGITS = 9
"""Decimals that are left of a number that went to SI and back."""


class ErrorKey(NamedTuple):
    """A range as it is written: its key, what it is called in a sentence, its unit, and the ways to SI and back."""

    key: str
    name: str
    unit: str
    si: Callable[[float], float]
    back: Callable[[float], float]


def _part(percent: float) -> float:
    return percent / 100.0


def _percent(part: float) -> float:
    return 100.0 * part


ERROR_KEYS: Mapping[str, ErrorKey] = {
    "stiffness": ErrorKey("stiffness_percent", "stiffness", " %", _part, _percent),
    "mass": ErrorKey("mass_percent", "mass", " %", _part, _percent),
    "clamp_stiffness": ErrorKey(
        "clamp_stiffness_Nmm_per_deg",
        "clamp stiffness",
        " N mm/deg",
        lambda per_degree: nmm(per_degree) / deg(1.0),
        lambda per_radian: to_nmm(per_radian * deg(1.0)),
    ),
    "clamp_play": ErrorKey("clamp_play_deg", "clamp play", " deg", deg, to_deg),
    "clamp": ErrorKey("clamp_mm", "clamp", " mm", mm, to_mm),
    "span": ErrorKey("span_error_mm", "span", " mm", mm, to_mm),
    "friction": ErrorKey("friction_mm", "friction", " mm", mm, to_mm),
    "set_share": ErrorKey("set_percent", "set", " %", _part, _percent),
}
"""Of the fields of `DisplayErrors`, in their order."""


def display_errors(written: Mapping[str, Ends | None], called: Callable[[str], str] = str) -> DisplayErrors:
    """Ranges in SI from what is written under some of the keys, None for nothing.

    Raises InvalidInput for a range that is empty or that no display can have; `called` says what to call its key then.
    """
    ranges = {}
    for field, each in ERROR_KEYS.items():
        if (ends := written.get(each.key)) is None:
            continue
        low, high = ends
        # As round numbers, which bounds in SI are not.
        least, most = (float(f"{each.back(bound):.12g}") for bound in POSSIBLE[field])
        said = f"{called(each.key)} is {low:g} to {high:g}{each.unit}"
        if not low <= high:
            raise InvalidInput(f"{said}, which is no range", "give the lower end first")
        if not least <= low <= high <= most:
            bounds = (
                f"stay within {least:g} to {most:g}{each.unit}" if most < LARGEST else f"begin at {least:g} or more"
            )
            raise InvalidInput(f"{said}, beyond what a display can be", bounds)
        first, last = (min(max(each.si(end), POSSIBLE[field][0]), POSSIBLE[field][1]) for end in ends)
        ranges[field] = Range(first, last)
    return DisplayErrors(**ranges)


def as_written(errors: DisplayErrors) -> Iterator[tuple[ErrorKey, Ends]]:
    """Every range that there is, in the units of its key."""
    for field, drawn in errors.given.items():
        key = ERROR_KEYS[field]
        yield key, (round(key.back(drawn.low), DIGITS), round(key.back(drawn.high), DIGITS))


def as_plain(errors: DisplayErrors) -> dict[str, list[float | None]]:
    """Every range under its key as a document has it, with null for an infinite end."""
    return {each.key: [end if math.isfinite(end) else None for end in ends] for each, ends in as_written(errors)}


def in_words(errors: DisplayErrors) -> str:
    """Every range, in one sentence; empty if there is none."""
    return ", ".join(f"{each.name} {ends[0]:g} to {ends[1]:g}{each.unit}" for each, ends in as_written(errors))


def errors_of(table: ErrorsTable) -> DisplayErrors:
    """The ranges of a table that the rules found sound."""
    return display_errors({key: None if ends is None else (ends[0], ends[1]) for key, ends in table})


def check_errors(document: Document) -> None:
    """Record ranges that are empty, and bearings that would leave no rod free between them."""
    for key in ErrorsTable.model_fields:
        low, high = (document.number("errors", key, end) for end in (0, 1))
        if low is not None and high is not None and low > high:
            first, last = told_apart(low, high, 6)
            message = f"{key} goes from {first} down to {last}"
            document.problem(("errors", key), "empty-range", message, "write [from, to], the lower end first")
    span, clamp = (document.number(key) for key in ("span_mm", "clamp_mm"))
    longest, narrowest = document.number("errors", "clamp_mm", 1), document.number("errors", "span_error_mm", 0)
    if span is None or clamp is None or (longest is None and narrowest is None):
        return
    key = "clamp_mm" if longest is not None else "span_error_mm"
    held, across = (clamp if longest is None else longest), span + (narrowest or 0.0)
    if held >= across:
        message = f"{held:g} mm of rod in a bearing, and {across:g} mm between two"
        document.problem(("errors", key), "out-of-range", message, _leave_free(across))


def check_fit(errors: DisplayErrors, display: Display) -> None:
    """Raise InvalidInput if bearings could leave no rod free between them."""
    held = errors.clamp.high if errors.clamp else display.clamp
    across = display.span + (errors.span.low if errors.span else 0.0)
    if held >= across:
        message = f"errors allow {to_mm(held):g} mm of rod in a bearing, and {to_mm(across):g} mm between two"
        raise InvalidInput(message, _leave_free(to_mm(across)))


def _leave_free(across: float) -> str:
    most = f"clamp_mm up to {rounded_down(math.nextafter(across, 0.0), 6):g}, or " if across > 0.0 else ""
    return f"neighbouring bearings must leave some rod free: {most}a span_error_mm that takes less away"
