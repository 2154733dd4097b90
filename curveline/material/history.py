"""What a rod went through: shapes and how long it was held in each, also as text, `SHAPE@8h,OTHER@30min`."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable
from dataclasses import dataclass

from curveline.errors import InvalidInput
from curveline.material.relaxation import LONGEST, check_seconds, check_temperature
from curveline.system.files import printable
from curveline.units import DAY, HOUR, MINUTE, WEEK, rounded_up

UNITS = {"s": 1.0, "min": MINUTE, "h": HOUR, "d": DAY, "w": WEEK}
"""In seconds."""
MEANT = {
    **dict.fromkeys(("sec", "secs", "second", "seconds"), "s"),
    **dict.fromkeys(("m", "mins", "minute", "minutes"), "min"),
    **dict.fromkeys(("hr", "hrs", "hour", "hours"), "h"),
    **dict.fromkeys(("day", "days"), "d"),
    **dict.fromkeys(("wk", "week", "weeks"), "w"),
}
"""What people write for them."""
HOW = "write a number and a unit, such as 30min, 8h or 2.5d; units are s, min, h, d and w"
MOST_DWELLS = 1000
EXAMPLE = "such as peak.toml@8h, or peak.toml@8h,home@30min for two in a row"


@dataclass(frozen=True)
class Dwell:
    """A shape, how long the rod was held in it [s], and the temperature then [C]; None for that of its law.

    Whoever reads it knows what a `shape` is; none is empty. InvalidInput for times and temperatures that make no sense.
    """

    shape: str  # whatever names it
    seconds: float  # [s]
    temperature: float | None = None  # [C]

    def __post_init__(self) -> None:
        if not self.shape:
            raise InvalidInput("a rod dwells in a shape, and none is named", f"name it, {EXAMPLE}")
        check_seconds(self.seconds)
        if self.temperature is not None:
            check_temperature(self.temperature)

    def __str__(self) -> str:
        warm = "" if self.temperature is None else f"@{self.temperature:g}C"
        return f"{self.shape}@{duration_text(self.seconds)}{warm}"


def parse_history(text: str) -> tuple[Dwell, ...]:
    """The dwells of a text, the first one first: `SHAPE@TIME`, or `SHAPE@TIME@40C`, with commas between them.

    InvalidInput says which of them cannot be read, and what to write.
    """
    parts = [part.strip() for part in text.split(",")]
    if len(parts) > MOST_DWELLS:
        raise InvalidInput(f"{len(parts)} shapes are too many", f"a history has {MOST_DWELLS} at most")
    return tuple(_dwell(part) for part in parts)


def history_text(history: Iterable[Dwell]) -> str:
    """A history as text, to be parsed again."""
    return ",".join(map(str, history))


def parse_duration(text: str) -> float:
    """A time such as 30min or 2.5 d [s]; InvalidInput says what to write instead."""
    found = re.fullmatch(r"\s*([+-]?[0-9.]+(?:[eE][+-]?[0-9]+)?)\s*([^\W\d_]*)\s*", text)
    try:
        number = float(found[1]) if found else math.nan
    except ValueError:
        number = math.nan
    if not found or math.isnan(number):
        raise InvalidInput(f"{_shown(text)} is no time", HOW)
    unit = found[2]
    if unit not in UNITS:
        if not unit:
            raise InvalidInput(f"{_shown(text)} has no unit", HOW)
        meant = MEANT.get(unit.lower(), unit.lower())
        hint = f"write {found[1]}{meant}; units are s, min, h, d and w" if meant in UNITS else HOW
        raise InvalidInput(f"{_shown(text)}: there is no unit of time {_shown(unit)}", hint)
    seconds = number * UNITS[unit]
    if not 0.0 <= seconds <= LONGEST:
        raise InvalidInput(f"{_shown(text)} is no time that a rod is held", f"give one from 0 to {LONGEST:g} s")
    return seconds


def duration_text(seconds: float, *, rounded: bool = False) -> str:
    """A time in the largest unit of which it is one or more, all of its digits, or two, rounded up: `1.5h`."""
    unit = next((each for each in reversed(UNITS) if seconds >= UNITS[each]), "s")
    value = seconds / UNITS[unit]
    if rounded:
        return f"{rounded_up(value, 2):g}{unit}"
    short = f"{value:.6g}"
    return f"{short}{unit}" if float(short) * UNITS[unit] == seconds else f"{seconds!r}s"


def _dwell(part: str) -> Dwell:
    if not part:
        raise InvalidInput("between two commas, or beside one, no shape is named", f"name it, {EXAMPLE}")
    head, found, last = part.rpartition("@")
    if not found:
        raise InvalidInput(f"{_shown(part)} does not say how long", f"add how long the rod is held, {EXAMPLE}")
    warm = re.fullmatch(r"\s*([+-]?[0-9.]+)\s*C\s*", last)
    if warm and "@" in head:
        shape, _, time = head.rpartition("@")
        return Dwell(_named(shape, part), parse_duration(time), _temperature(warm[1], part))
    return Dwell(_named(head, part), parse_duration(last))


def _named(shape: str, part: str) -> str:
    if not shape.strip():
        raise InvalidInput(f"{_shown(part)} names no shape", f"name it before the @, {EXAMPLE}")
    return shape.strip()


def _temperature(text: str, part: str) -> float:
    try:
        return float(text)
    except ValueError:
        raise InvalidInput(f"{_shown(part)}: {_shown(text)} is no temperature", "write it such as 40C") from None


def _shown(text: str) -> str:
    text = text.strip()
    return repr(printable(text if len(text) <= 60 else f"{text[:57]}..."))
