"""Settings of the mock radio: `mock:loss=0.3,seed=7,fresh` as data."""

from __future__ import annotations

import difflib
import math
import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

from curveline.drive_settings import AXES
from curveline.errors import InvalidInput
from curveline.radio.mock.air import Weather
from curveline.radio.mock.fault_injection import MISHAPS, Form, Mishap
from curveline.radio.protocol.band import WLAN_CHANNELS

NAMES = "a name alone, such as mock:stall, is answered with how it is written; there are"

BUSY_SHARE = 0.3
"""For what part of the time somebody sends on a WLAN channel that is only named."""


@dataclass(frozen=True)
class MockSpec:
    """What kind of display and air to model; `spread` is the largest part by which a motor is slower than told.

    `clamp` [N mm/deg] and `play` [deg] are how its bearings give, whatever the display's file says; `set` is the part
    that its rod has kept of the curvature of the states in which it was, or of those that are not wanted. `curvature`
    [1/m] is what its free rod is bent besides, `stiffness` by what part its EI exceeds that of the file, and its nodes
    are `scatter` times as far off as those of a good display are in a trial; a hand snaps
    the rod of segment `hand` over, from 1, once the nodes have come to rest. With `keys`
    the nodes hold the master key of the site's key file instead of the mock's open one; with `repower` all of them are
    switched off and on before anything else; with `bare` a new display is one that nobody has homed yet.
    """

    weather: Weather = field(default_factory=Weather)
    seed: int = 0
    nodes: int | None = None
    spread: float = 0.0
    realtime: bool = False
    fresh: bool = False
    keys: bool = False
    repower: bool = False
    bare: bool = False
    clamp: float | None = None
    play: float | None = None
    set: float = 0.0
    curvature: float = 0.0
    stiffness: float = 0.0
    scatter: float = 0.0
    hand: int | None = None
    mishaps: tuple[Mishap, ...] = ()


def parse_spec(text: str) -> MockSpec:
    """Settings after `mock:`; InvalidInput names the first one that is unknown, malformed or given twice."""
    values: dict[str, Any] = {}
    mishaps: dict[str, Mishap] = {}
    for part in filter(None, (piece.strip() for piece in text.split(","))):
        key = re.split("[=@]", part, maxsplit=1)[0]
        value = part[len(key) :]
        if key in values or key in mishaps:
            raise InvalidInput(f"the mock radio's setting {key!r} is given twice")
        if key in MISHAPS:
            mishaps[key] = _mishap(key, value)
        elif key in _FLAGS and not value:
            values[key] = True
        elif key in _READERS and value.startswith("="):
            values[key] = _read(key, value[1:])
        else:
            raise _unknown(key)
    weather = Weather(**{_WEATHER[key]: values.pop(key) for key in list(values) if key in _WEATHER})
    return MockSpec(weather=weather, mishaps=tuple(mishaps.values()), **values)


def _read(key: str, value: str) -> object:
    reader, form = _READERS[key]
    try:
        return reader(value)
    except ValueError:
        raise _malformed(f"{key}={value}", f"{key}={form}") from None


def _malformed(text: str, form: str) -> InvalidInput:
    return InvalidInput(f"the mock radio's {text} cannot be read", f"write it as {form}")


def _unknown(key: str) -> InvalidInput:
    if key in _READERS:
        return InvalidInput(f"the mock radio's {key} takes a value", f"write it as {key}={_READERS[key][1]}")
    if key in _FLAGS:
        return InvalidInput(f"the mock radio's {key} takes no value", f"write it as {key}")
    forms = _forms()
    close = difflib.get_close_matches(key, forms, n=1)
    hint = f"did you mean {close[0]}? Written as {forms[close[0]]}" if close else f"{NAMES}: {', '.join(forms)}"
    return InvalidInput(f"the mock radio has no setting {key!r}", hint)


def _forms() -> dict[str, str]:
    """Every setting, and how it is written."""
    settings = {key: f"{key}={form}" for key, (_, form) in _READERS.items()}
    faults = {key: key + row.form.value for key, row in MISHAPS.items()}
    return {**settings, **{key: key for key in _FLAGS}, **faults}


def _mishap(key: str, value: str) -> Mishap:
    """The mishap `key` out of what follows its name."""
    form = MISHAPS[key].form
    match = re.fullmatch(_FORMS[form], value)
    try:
        if match is None:
            raise ValueError
        found = match.groupdict()
        chance = _chance(found["chance"]) if "chance" in found else 0.0
        axis = AXES.index(found["axis"]) + 1 if "axis" in found else 0
        return Mishap(key, int(found.get("node", 0)), int(found.get("step", 0)), chance, axis)
    except ValueError:
        raise _malformed(f"{key}{value}", f"{key}{form.value}") from None


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


def _stiffness(text: str) -> float:
    value = float(text)
    if not 1e-6 <= value <= 1e6:
        raise ValueError
    return value


def _play(text: str) -> float:
    value = float(text)
    if not 0.0 <= value <= 45.0:
        raise ValueError
    return value


def _share(text: str) -> float:
    value = float(text)
    if not -1.0 <= value <= 1.0:
        raise ValueError
    return value


def _curvature(text: str) -> float:
    value = float(text)
    if not -20.0 <= value <= 20.0:
        raise ValueError
    return value


def _times(text: str) -> float:
    value = float(text)
    if not 0.0 <= value <= 10.0:
        raise ValueError
    return value


def _excess(text: str) -> float:
    value = float(text)
    if not -90.0 <= value <= 900.0:
        raise ValueError
    return 0.01 * value


def _noise(text: str) -> tuple[tuple[int, float], ...]:
    """WLAN channels and how busy they are, such as 6 or 1@0.2+13."""
    pairs = []
    for part in text.split("+"):
        number, at, share = part.partition("@")
        if _whole(number) not in WLAN_CHANNELS:
            raise ValueError
        pairs.append((int(number), _chance(share) if at else BUSY_SHARE))
    return tuple(pairs)


def _margin(text: str) -> float:
    value = float(text)
    if not -20.0 <= value <= 60.0:
        raise ValueError
    return value


def _whole(text: str) -> int:
    if not re.fullmatch(r"[0-9]{1,9}", text):
        raise ValueError
    return int(text)


_FLAGS = ("realtime", "fresh", "keys", "repower", "bare")
_WEATHER = {
    "loss": "loss",
    "dup": "duplicate",
    "stale": "stale",
    "corrupt": "corrupt",
    "noise": "noise",
    "weak": "margin",
}
_A_CHANCE = "<number from 0 to below 1>"
_READERS: Mapping[str, tuple[Callable[[str], object], str]] = {
    "loss": (_chance, _A_CHANCE),
    "dup": (_chance, _A_CHANCE),
    "stale": (_chance, _A_CHANCE),
    "corrupt": (_chance, _A_CHANCE),
    "noise": (_noise, "<WLAN channel from 1 to 13>, several with +, @<part of the time> after each that is not @0.3"),
    "weak": (_margin, "<dB from -20 to 60>"),
    "seed": (_whole, "<whole number>"),
    "nodes": (_whole, "<whole number>"),
    "spread": (_slowness, "<number from 0 to 0.9>"),
    "clamp": (_stiffness, "<N mm per degree>"),
    "play": (_play, "<degrees from 0 to 45>"),
    "set": (_share, "<number from -1 to 1>"),
    "curvature": (_curvature, "<1/m, from -20 to 20>"),
    "stiffness": (_excess, "<percent from -90 to 900>"),
    "scatter": (_times, "<number from 0 to 10>"),
    "hand": (_whole, "<number of a segment>"),
}
_NODE = "=(?P<node>[1-9][0-9]{0,2})"
_STEP = "@step(?P<step>[1-9][0-9]{0,4})"
_FORMS = {
    Form.NODE_STEP: _NODE + _STEP,
    Form.NODE: _NODE,
    Form.NODE_WORD: _NODE + "@word(?P<step>[1-9][0-9]{0,4})",
    Form.STEP: _STEP,
    Form.FULL_STEP: "=full" + _STEP,
    Form.CHANCE: "=(?P<chance>.*)",
    Form.AXIS_NODE: f"=(?P<axis>{'|'.join(AXES)})@(?P<node>[1-9][0-9]{{0,2}})",
}
