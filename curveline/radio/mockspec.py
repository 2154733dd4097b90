"""Settings of the mock radio: `mock:loss=0.3,seed=7,fresh` as data."""

from __future__ import annotations

import difflib
import math
import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

from curveline.errors import InvalidInput
from curveline.radio.air import Weather


@dataclass(frozen=True)
class Mishap:
    """Something that happens to a node (from 1) in the middle of a step (from 1)."""

    node: int
    step: int


@dataclass(frozen=True)
class MockSpec:
    """What kind of display and air to model; `spread` is the largest part by which a motor is slower than told."""

    weather: Weather = field(default_factory=Weather)
    seed: int = 0
    nodes: int | None = None
    spread: float = 0.0
    realtime: bool = False
    fresh: bool = False
    stall: Mishap | None = None
    reboot: Mishap | None = None


def parse_spec(text: str) -> MockSpec:
    """Settings after `mock:`; InvalidInput names the first one that is unknown, malformed or given twice."""
    values: dict[str, Any] = {}
    for part in filter(None, (piece.strip() for piece in text.split(","))):
        key, equals, value = part.partition("=")
        if key in values:
            raise InvalidInput(f"the mock radio's setting {key!r} is given twice")
        if key in _FLAGS and not equals:
            values[key] = True
        elif key in _READERS and equals:
            values[key] = _read(key, value)
        else:
            raise _unknown(key)
    weather = Weather(**{_WEATHER[key]: values.pop(key) for key in list(values) if key in _WEATHER})
    return MockSpec(weather=weather, **values)


def _read(key: str, value: str) -> object:
    reader, form = _READERS[key]
    try:
        return reader(value)
    except ValueError:
        raise InvalidInput(f"the mock radio's {key}={value} is not {form}", hint=_takes()) from None


def _unknown(key: str) -> InvalidInput:
    close = difflib.get_close_matches(key, [*_READERS, *_FLAGS], n=1)
    guess = f"; did you mean {close[0]!r}?" if close else ""
    if key in _READERS or key in _FLAGS:
        guess = "; it takes a value" if key in _READERS else "; it takes no value"
    return InvalidInput(f"the mock radio has no setting {key!r} of this form{guess}", hint=_takes())


def _takes() -> str:
    examples = [f"{key}={form}" for key, (_, form) in _READERS.items()]
    return "it takes, separated by commas: " + ", ".join([*examples, *_FLAGS])


def _chance(text: str) -> float:
    value = float(text)
    if not 0.0 <= value < 1.0 or math.isnan(value):
        raise ValueError
    return value


def _slowness(text: str) -> float:
    value = _chance(text)
    if value > 0.9:
        raise ValueError
    return value


def _whole(text: str) -> int:
    if not re.fullmatch(r"[0-9]{1,9}", text):
        raise ValueError
    return int(text)


def _mishap(text: str) -> Mishap:
    match = re.fullmatch(r"([1-9][0-9]{0,2})@step([1-9][0-9]{0,4})", text)
    if match is None:
        raise ValueError
    return Mishap(int(match[1]), int(match[2]))


_FLAGS = ("realtime", "fresh")
_WEATHER = {"loss": "loss", "dup": "duplicate", "stale": "stale", "corrupt": "corrupt"}
_A_CHANCE = "<number from 0 to below 1>"
_READERS: Mapping[str, tuple[Callable[[str], object], str]] = {
    "loss": (_chance, _A_CHANCE),
    "dup": (_chance, _A_CHANCE),
    "stale": (_chance, _A_CHANCE),
    "corrupt": (_chance, _A_CHANCE),
    "seed": (_whole, "<whole number>"),
    "nodes": (_whole, "<whole number>"),
    "spread": (_slowness, "<number from 0 to 0.9>"),
    "stall": (_mishap, "<node>@step<number>"),
    "reboot": (_mishap, "<node>@step<number>"),
}
