"""Numbers of `[rod]` written into a display file, everything else in it, comments too, left as it is."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Mapping
from typing import NoReturn

from curveline.shapes.files import MAX_BYTES, read_display
from curveline.shapes.set_rules import EXPONENT, FRACTIONS, STRENGTH, TIMES
from curveline.shapes.toml_location import TomlMap
from curveline.system.files import AnyPath, decode_text, read_file, refuse_file, write_file

_REMARKED = re.compile(r"[^\n]*+(?:\n[ \t]+#[^\n]*+)*+")
_NUMBER = re.compile(r"[-+\w.]+")
BYTE_ORDER_MARK = b"\xef\xbb\xbf"


def write_set(path: AnyPath, keys: Mapping[str, float]) -> None:
    """Write `set_strength`, and `set_exponent` or none, into the rod of a display file.

    InvalidInput for a file that is no display, says the set in another way, or has the rod in a way that cannot be
    changed line by line; the lines to be pasted are in the hint.
    """
    read_display(path)
    data = read_file(path, MAX_BYTES)
    text = decode_text(data, str(path))
    new = with_rod_keys(text, keys, drop=[key for key in (STRENGTH, EXPONENT) if key not in keys])
    if new is None or {TIMES, FRACTIONS} & tomllib.loads(text)["rod"].keys():
        _refuse(path, keys, is_in_other_way=new is not None)
    end = "\r\n" if b"\r\n" in data else "\n"
    mark = BYTE_ORDER_MARK if data.startswith(BYTE_ORDER_MARK) else b""
    write_file(path, mark + new.replace("\n", end).encode(), force=True)


def toml_lines(keys: Mapping[str, float]) -> list[str]:
    """Keys as lines of a TOML table."""
    return [f"{key} = {value!r}" for key, value in keys.items()]


def with_rod_keys(text: str, keys: Mapping[str, float], drop: list[str]) -> str | None:
    """A display file with some numbers of its rod, and without others; None if that would change anything else."""
    before = tomllib.loads(text)
    changed = text
    for key in drop:
        changed = _without(changed, key)
    for key, value in keys.items():
        changed = _with(changed, key, value)
    rod = {key: value for key, value in before["rod"].items() if key not in drop}
    try:
        is_right = tomllib.loads(changed) == {**before, "rod": {**rod, **keys}}
    except tomllib.TOMLDecodeError:
        return None
    return changed if is_right else None


def _with(text: str, key: str, value: float) -> str:
    """With another value of a key, or a line for it below the last one of the table."""
    found = TomlMap(text)
    if ("rod", key) in found.keys:
        offset = found.values["rod", key]
        return text[:offset] + _NUMBER.sub(repr(value), text[offset:], count=1)
    last = max(offset for path, offset in found.values.items() if path[0] == "rod" and len(path) == 2)
    # What is remarked on the last key may go on in the lines below it.
    rest = _REMARKED.match(text, last)
    place = rest.end() if rest else len(text)
    return f"{text[:place]}\n{key} = {value!r}{text[place:]}"


def _without(text: str, key: str) -> str:
    return re.sub(rf"(?m)^[ \t]*{key}[ \t]*=[^\n]*\n?", "", text)


def _refuse(path: AnyPath, keys: Mapping[str, float], *, is_in_other_way: bool) -> NoReturn:
    lines = " and ".join(f"`{line}`" for line in toml_lines(keys))
    if is_in_other_way:
        message = f"{TIMES} and {FRACTIONS} say what set the rod takes"
        refuse_file(str(path), "two-ways", message, f"take them out, and put {lines} into [rod]")
    message = "its rod is not written as [rod] with a key on each line, and is left as it is"
    refuse_file(str(path), "not-written", message, f"put {lines} there")
