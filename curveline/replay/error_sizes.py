"""Errors of nodes and display as documents and tables have them: their keys, their names, in the units people write."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, fields
from typing import NamedTuple

from curveline.replay.monte_carlo import Errors
from curveline.shapes.error_keys import ERROR_KEYS
from curveline.units import to_deg, to_mm

DIGITS = 9
"""Decimals that are left of a number that went to SI and back."""


class _NodeError(NamedTuple):
    key: str
    name: str
    unit: str
    back: Callable[[float], float]


NODE_ERRORS: Mapping[str, _NodeError] = {
    "feed": _NodeError("feed_mm", "feed", " mm", to_mm),
    "feed_scale": _NodeError("feed_scale_percent", "scale", " %", lambda part: 100.0 * part),
    "angle": _NodeError("angle_deg", "angle", " deg", to_deg),
    "height": _NodeError("height_mm", "height", " mm", to_mm),
    "bow": _NodeError("bow_mm", "bow", " mm", to_mm),
    "unevenness": _NodeError("unevenness", "unevenness", "", float),
}
"""Of the fields of `Errors`."""


@dataclass(frozen=True)
class ErrorSize:
    """The size of one kind of error: in words, its key in a document, its value, and the unit as it is read."""

    name: str
    key: str
    value: float
    unit: str


def sizes_of(errors: Errors) -> Iterator[ErrorSize]:
    """Every kind of error of a node, in the units that people write."""
    for field in fields(errors):
        key, name, unit, back = NODE_ERRORS[field.name]
        yield ErrorSize(name, key, round(back(getattr(errors, field.name)), DIGITS), unit)


def key_of(field: str) -> str:
    """The key in documents of a field of `Errors` or `DisplayErrors`."""
    return NODE_ERRORS[field].key if field in NODE_ERRORS else ERROR_KEYS[field].key


def name_of(field: str) -> str:
    """What such a field is called in tables."""
    return NODE_ERRORS[field].name if field in NODE_ERRORS else ERROR_KEYS[field].name
