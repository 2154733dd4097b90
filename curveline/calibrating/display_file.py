"""A display file with what a calibration found, all else in it, comments too, left as it is."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Mapping
from typing import Any

from curveline.calibrating.calibrated import CLAMPS, STIFFNESS, RodCalibration
from curveline.calibrating.unknowns import ASYMMETRY
from curveline.shapes.changed_display import text_of
from curveline.shapes.toml_location import TomlMap
from curveline.system.files import AnyPath, refuse_file

MODULUS = "youngs_modulus_GPa"
REMARKED = re.compile(r"[^\n]*+(?:\n[ \t]+#[^\n]*+)*+")
VALUE = re.compile(r"[-+\w.]+|\[[^\]]*\]")
MADE = "# Found by curveline calibrate rod:"


def calibrated_text(found: RodCalibration) -> str:
    """The text of the display file with what was found; InvalidInput for one that is not written key by key."""
    before, keys = text_of(found.display), found.keys
    after = _changed(before, keys)
    wanted = tomllib.loads(before)
    for key, value in keys.items():
        wanted[key] = {**wanted.get(key, {}), **value} if isinstance(value, dict) else value
    if STIFFNESS in wanted["rod"]:
        wanted["rod"].pop(MODULUS, None)
    if CLAMPS not in keys:
        wanted.pop(CLAMPS, None)
    try:
        is_right = tomllib.loads(after) == wanted
    except tomllib.TOMLDecodeError:
        is_right = False
    if not is_right:
        name = found.display.path or found.display.name
        hint = "write it with a key on each line, and [rod] as a table: `curveline new display` makes one"
        refuse_file(name, "not-written", "the keys of this file cannot be changed one by one", hint)
    return after + "".join(f"\n{line}" for line in _remarks(found)) + ("\n" if found.has_asymmetry else "")


def _changed(text: str, keys: Mapping[str, Any]) -> str:
    """A file with other values of keys, in the order from its end to its begin, so that places stay."""
    rod = keys.get("rod", {})
    if rod:
        text = _measured(text, rod[STIFFNESS])
    text = _with(text, (CLAMPS,), keys[CLAMPS]) if CLAMPS in keys else _without(text, (CLAMPS,))
    if ("offsets",) not in TomlMap(text).keys and not re.search(r"(?m)^\[offsets\]", text):
        text = text.rstrip("\n") + f"\n\n[offsets]                        {MADE[:-1].lower()}\n"
        return text + "".join(f"{key} = {value}\n" for key, value in keys["offsets"].items())
    for key, value in keys["offsets"].items():
        text = _with(text, ("offsets", key), value)
    return text


def _measured(text: str, stiffness: float) -> str:
    """A file whose modulus, now in a comment, makes way for the stiffness that was found."""
    place = TomlMap(text).keys.get(("rod", MODULUS))
    if place is None:
        return _with(text, ("rod", STIFFNESS), stiffness)
    return f"{text[:place]}{STIFFNESS} = {stiffness!r}  {MADE[:-1].lower()}\n# {text[place:]}"


def _with(text: str, path: tuple[str, ...], value: Any) -> str:
    """With another value of a key, or a line for it behind the last one of its table."""
    found = TomlMap(text)
    if path in found.keys:
        offset = found.values[path]
        return text[:offset] + VALUE.sub(repr(value), text[offset:], count=1)
    table, depth = path[:-1], len(path)
    there = [place for other, place in found.values.items() if other[:-1] == table and len(other) == depth]
    scalars = [place for place in there if not text[place:].startswith(("{", "[\n"))]
    first_table = re.search(r"(?m)^\[", text)
    if not table and first_table:
        scalars = [place for place in scalars if place < first_table.start()]
    if not scalars:
        return text + f"\n{path[-1]} = {value!r}\n"
    rest = REMARKED.match(text, max(scalars))
    place = rest.end() if rest else len(text)
    return f"{text[:place]}\n{path[-1]} = {value!r}{text[place:]}"


def _without(text: str, path: tuple[str, ...]) -> str:
    found = TomlMap(text)
    if path not in found.keys:
        return text
    begin = found.keys[path]
    rest = REMARKED.match(text, begin)
    end = rest.end() if rest else len(text)
    return text[:begin] + text[end:].removeprefix("\n")


def _remarks(found: RodCalibration) -> list[str]:
    """What was found and cannot be written, as comments."""
    if not found.has_asymmetry:
        return []
    value, low, high = found.estimate(ASYMMETRY).as_given
    return [
        f"{MADE} the rod bends {abs(value):.2g} % harder to one side,",
        f"# bending_asymmetry_percent = {value:.3g} ({low:.3g} to {high:.3g}), which no simulation knows. What stands",
        "# above fits best without that.",
    ]


def to_display(found: RodCalibration, path: AnyPath = "", argv: tuple[str, ...] = ()) -> bytes:
    """The display file."""
    return calibrated_text(found).encode()
